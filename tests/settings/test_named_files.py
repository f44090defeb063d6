"""The certificates that a YAML names."""

from pathlib import Path

from bridges.settings.load import understood
from bridges.settings.named_files import certificate_files

ROOT = Path(__file__).parents[2]
RMF = """rmf:
  transport: zenoh
  zenoh:
    connect: [tls/rmf:7447]
    tls: {ca: /e/ca.pem, certificate: /e/lift.pem, private_key: /e/lift.key}
"""


def test_certificates_of_graph_and_buses_are_found_with_their_keys() -> None:
    text = (ROOT / "config/door_mqtt.yaml").read_text()
    head, _, rest = text.partition("rmf:\n")
    _, _, rest = rest.partition("\nbuses:")
    body = f"{head}{RMF}\nbuses:{rest}".replace(
        "type: mqtt\n",
        "type: mqtt\n    tls: {ca_file: /e/b.pem, certificate_file: /e/c.pem, key_file: /e/c.key}\n",
        1,
    )
    config = understood(Path("/e/door.yaml"), body.encode())
    (bus,) = config.buses
    assert certificate_files(config) == {
        "rmf.zenoh.tls.ca": "/e/ca.pem",
        "rmf.zenoh.tls.certificate": "/e/lift.pem",
        f"buses.{bus}.tls.ca_file": "/e/b.pem",
        f"buses.{bus}.tls.certificate_file": "/e/c.pem",
    }


def test_the_ca_of_a_controller_on_https_is_found() -> None:
    text = (ROOT / "config/door_http.yaml").read_text().replace("192.168.1.70", "https://relay")
    text = text.replace("type: http\n", "type: http\n    ca_file: /e/ca.pem\n", 1)
    config = understood(Path("/e/door.yaml"), text.encode())
    assert [*certificate_files(config).values()] == ["/e/ca.pem"]

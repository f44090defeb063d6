"""Secrets and access rights at a broker: TLS, the bus's own certificate, user and password, and
permissions."""

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import trustme

from drivers.hal import HalError
from hal_fakes.mosquitto import Mosquitto
from tests.drivers.hal.mqtt.broker import STATE, bus_to, reason
from tests.waiting import wait_until


class Authority:
    """A certificate authority that keeps its files in `folder`."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self._folder = folder
        self._ca = trustme.CA()
        self.ca = self.file("ca.pem", self._ca.cert_pem)

    def file(self, name: str, *parts: trustme.Blob) -> str:
        path = self._folder / name
        for n, part in enumerate(parts):
            part.write_to_path(str(path), append=n > 0)
        return str(path)

    def issue(self, name: str) -> tuple[str, str]:
        """Issue a certificate for this host or user. Return the paths of the certificate and of its
        key."""
        found = self._ca.issue_cert(name)
        chain = self.file(f"{name}.pem", *found.cert_chain_pems)
        return chain, self.file(f"{name}.key", found.private_key_pem)


Start = Callable[..., Mosquitto]


@pytest.fixture
def start() -> Iterator[Start]:
    """Yield a function that starts a broker. All brokers end with the test."""
    brokers: list[Mosquitto] = []

    def started(*lines: str) -> Mosquitto:
        brokers.append(Mosquitto(lines))
        return brokers[-1]

    yield started
    for broker in brokers:
        broker.close()


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority(tmp_path / "authority")


def tls(authority: Authority, host: str = "127.0.0.1") -> tuple[str, ...]:
    chain, key = authority.issue(host)
    return "allow_anonymous true", f"certfile {chain}", f"keyfile {key}"


def test_a_broker_with_a_certificate_of_our_authority_is_believed(
    start: Start, authority: Authority
) -> None:
    broker = start(*tls(authority))
    with bus_to(broker.port, tls={"ca_file": authority.ca}, timeout_s=5) as bus:
        assert bus.up().up


PAHO_LEAVES_A_SOCKET = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
"""A mark that ignores a warning of pytest. The warning comes because paho does not close its socket
after a failed handshake."""


@PAHO_LEAVES_A_SOCKET
def test_a_broker_with_anothers_certificate_is_refused(
    start: Start, authority: Authority, tmp_path: Path
) -> None:
    broker = start(*tls(Authority(tmp_path / "another")))
    with (
        bus_to(broker.port, tls={"ca_file": authority.ca}, timeout_s=5) as bus,
        pytest.raises(
            HalError, match=r"TLS with .* fails: .*unable to get local issuer certificate"
        ),
    ):
        bus.up()


@PAHO_LEAVES_A_SOCKET
def test_a_broker_with_the_certificate_of_another_host_is_refused(
    start: Start, authority: Authority
) -> None:
    broker = start(*tls(authority, "broker.example"))
    with (
        bus_to(broker.port, tls={"ca_file": authority.ca}, timeout_s=5) as bus,
        pytest.raises(HalError, match=r"certificate is not valid for '127\.0\.0\.1'"),
    ):
        bus.up()


def test_a_broker_that_wants_our_certificate_gets_it(start: Start, authority: Authority) -> None:
    broker = start(*tls(authority), f"cafile {authority.ca}", "require_certificate true")
    chain, key = authority.issue("door.example")
    ours = {"ca_file": authority.ca, "certificate_file": chain, "key_file": key}
    with bus_to(broker.port, tls=ours, timeout_s=5) as bus:
        assert bus.up().up
    with (
        bus_to(broker.port, tls={"ca_file": authority.ca}, timeout_s=5) as bus,
        pytest.raises(HalError),
    ):
        bus.up()


def test_a_missing_file_is_named(authority: Authority) -> None:
    with (
        bus_to(1883, tls={"ca_file": "/no/ca.pem"}) as bus,
        pytest.raises(HalError, match=r"tls: /no/ca\.pem cannot be read"),
    ):
        bus.up()


@pytest.fixture
def guarded(start: Start, tmp_path: Path) -> Mosquitto:
    """Return a broker with the user `door`, whose password is `sesame`. The user may only write."""
    names, rights = tmp_path / "names", tmp_path / "rights"
    subprocess.run(["mosquitto_passwd", "-b", "-c", names, "door", "sesame"], check=True)
    rights.write_text("user door\ntopic write relay/#\n")
    return start("allow_anonymous false", f"password_file {names}", f"acl_file {rights}")


def secret(tmp_path: Path, text: str) -> str:
    path = tmp_path / "password"
    path.write_text(text)
    path.chmod(0o600)
    return str(path)


def test_the_password_is_read_from_its_file_for_each_connection(
    guarded: Mosquitto, tmp_path: Path
) -> None:
    file = secret(tmp_path, "wrong")
    with bus_to(guarded.port, user="door", password_file=file) as bus:
        with pytest.raises(HalError, match="the broker refuses the connection: not authorized"):
            bus.up()
        secret(tmp_path, "sesame\n")
        bus.insist()
        assert bus.up().up


def test_a_topic_that_we_may_not_read_is_named(guarded: Mosquitto, tmp_path: Path) -> None:
    file = secret(tmp_path, "sesame")
    with bus_to(guarded.port, version="3.1.1", user="door", password_file=file) as bus:
        bus.listen(STATE)
        bus.up()
        wait_until(lambda: reason(bus, STATE), "a reason")
        assert reason(bus, STATE).startswith(
            (
                "the broker refuses the subscription to relay/state",
                "no message has come on relay/state",
            )
        )


def test_a_command_that_we_may_not_send_is_an_error(guarded: Mosquitto, tmp_path: Path) -> None:
    file = secret(tmp_path, "sesame")
    with (
        bus_to(guarded.port, user="door", password_file=file) as bus,
        pytest.raises(HalError, match="the broker refuses the message: not authorized"),
    ):
        bus.publish("lift/set", "ON")

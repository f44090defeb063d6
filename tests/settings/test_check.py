"""`rmf-bridge check` prints problems or the wiring table for a person."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bridges.cli import main
from tests.settings.reading import RIGHT, changed
from tests.settings.test_sections import WEB
from tests.system.test_certificates import certificate

TABLE = """\
gate.yaml: gate, driver contact
RMF: domain 7; transport dds; network subnet; release auto; publishes door_states; hears -

bus header (pins)
  device  signal  point    direction  active  pull  debounce  at rest  wire broken
  north   opened  A0 = 0A  in         high    up    default   -        asserted
  north   closed  A1 = 1A  in         low     none  0.01 s    -        floats
  north   hold    A2 = 2A  out        low     -     -         high     not asserted

north: settings
  setting         value          not the default
  lanes           in, out
  codes           1: in, 2: out
  limits.open_s   3 s            default: 5 s
  limits.close_s  -
  limits.tries    2              default: 3
  limits.even     2
  limits.gain     1
  limits.loud     no
  limits.baud     9600
  limits.label    0

OK
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in an empty folder with a wide terminal, so that a test types file names as a user does."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "130")


def check(*arguments: str) -> int:
    return main(["check", *arguments])


def test_the_wiring_is_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    text = changed("pull: down", "pull: none")
    text = changed("{point: A2, active: high}", "{point: A2, active: low}", text)
    Path("gate.yaml").write_text(text)
    assert check("gate.yaml") == 0
    assert capsys.readouterr() == (TABLE, "")


def test_each_bus_has_its_table(capsys: pytest.CaptureFixture[str]) -> None:
    text = changed(
        "  header: {type: pins}", "  header: {type: pins}\n  box: {type: module, host: h}"
    )
    text = changed("    lanes:", "    bus: header\n    lanes:", text) + (
        "  走廊:\n    bus: box\n    lanes: [in]\n    inputs: {}\n"
        "    outputs: {hold: {point: coil 7, active: high}}\n"
    )
    Path("gate.yaml").write_text(text)
    assert check("gate.yaml") == 0
    out = capsys.readouterr().out
    assert out[out.index("bus box") : out.index("north: settings")] == (
        "bus box (module): host h, port 502\n"
        "  device  signal  point   direction  active  pull  debounce  at rest  wire broken\n"
        "  走廊    hold    coil 7  out        high    -     -         low      not asserted\n"
        "\n"
    )


def test_a_driver_without_wires_shows_its_addresses(capsys: pytest.CaptureFixture[str]) -> None:
    Path("gate.yaml").write_text(WEB)
    assert check("gate.yaml") == 0
    assert capsys.readouterr() == (
        "gate.yaml: gate, driver web\n"
        "RMF: domain ROS_DOMAIN_ID or 0; transport auto; network subnet; release auto; publishes"
        " door_states; hears -\n"
        "\n"
        "bus server (web): host 192.168.1.7\n"
        "  device  what      meaning\n"
        "  north   polls     http://192.168.1.7/side\n"
        "  north   identity  not verified\n"
        "  south   polls     http://192.168.1.7/gate\n"
        "  south   identity  not verified\n"
        "\n"
        "north: settings\n"
        "  setting  value  not the default\n"
        "  page     side   default: gate\n"
        "\n"
        "south: settings\n"
        "  setting  value\n"
        "  page     gate\n"
        "\n"
        "OK\n",
        "",
    )


def test_problems_go_to_stderr_with_their_number(capsys: pytest.CaptureFixture[str]) -> None:
    Path("gate.yaml").write_text(changed("tries: 2", "tries: 0, gian: 1"))
    assert check("gate.yaml") == os.EX_CONFIG
    assert capsys.readouterr() == (
        "",
        "gate.yaml:15:32: 'tries' is 0: write a whole number of at least 1\n"
        "gate.yaml:15:35: unknown key 'gian': did you mean 'gain'? known here: "
        "open_s, close_s, tries, even, gain, loud, baud, label\n"
        "2 errors\n",
    )


def test_one_wrong_file_makes_the_result_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    Path("gate.yaml").write_text(RIGHT)
    assert check("no.yaml", "gate.yaml") == os.EX_CONFIG
    out, err = capsys.readouterr()
    assert out.startswith("gate.yaml: gate, driver contact\n")
    assert err == ("no.yaml:1:1: cannot be read: No such file or directory\n1 error\n")


def test_warnings_do_not_make_a_file_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    text = changed("    limits:", "    accept_unsafe: {hold: the door is light}\n    limits:")
    Path("gate.yaml").write_text(changed("tries: 2", "loud: true", text))
    assert check("gate.yaml") == 0
    out, err = capsys.readouterr()
    assert out.startswith("gate.yaml: gate, driver contact\n")
    assert out.endswith("\nOK, 2 warnings\n")
    assert err == (
        "gate.yaml:15:21: warning: 'north': unsafe wiring of 'hold' is accepted: "
        "the door is light\n"
        "gate.yaml:16:31: warning: 'north': it will be loud\n"
    )


def test_check_loads_no_library_that_it_does_not_need() -> None:
    lift = Path(__file__).parents[2] / "config" / "lift_dry_contact.yaml"
    libraries = (
        "cantools can canopen pymodbus serial requests gpiozero cyclonedds zenoh rclpy jinja2"
    )
    program = (
        "import sys; from bridges.cli import main; main(['check', '-q', sys.argv[1]]);"
        f"print(sorted(set('{libraries}'.split()) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program, lift], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_quiet_prints_problems_only(capsys: pytest.CaptureFixture[str]) -> None:
    Path("gate.yaml").write_text(changed("tries: 2", "loud: true"))
    assert check("-q", "gate.yaml") == 0
    assert capsys.readouterr() == ("", "")
    Path("gate.yaml").write_text(changed("tries: 2", "loud: yes"))
    assert check("--quiet", "gate.yaml") == os.EX_CONFIG
    assert len(capsys.readouterr().err.splitlines()) == 2


def test_a_certificate_that_has_ended_or_ends_soon_is_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ended = certificate(tmp_path / "ca.pem", -3.5)
    soon = certificate(tmp_path / "lift.pem", 400, 12.5)
    Path("gate.yaml").write_text(with_tls(ended, soon))
    assert check("gate.yaml") == 0
    out, err = capsys.readouterr()
    assert out.endswith("\nOK, 2 warnings\n")
    first, second = err.splitlines()
    assert first.startswith(f"gate.yaml:3:68: warning: {ended} ended 3 days ago, on ")
    assert second.startswith(f"gate.yaml:3:{83 + len(ended)}: warning: {soon} ends in 12 days, on ")
    assert second.endswith(": renew the certificate, and restart the daemon")


def test_an_unknown_or_late_end_of_a_certificate_is_no_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A missing certificate is no warning, because `check` may run on another machine than the daemon.
    A missing openssl is no warning either."""
    late, missing = certificate(tmp_path / "ca.pem", 31), str(tmp_path / "missing.pem")
    Path("gate.yaml").write_text(with_tls(late, missing))
    assert check("gate.yaml") == 0
    Path("gate.yaml").write_text(with_tls(late, certificate(tmp_path / "lift.pem", 1)))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert check("gate.yaml") == 0
    assert capsys.readouterr().err == ""


def with_tls(ca: str, own: str) -> str:
    tls = f"tls: {{ca: {ca}, certificate: {own}, private_key: /k}}"
    new = f"{{transport: zenoh, zenoh: {{connect: [tls/rmf:7447], {tls}}}}}"
    return changed("{transport: dds, domain_id: 7}", new)

"""Checks of several files together, for problems that no single file shows."""

import os
from pathlib import Path

import pytest

from bridges.cli import main

CONFIG = Path(__file__).parents[2] / "config"

DOOR = """\
kind: door
driver: dry_contact
rmf: {domain_id: 3}
buses:
  b: {type: modbus, tcp: {host: 192.168.1.50}, without_watchdog: {1: a bench}}
doors:
  ward:
    inputs:
      opened: {point: unit 1 discrete input 0, active: high}
      closed: {point: unit 1 discrete input 1, active: high}
    outputs:
      hold_open: {point: unit 1 coil 0, active: high}
"""
SECOND = (
    DOOR.replace("ward:", "lab:")
    .replace("input 0", "input 4")
    .replace("input 1", "input 5")
    .replace("coil 0", "coil 4")
)
TCP = "tcp: {host: 192.168.1.50}"
SERIAL = "serial: {port: /dev/serial/by-id/x, baudrate: 9600, parity: none, stopbits: 1}"
GPIO = (
    DOOR.replace(f"modbus, {TCP}, without_watchdog: {{1: a bench}}", "gpio")
    .replace("unit 1 discrete input 0, active: high", '"J8:29", active: high, pull: down')
    .replace("unit 1 discrete input 1, active: high", '"J8:31", active: high, pull: down')
    .replace("unit 1 coil 0", "BCM18")
)
GATEWAY = (
    "b.yaml:5:3: warning: 192.168.1.50:502 is also polled in a.yaml for unit 1: many gateways take"
    " only one client: use one file for each gateway"
)


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def said(
    capsys: pytest.CaptureFixture[str], first: str, second: str, *options: str
) -> tuple[int, list[str]]:
    """Return the exit code and the complaints of `check a.yaml b.yaml`."""
    Path("a.yaml").write_text(first)
    Path("b.yaml").write_text(second)
    code = main(["check", "a.yaml", "b.yaml", *options])
    return code, capsys.readouterr().err.splitlines()


def test_two_files_that_share_nothing_give_no_problem(capsys: pytest.CaptureFixture[str]) -> None:
    other = SECOND.replace("192.168.1.50", "192.168.1.51")
    assert said(capsys, DOOR, other) == (0, [])


def test_one_gateway_in_two_files_is_warned_of(capsys: pytest.CaptureFixture[str]) -> None:
    assert said(capsys, DOOR, SECOND) == (0, [GATEWAY])


def test_one_coil_and_one_name_in_two_files_are_errors(capsys: pytest.CaptureFixture[str]) -> None:
    assert said(capsys, DOOR, SECOND.replace("lab:", "ward:").replace("coil 4", "coil 0")) == (
        78,
        [
            GATEWAY,
            "b.yaml:7:3: the door 'ward' is used in a.yaml too, on line 7",
            "b.yaml:12:26: unit 1 coil 0 of 192.168.1.50:502 is used in a.yaml too, on line 12",
            "2 errors, 1 warning",
        ],
    )


def test_one_serial_port_in_two_files_is_one_error(capsys: pytest.CaptureFixture[str]) -> None:
    code, lines = said(capsys, DOOR.replace(TCP, SERIAL), SECOND.replace(TCP, SERIAL))
    assert (code, lines) == (
        78,
        ["b.yaml:5:3: /dev/serial/by-id/x is used in a.yaml too, on line 5", "1 error"],
    )


def test_a_shared_pin_is_found_in_any_spelling(capsys: pytest.CaptureFixture[str]) -> None:
    second = GPIO.replace("ward:", "lab:").replace("BCM18", "J8:12")
    second = second.replace("J8:29", "J8:32").replace("J8:31", "BCM13")
    assert said(capsys, GPIO, second) == (
        78,
        ["b.yaml:12:26: BCM18 of the header is used in a.yaml too, on line 12", "1 error"],
    )
    assert said(capsys, GPIO, second, "--several-machines") == (0, [])


@pytest.mark.parametrize(
    ("second", "options", "network", "refused"),
    [
        ("two/tür.yaml", ["--several-machines"], "subnet", True),
        ("two/tor.yaml", ["--several-machines"], "subnet", False),
        ("two/tör.yaml", [], "localhost", True),
        ("two/tür.yaml", ["--several-machines"], "localhost", False),
    ],
)
def test_two_files_whose_nodes_have_one_name_are_an_error_if_they_share_a_graph(
    capsys: pytest.CaptureFixture[str],
    second: str,
    options: list[str],
    network: str,
    refused: bool,
) -> None:
    for folder, text in (("one", DOOR), ("two", SECOND.replace("168.1.50", "168.1.51"))):
        Path(folder).mkdir()
        file = Path("one/tür.yaml") if folder == "one" else Path(second)
        file.write_text(text.replace("rmf: {", f"rmf: {{network: {network}, "))
    code = main(["check", "one/tür.yaml", second, *options])
    lines = [
        f"{second}:1:7: the node 'rmf_bridge_t_r' is that of one/tür.yaml too: rename one of the two"
        " files, because daemons with one node name do not hear each other's alarm",
        "1 error",
    ]
    assert (code, capsys.readouterr().err.splitlines()) == ((78, lines) if refused else (0, []))


def test_different_domains_are_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    second = SECOND.replace("192.168.1.50", "192.168.1.51")
    assert said(capsys, DOOR, second.replace("domain_id: 3", "domain_id: 4")) == (
        78,
        [
            "b.yaml:3:18: DDS domain 4, but a.yaml is in domain 3: the daemons cannot hear each other",
            "1 error",
        ],
    )
    assert said(capsys, DOOR, second.replace("{domain_id: 3}", "{}")) == (
        78,
        [
            "b.yaml:3:1: DDS domain 0, but a.yaml is in domain 3: the daemons cannot hear each other",
            "1 error",
        ],
    )


@pytest.mark.parametrize(
    ("first", "second", "warned"),
    [("dds", "zenoh", True), ("dds", "dds", False), ("dds", "auto", False)],
)
def test_two_wires_are_warned_of(
    capsys: pytest.CaptureFixture[str], first: str, second: str, warned: bool
) -> None:
    other = SECOND.replace("192.168.1.50", "192.168.1.51")
    files = [
        text.replace("domain_id: 3", f"domain_id: 3, transport: {wire}")
        for text, wire in ((DOOR, first), (other, second))
    ]
    code, told = said(capsys, *files)
    line = (
        "b.yaml:3:32: warning: transport zenoh, but a.yaml has dds: without a bridge the daemons do"
    )
    assert (code, [one.startswith(line) for one in told[:1]]) == (0, [True] if warned else []), told


def test_a_supervisor_of_a_door_without_a_file_is_an_error(
    capsys: pytest.CaptureFixture[str],
) -> None:
    supervisor = "kind: door_supervisor\nrmf: {domain_id: 3}\nsupervisor: {doors: [wart]}\n"
    assert said(capsys, DOOR, supervisor) == (
        78,
        [
            "a.yaml:7:3: warning: 'ward' is not served: b.yaml does not name it",
            "b.yaml:3:22: unknown door 'wart': did you mean 'ward'? known here: ward",
            "1 error, 1 warning",
        ],
    )


def test_a_second_supervisor_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    supervisor = "kind: door_supervisor\n"
    assert said(capsys, supervisor, supervisor) == (
        78,
        ["b.yaml:1:7: kind: door_supervisor is used in a.yaml too, on line 1", "1 error"],
    )


def test_a_station_of_the_coordinator_without_a_charger_is_an_error(
    capsys: pytest.CaptureFixture[str],
) -> None:
    coordinator = (CONFIG / "charger_coordinator.yaml").read_text()
    code, lines = said(capsys, (CONFIG / "charger_http.yaml").read_text(), coordinator, "-q")
    assert code == os.EX_CONFIG
    assert [line.partition(": ")[2] for line in lines] == [
        "unknown charger 'charger_b': did you mean 'charger_a'? known here: charger_a",
        "",
    ]


def shipped(name: str, *changes: tuple[str, str]) -> str:
    """Return the text of a file in config/ with these changes."""
    text = (CONFIG / name).read_text()
    for old, new in changes:
        text = text.replace(old, new)
    return text


def test_a_command_over_http_belongs_to_only_one_door_or_charger(
    capsys: pytest.CaptureFixture[str],
) -> None:
    other = shipped("door_http.yaml", ("side_door", "back_door"))
    code, lines = said(capsys, shipped("door_http.yaml"), other, "-q")
    hold = "GET /rpc/Switch.Set?id=0&on=true&toggle_after=10"
    release = "GET /rpc/Switch.Set?id=0&on=false"
    assert (code, [line.partition(" ")[2] for line in lines[:-1]]) == (
        78,
        [
            f"{hold} of http://192.168.1.70 is used in a.yaml too, on line 26",
            f"{release} of http://192.168.1.70 is used in a.yaml too, on line 27",
        ],
    )


def test_a_command_of_a_gateway_belongs_to_only_one_lift(
    capsys: pytest.CaptureFixture[str],
) -> None:
    other = shipped("lift_gateway.yaml", ("Lift1", "Lift2"))
    code, lines = said(capsys, shipped("lift_gateway.yaml"), other, "-q")
    assert (code, [line.partition(" ")[2] for line in lines[:-1]]) == (
        78,
        [
            "unit 1 holding register 10 of 192.168.1.60:502 is used in a.yaml too, on line 43",
            "unit 1 holding register 11 of 192.168.1.60:502 is used in a.yaml too, on line 46",
        ],
    )


def test_the_coil_for_the_pulse_of_a_module_is_claimed_too(
    capsys: pytest.CaptureFixture[str],
) -> None:
    bus = shipped("door_waveshare.yaml")
    bus = bus[bus.index("    serial:") : bus.index("doors:")]
    first = shipped("door_waveshare.yaml", (bus, "    tcp: {host: 192.168.1.50}\n\n"))
    second = first.replace("ward_door", "lab").replace('coil 0"', 'coil 1"')
    second = second.replace("input 0", "input 4").replace("input 1", "input 5")
    code, lines = said(capsys, first, second, "-q")
    assert code == os.EX_CONFIG
    assert [line.partition(": ")[2] for line in lines if "coil" in line] == [
        "unit 1 coil 512 of 192.168.1.50:502 is used in a.yaml too, on line 26"
    ]

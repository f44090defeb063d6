"""Two buses of one file, or of two files, that are the same hardware under two names."""

import os
from copy import deepcopy
from pathlib import Path

import pytest
import yaml

from bridges.cli import main
from bridges.settings.load import SettingsError, load

CONFIG = Path(__file__).parents[2] / "config"
DOORS = """\
kind: door
driver: dry_contact
buses:
  b1: {first}
  b2: {second}
doors:
  d1:
    bus: b1
    feedback: estimated
    limits: {{open_delay_s: 5}}
    inputs: {{opened: {{point: {one}}}}}
    outputs: {{hold_open: {{point: {out}, active: high}}}}
  d2:
    bus: b2
    feedback: estimated
    limits: {{open_delay_s: 5}}
    inputs: {{opened: {{point: {two}}}}}
    outputs: {{hold_open: {{point: {out}, active: high}}}}
"""
SERIAL = "serial: {port: /dev/serial/by-id/x, baudrate: 9600, parity: none, stopbits: 1}"


def problems(text: str) -> list[str]:
    Path("two.yaml").write_text(text)
    with pytest.raises(SettingsError) as caught:
        load("two.yaml")
    return [str(one).removeprefix("two.yaml:") for one in caught.value.problems]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def doors(first: str, second: str, *, gpio: bool = False) -> str:
    """Return the YAML of two doors on two buses. Both doors use the same relay."""
    one, two, out = (
        ("BCM5, active: high, pull: down", "BCM6, active: high, pull: down", "BCM18")
        if gpio
        else ("unit 1 discrete input 0, active: high",) * 2 + ("unit 1 coil 0",)
    )
    return DOORS.format(first=first, second=second, one=one, two=two, out=out)


@pytest.mark.parametrize(
    "chips", [("", ""), ("", ", chip: 0"), (", chip: 4", ""), (", chip: 7",) * 2]
)
def test_two_buses_on_the_same_pins_are_refused(chips: tuple[str, str]) -> None:
    place = "gpiochip7" if "7" in chips[0] else "the header"
    assert problems(doors(*(f"{{type: gpio{chip}}}" for chip in chips), gpio=True)) == [
        f"5:3: 'b2' is {place}, as 'b1' on line 4: use one bus for all devices there",
        "18:34: BCM18 is used by d1 outputs.hold_open on line 12: d2 outputs.hold_open needs a point"
        " of its own",
    ]


def test_two_chips_are_two_places() -> None:
    Path("two.yaml").write_text(doors("{type: gpio, chip: 7}", "{type: gpio, chip: 8}", gpio=True))
    assert list(load("two.yaml").buses) == ["b1", "b2"]


@pytest.mark.parametrize(
    ("first", "second", "place"),
    [
        ("tcp: {host: 10.0.0.5}", "tcp: {host: 10.0.0.5, port: 502}", "10.0.0.5:502"),
        (SERIAL, SERIAL, "/dev/serial/by-id/x"),
        ("tcp: {host: plc1}", "tcp: {host: PLC1.}", "plc1:502"),
        ("tcp: {host: localhost}", "tcp: {host: 127.0.0.1}", "127.0.0.1:502"),
        (SERIAL, SERIAL.replace("/by-id/", "//by-id/./"), "/dev/serial/by-id/x"),
    ],
)
def test_two_buses_on_one_line_or_gateway_are_refused(first: str, second: str, place: str) -> None:
    assert problems(doors(*(f"{{type: modbus, {bus}}}" for bus in (first, second)))) == [
        f"5:3: 'b2' is {place}, as 'b1' on line 4: use one bus for all devices there",
        "17:30: unit 1 discrete input 0 is used by d1 inputs.opened on line 11: d2 inputs.opened"
        " needs a point of its own",
        "18:34: unit 1 coil 0 is used by d1 outputs.hold_open on line 12: d2 outputs.hold_open needs"
        " a point of its own",
    ]


def second_bus(example: str, key: str) -> str:
    """Return an example to which a second bus at the same place was added, with a copy of the example's
    device."""
    content = yaml.safe_load((CONFIG / example).read_text())
    ((name, bus),) = content["buses"].items()
    device, settings = next(iter(content[key].items()))
    content["buses"]["again"] = deepcopy(bus)  # the same object would become an alias
    content[key] = {
        device: {**settings, "bus": name},
        "second": {**deepcopy(settings), "bus": "again"},
    }
    return yaml.safe_dump(content, sort_keys=False)


@pytest.mark.parametrize(
    ("example", "key", "says"),
    [
        (
            "door_http.yaml",
            "doors",
            ["GET /rpc/Switch.Set?id=0&on=true&toggle_after=10 is used by"],
        ),
        ("door_mqtt.yaml", "doors", ["relay is used by pharmacy_door outputs.hold_open"]),
        ("charger_canopen.yaml", "chargers", ["'again' is can0, as 'can'", "is used by"]),
        ("charger_wiferion.yaml", "chargers", ["canable.io-if00, as 'can' on line"]),
        ("door_register.yaml", "doors", ["as 'line' on line", "is used by ward_door"]),
    ],
)
def test_one_device_by_two_buses_is_refused(example: str, key: str, says: list[str]) -> None:
    found = "\n".join(problems(second_bus(example, key)))
    assert [text for text in says if text not in found] == []


def test_two_users_of_one_broker_may_switch_different_relays() -> None:
    text = second_bus("door_mqtt.yaml", "doors")
    at = text.index("again:")
    Path("two.yaml").write_text(text[:at] + text[at:].replace("a0b1c2d3e4f5", "001122334455"))
    assert list(load("two.yaml").buses) == ["building", "again"]


def test_one_relay_with_two_timers_is_one_relay() -> None:
    text = second_bus("door_mqtt.yaml", "doors")
    at = text.index("again:")
    assert "switches_off_after_s: 10" in text[at:]
    Path("two.yaml").write_text(text[:at] + text[at:].replace("after_s: 10", "after_s: 12"))
    with pytest.raises(SettingsError, match="relay is used by pharmacy_door"):
        load("two.yaml")


def test_one_client_id_at_one_broker_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """A broker ends the connection of the client that had the id before, so both would be deaf."""
    text = second_bus("door_mqtt.yaml", "doors").replace("a0b1c2d3e4f5", "001122334455", 1)
    client = "client_id: ward"
    both = text.replace("type: mqtt", f"type: mqtt\n    {client}")
    assert any("client id ward is used by" in one for one in problems(both))
    for name, door in (("a.yaml", "A"), ("b.yaml", "B")):
        one = (CONFIG / "door_mqtt.yaml").read_text().replace("pharmacy_door", door)
        one = one.replace("a0b1c2d3e4f5", f"00112233445{name[0]}")
        Path(name).write_text(one.replace("type: mqtt", f"type: mqtt\n    {client}"))
    assert main(["check", "-q", "a.yaml", "b.yaml"]) == os.EX_CONFIG
    assert "client id ward of" in capsys.readouterr().err


def test_the_header_by_its_number_in_a_second_file_is_the_same_header(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = (CONFIG / "lift_dry_contact.yaml").read_text()
    Path("a.yaml").write_text(text)
    Path("b.yaml").write_text(
        text.replace("Lift1:", "Lift2:").replace("type: gpio", "type: gpio, chip: 0")
    )
    assert main(["check", "-q", "a.yaml", "b.yaml"]) == os.EX_CONFIG
    assert "BCM16 of the header is used in a.yaml too" in capsys.readouterr().err

"""The key `bus:` of an input: accepted values, refused values with their place, and the text of
`check`."""

from pathlib import Path

import pytest

from bridges.settings.cross_file_checks import across
from bridges.settings.load import SettingsError, load
from bridges.settings.sheets.findings import WIRES, findings

CONFIG = Path(__file__).parents[2] / "config"
TWO = (CONFIG / "lift_two_buses.yaml").read_text()
MAPPED = (CONFIG / "lift_gateway_contacts.yaml").read_text()
ON_OWN_BUS = "an output is always on the device's own bus: wire the relay there, and delete 'bus'"
FIRE = "fire_alarm: {bus: header, point: BCM4, active: low, pull: down}"
FLOOR = "L1: {bus: header, point: BCM17, active: high, pull: down}"


def problems(path: Path, old: str, new: str, text: str = TWO) -> list[str]:
    """Return the problems of a file with this change, as `line:column: text`."""
    assert old in text
    path.write_text(text.replace(old, new, 1))
    try:
        load(path)
    except SettingsError as error:
        return [f"{p.line}:{p.column}: {p.text}" for p in error.problems]
    return []


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            'door_open: {point: "unit 1 coil 1"',
            "door_open: {bus: header, point: BCM5",
            f"40:19: {ON_OWN_BUS}",
        ),
        (
            'L2: {point: "unit 1 coil 3"',
            "L2: {bus: header, point: BCM5",
            f"43:12: {ON_OWN_BUS}",
        ),
        (
            FIRE,
            FIRE.replace("header", "headr"),
            "26:25: unknown bus 'headr': did you mean 'header'? known here: gateway, header",
        ),
        (
            "agv_mode: {point",
            "agv_mode: {bus: gateway, point",
            "27:23: 'gateway' is the own bus of 'Lift1': leave 'bus' out here",
        ),
        (
            FIRE,
            FIRE.replace("BCM4", '"unit 1 discrete input 9"'),
            "26:40: 'unit 1 discrete input 9' is not a pin: write BCM17, or J8:11 for a position on the"
            " header",
        ),
        (
            FIRE,
            FIRE.replace(", pull: down", ""),
            "26:7: 'fire_alarm': pull is missing: write up, down, or none where an external resistor is"
            " fitted",
        ),
        (
            FIRE,
            FIRE.replace("low", "high"),
            "26:7: unsafe: with its wire cut, a fire alarm reads clear; or accept_unsafe: {fire_alarm:"
            " <why it is safe here>}",
        ),
        (
            FLOOR,
            FLOOR.replace("BCM17", "BCM4"),
            "34:34: BCM4 is used by Lift1 inputs.fire_alarm on line 26: Lift1 floor_code.lines.L1 needs"
            " a point of its own",
        ),
        (
            "header: {type: gpio}",
            "header: {type: gpio, scan_s: 2}",
            "22:3: stale_after_s is 1, but its bus is read every 2 s (scan_s): readings would always be"
            " stale; raise stale_after_s above 2, or lower scan_s",
        ),
        (
            FIRE,
            FIRE.replace("bus: header, ", ""),
            "26:27: 'BCM4' is not a Modbus point: write 'unit 1 coil 0', 'unit 1 discrete input 0' or"
            " 'unit 1 holding register 0 bit 0'; addresses begin at 0; or, for an input on the bus"
            " 'header': bus: header",
        ),
        (FIRE, FIRE.replace("header", '""'), "26:25: unknown bus '': known here: gateway, header"),
        (FIRE, FIRE.replace("header", "[header]"), "26:20: 'bus' is a list: write text"),
    ],
)
def test_a_mistake_about_the_other_bus_is_one_problem_at_its_place(
    file: Path, old: str, new: str, problem: str
) -> None:
    assert problems(file, old, new) == [problem]


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("fire_alarm: {at:", "fire_alarm: {bus: line, at:", "32:20"),
        ("at: input register 0\n", "at: input register 0\n        bus: line\n", "29:9"),
    ],
)
def test_the_text_for_a_map_tells_that_the_map_uses_one_bus(
    file: Path, old: str, new: str, place: str
) -> None:
    assert problems(file, old, new, MAPPED) == [
        f"{place}: all places of a map are on the device's own bus: only contacts (driver: dry_contact)"
        " can be on another bus"
    ]


def test_every_input_may_be_on_the_other_bus(file: Path) -> None:
    text = TWO
    for i in range(4):
        text = text.replace(f'{{point: "unit 1 discrete input {i}"', f"{{bus: far, point: {i}")
    places = {i: f'{{bus: panel, point: "unit 9 discrete input {i}"' for i in range(4)}
    for i, place in places.items():
        text = text.replace(f"{{bus: far, point: {i}", place)
    panel = "  panel: {type: modbus, tcp: {host: 192.168.1.60}}"
    file.write_text(text.replace("  header: {type: gpio}", f"  header: {{type: gpio}}\n{panel}"))
    config = load(file)
    assert config.other_buses("Lift1") == ["header", "panel"]
    assert {w.direction for w in config.wires_on("gateway", "Lift1")} == {"out"}
    assert not config.warnings


def test_a_bus_that_no_device_names_is_still_refused(file: Path) -> None:
    unused = "header: {type: gpio}\n  spare: {type: gpio, chip: 1}"
    assert problems(file, "header: {type: gpio}", unused) == [
        "20:3: no device uses the bus 'spare': delete it, or name it in a device's 'bus:'"
    ]


def test_a_mistyped_point_does_not_make_its_bus_unused(file: Path) -> None:
    """The mistyped contact is the only contact on the bus `header`. Still `check` must not report this
    bus as unused."""
    text = TWO
    for i in range(1, 5):
        start = text.index(f"        L{i}: {{bus: header")
        line = text[start : text.index("\n", start)]
        new = f'        L{i}: {{point: "unit 1 discrete input {i + 9}", active: high}}'
        text = text.replace(line, new)
    assert problems(file, "BCM4", "BCM99", text) == [
        "26:40: BCM99 is not on the 40-pin header, which has BCM0 to BCM27"
    ]


def test_check_shows_the_bus_of_each_such_wire_and_the_longer_debounce(file: Path) -> None:
    file.write_text(TWO)
    shown = findings(load(file)).parts[0].tables[0]
    assert shown.title == WIRES
    rows = {row[0]: (row[1], row[5]) for row in shown.rows}
    assert rows["fire_alarm"] == ("BCM4 = J8:7 on bus header", "0.2 s")
    assert rows["agv_mode"] == ("unit 1 discrete input 0 (10001)", "0.2 s")
    assert rows["door_open"] == ("unit 1 coil 1 (00002)", "-")


def test_a_pin_that_another_file_uses_is_found_on_the_other_bus_too(
    file: Path, tmp_path: Path
) -> None:
    file.write_text(TWO)
    second = tmp_path / "second.yaml"
    text = TWO.replace("Lift1", "Lift2").replace("192.168.1.50", "192.168.1.51")
    second.write_text(text)
    found = across([load(file), load(second)]).errors
    pins = [problem.text.split(" is used in")[0] for problem in found]
    assert pins == [f"BCM{n} of the header" for n in (4, 17, 27, 22, 23)]


def test_a_warning_tells_that_a_charge_goes_on_without_the_other_bus(
    file: Path,
) -> None:
    text = (CONFIG / "charger_contacts.yaml").read_text()
    text = text.replace("\nchargers:", "  header: {type: gpio}\nchargers:")
    text = text.replace("charger_e:", "charger_e:\n    bus: module")
    old = 'fault: {point: "unit 1 discrete input 2", active: low}'
    file.write_text(text.replace(old, "fault: {bus: header, point: BCM4, active: low, pull: down}"))
    assert "a charge continues even if the contact 'fault' changes" in " ".join(
        map(str, load(file).warnings)
    )

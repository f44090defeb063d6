"""Problems between the sections of a file: kinds, drivers, buses, devices and their wires."""

from pathlib import Path

import pytest

from tests.settings.reading import RIGHT, changed, config_of, problems_of

WEB = """\
kind: gate
driver: web
buses: {server: {type: web, host: 192.168.1.7}}
gates: {north: {page: side}, south: {}}
"""
TWO_BUSES = changed(
    "  header: {type: pins}", "  header: {type: pins}\n  box: {type: module, host: h}"
)


def test_an_unknown_kind_is_reported_with_the_known_kinds(file: Path) -> None:
    (problem,) = problems_of(file, changed("kind: gate", "kind: gait"))
    assert problem.startswith("1:7: 'kind' is 'gait': ")
    assert problem.endswith(" (did you mean 'gate'?)")
    assert "lift" in problem


@pytest.mark.parametrize("name", ["rmf", "commands", "settings", "../gate", "gate.settings", "os"])
def test_a_kind_is_the_name_of_a_folder_and_nothing_else_is_imported(file: Path, name: str) -> None:
    (problem,) = problems_of(file, changed("kind: gate", f"kind: {name}"))
    assert problem.startswith(f"1:7: 'kind' is '{name}': ")


def test_while_the_kind_is_unknown_other_sections_are_still_read(file: Path) -> None:
    text = changed("kind: gate", "kinds: gate")
    text = changed("transport: dds", "transport: ddss", text)
    text = changed("type: pins", "type: pin", text)
    text = changed("gates:", "gate:", text)
    found = problems_of(file, text)
    assert [p.partition(": ")[0] for p in found] == ["1:1", "3:18", "5:18", "6:1"]
    assert found[0].startswith("1:1: unknown key 'kinds': did you mean 'kind'? known here: ")


def test_an_unknown_driver_is_reported_with_the_drivers_of_the_kind(file: Path) -> None:
    assert problems_of(file, changed("driver: contact", "driver: contakt")) == [
        "2:9: 'driver' is 'contakt': write contact or web (did you mean 'contact'?)"
    ]


def test_a_file_needs_all_its_sections(file: Path) -> None:
    assert problems_of(file, "kind: gate\n") == [
        "1:1: the file needs 'buses': a mapping (key: value)",
        "1:1: the file needs 'driver': contact or web",
        "1:1: the file needs 'gates': a mapping (key: value)",
    ]


def test_a_section_of_another_kind_is_unknown(file: Path) -> None:
    assert problems_of(file, changed("gates:", "doors:")) == [
        "1:1: the file needs 'gates': a mapping (key: value)",
        "6:1: unknown key 'doors': known here: kind, driver, rmf, recording, buses, gates",
    ]


def test_a_doubled_section_is_named(file: Path) -> None:
    assert problems_of(file, RIGHT + "buses: {}\n") == [
        "16:1: the key 'buses' is already on line 4: delete one of the two"
    ]


def test_rmf_may_be_left_out_but_not_left_empty(file: Path) -> None:
    line = "rmf: {transport: dds, domain_id: 7}\n"
    assert problems_of(file, changed(line, "")) == []
    assert problems_of(file, changed(line, "rmf:\n")) == [
        "3:1: 'rmf' has no value: write a mapping (key: value)"
    ]


BUSES = {
    "header: {type: pns}": "5:18: 'type' is 'pns': write module or pins (did you mean 'pins'?)",
    "header: {type: lines}": "5:18: 'type' is 'lines': write module or pins (did you mean 'pins'?)",
    "header: {type: web, host: h}": (
        "5:18: 'type' is 'web', but the driver 'contact' needs a bus of type module or pins"
    ),
    "header: {type: [pins]}": "5:12: 'type' is a list: write module or pins",
    "header: {}": "5:3: 'header' needs 'type': module or pins",
    "header: pins": "5:11: 'header' is the text 'pins': write a mapping (key: value)",
    "header:": "5:3: 'header' has no value: write a mapping (key: value)",
    "header: {type: pins, chp: 1}": (
        "5:24: unknown key 'chp': did you mean 'chip'? known here: type, chip"
    ),
    "no: {type: pins}": "5:3: this name is written no, which YAML may read as false: "
    'if the text is meant, write "no" in quotes',
    "{}": "4:1: 'buses' is empty: it needs at least one bus",
    "[]": "4:1: 'buses' is a list: write a mapping (key: value)",
}


@pytest.mark.parametrize("bus", BUSES)
def test_a_driver_accepts_only_its_types_of_bus(file: Path, bus: str) -> None:
    assert problems_of(file, changed("header: {type: pins}", bus)) == [BUSES[bus]]


def test_every_problem_of_every_bus_is_named(file: Path) -> None:
    text = changed("type: pins", "type: module, port: 0")
    text = changed("gates:", "  other: {type: pins, chip: one}\ngates:", text)
    assert problems_of(file, text) == [
        "5:3: 'header' needs 'host': text",
        "5:32: 'port' is 0: write a whole number from 1 to 65535",
        "6:29: 'chip' is the text 'one': write a whole number",
        "8:3: 'north' needs 'bus': header or other",
    ]


def test_a_device_names_its_bus_if_there_are_several(file: Path) -> None:
    assert problems_of(file, TWO_BUSES) == ["8:3: 'north' needs 'bus': header or box"]


def test_an_unused_bus_is_named(file: Path) -> None:
    text = changed("    lanes:", "    bus: header\n    lanes:", TWO_BUSES)
    assert problems_of(file, text) == [
        "6:3: no device uses the bus 'box': delete it, or name it in a device's 'bus:'"
    ]


def test_a_device_cannot_name_a_missing_bus(file: Path) -> None:
    text = changed("    lanes:", "    bus: hedder\n    lanes:", TWO_BUSES)
    assert problems_of(file, text) == [
        "9:10: unknown bus 'hedder': did you mean 'header'? known here: header, box"
    ]


@pytest.mark.parametrize(("bus", "problems"), [("[]", "text"), ("{}", "text"), ("", "text")])
def test_a_bus_is_named_by_a_text(file: Path, bus: str, problems: str) -> None:
    (problem,) = problems_of(file, changed("    lanes:", f"    bus: {bus}\n    lanes:"))
    assert problem.endswith(f"write {problems}")


def test_an_empty_bus_key_equals_a_missing_bus_key(file: Path) -> None:
    assert (
        config_of(file, changed("    lanes:", "    bus: ~\n    lanes:")).bus_of("north") == "header"
    )


def test_there_is_at_least_one_device(file: Path) -> None:
    text = RIGHT[: RIGHT.index("gates:")]
    assert problems_of(file, text + "gates: {}\n") == [
        "6:1: 'gates' is empty: it needs at least one gate"
    ]
    assert problems_of(file, text + "gates:\n") == [
        "6:1: 'gates' has no value: write a mapping (key: value)"
    ]


def test_a_device_is_a_mapping_with_a_name(file: Path) -> None:
    text = RIGHT[: RIGHT.index("gates:")]
    assert problems_of(file, text + 'gates: {1: {}, " a": [], b: x}\n') == [
        "6:9: '1' needs 'inputs': a mapping (key: value)",
        "6:9: '1' needs 'lanes': a list ([...]) or a mapping (key: value)",
        '6:9: this name is the number 1: if the text is meant, write "1" in quotes',
        "6:16: ' a' is a list: write a mapping (key: value)",
        "6:16: this name is ' a': write text without control characters, and without spaces at its"
        " ends",
        "6:29: 'b' is the text 'x': write a mapping (key: value)",
    ]


def test_a_point_that_does_not_exist_is_reported_by_the_bus(file: Path) -> None:
    text = changed("{point: A0,", "{point: 17,")
    text = changed("{point: 1A,", "{point: no,", text)
    assert problems_of(file, text) == [
        "10:23: '17' is not a pin: write A1",
        "11:23: 'no' is not a pin: write An",
    ]


def test_points_are_judged_by_the_bus_of_the_device(file: Path) -> None:
    text = changed("type: pins", "type: module, host: h")
    assert problems_of(file, text) == [
        "10:23: 'A0': write coil and its number",
        "11:23: '1A': write coil and its number",
        "13:21: 'A2': write coil and its number",
    ]


def test_points_are_judged_even_in_a_wrong_device(file: Path) -> None:
    text = changed("{point: A0, active: high, pull: up}", "{point: 17, actve: high}")
    text = changed("pull: down", "pull: none", text)
    text = changed("{point: A2,", "{point: A1,", text)
    assert problems_of(file, text) == [
        "10:23: '17' is not a pin: write A1",
        "10:27: unknown key 'actve': did you mean 'active'? known here: "
        "point, active, pull, debounce_s, bus",
        "13:21: A1 is used by north inputs.closed on line 11: "
        "north outputs.hold needs a point of its own",
    ]


def test_without_a_bus_everything_except_points_is_judged(file: Path) -> None:
    text = changed("type: pins", "type: pns")
    text = changed("{point: A0, active: high", "{point: 17, active: hgh", text)
    assert problems_of(file, text) == [
        "5:18: 'type' is 'pns': write module or pins (did you mean 'pins'?)",
        "10:35: 'active' is 'hgh': write high or low (did you mean 'high'?)",
    ]


def test_a_point_serves_one_signal_of_one_device(file: Path) -> None:
    text = changed("{point: A2,", "{point: 1A,") + (
        "  south:\n    lanes: [in]\n    inputs: {opened: {point: 0A, active: low, pull: up}}\n"
        "    bits: [{point: A5, active: low, pull: up}, {point: A5, active: low, pull: up}]\n"
    )
    assert problems_of(file, text) == [
        "13:21: 1A (A1) is used by north inputs.closed on line 11: "
        "north outputs.hold needs a point of its own",
        "18:30: 0A (A0) is used by north inputs.opened on line 10: "
        "south inputs.opened needs a point of its own",
        "19:56: A5 is used by south bits.0 on line 19: south bits.1 needs a point of its own",
    ]


def test_a_point_repeated_by_an_alias_is_refused(file: Path) -> None:
    text = changed("inputs:", "inputs: &i") + "  south: {lanes: [in], inputs: *i}\n"
    assert problems_of(file, text) == [
        "10:23: A0 is used by north inputs.opened on line 10: "
        "south inputs.opened needs a point of its own",
        "11:23: 1A (A1) is used by north inputs.closed on line 11: "
        "south inputs.closed needs a point of its own",
    ]


def test_the_same_point_of_two_buses_is_two_points(file: Path) -> None:
    text = changed("  header: {type: pins}", "  header: {type: pins}\n  other: {type: pins}")
    text = changed("    lanes:", "    bus: header\n    lanes:", text) + (
        "  south:\n    bus: other\n    lanes: [in]\n"
        "    inputs: {opened: {point: A0, active: low, pull: up}}\n"
    )
    config = config_of(file, text)
    assert [config.bus_of(name) for name in config.devices] == ["header", "other"]


@pytest.mark.parametrize("other", ["", "    limits: {tires: 1}\n"])
def test_the_bus_reports_an_impossible_wire(file: Path, other: str) -> None:
    text = changed("    limits: {open_s: 3, tries: 2}\n", other)
    text = changed(
        "{point: A0, active: high, pull: up}", "{point: A9, active: high, pull: up}", text
    )
    text = changed("pull: down, ", "", changed("{point: A2,", "{point: 8A,", text))
    assert problems_of(file, text)[:3] == [
        "10:7: 'opened': A9 has no pull",
        "11:7: 'closed': pull is missing",
        "13:7: 'hold': A8 cannot drive",
    ]
    assert len(problems_of(file, text)) == (4 if other else 3)


def test_unsafe_wiring_is_accepted_only_for_signals_that_exist(file: Path) -> None:
    text = changed(
        "    limits:", "    accept_unsafe: {open: rusty, hold: by contract}\n    limits:"
    )
    assert problems_of(file, text) == [
        "15:21: unknown signal 'open': did you mean 'opened'? known here: opened, closed, hold"
    ]


def test_a_misspelt_acceptance_is_reported_with_the_problem_of_the_driver(file: Path) -> None:
    text = changed("    limits:", "    accept_unsafe: {hald: by contract}\n    limits:")
    text = changed("tries: 2", "close_s: 9", changed("{1: in, 2: out}", "{1: yard}", text))
    assert problems_of(file, text) == [
        "14:16: 'codes': code 1 is no lane: 'yard'",
        "15:21: unknown signal 'hald': did you mean 'hold'? known here: opened, closed, hold",
        "16:34: 'close_s' may not be longer than 'open_s'",
    ]


def test_a_driver_without_wires_has_no_signals_to_accept(file: Path) -> None:
    text = changed("{page: side}", "{accept_unsafe: {page: old}}", WEB)
    assert problems_of(file, text) == ["4:33: unknown signal 'page': there is none"]


def test_unsafe_wiring_needs_a_reason(file: Path) -> None:
    text = changed("    limits:", '    accept_unsafe: {hold: ""}\n    limits:')
    assert problems_of(file, text) == ["15:27: 'hold' has 0 characters: 1 to 128 are allowed"]


OWN = TWO_BUSES.replace("type: module, host: h", "type: web, host: h").replace(
    "  north:\n", "  south: {driver: web, bus: box, page: side}\n  north:\n    bus: header\n"
)


def test_a_device_may_have_its_own_driver(file: Path) -> None:
    config = config_of(file, OWN)
    drivers = {name: config.driver_type(name).settings.__module__ for name in config.devices}
    assert drivers == {"south": "drivers.gate.web", "north": "drivers.gate.contact"}
    assert [bool(config.wires(name)) for name in ("south", "north")] == [False, True]


def test_the_own_driver_of_a_device_must_be_of_its_kind(file: Path) -> None:
    (problem,) = problems_of(file, OWN.replace("driver: web", "driver: wep"))
    assert problem == "8:19: 'driver' is 'wep': write contact or web (did you mean 'web'?)"


def test_the_own_driver_of_a_device_uses_its_bus(file: Path) -> None:
    (problem,) = problems_of(file, OWN.replace("bus: box", "bus: header"))[1:]
    assert problem.endswith("the bus 'header' is 'pins', but the driver of 'south' needs web")

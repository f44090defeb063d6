"""A lift behind a gateway with registers.

The tests cover the meaning of each register's number, register maps that the driver refuses, and the
values that each command writes.
"""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Motion, Side
from bridges.settings.load import load
from drivers.lift.register import RegisterLiftSettings, decode, describe, encode, tables, warnings
from tests.settings.reading import problems_of

CONFIG = Path(__file__).parents[3] / "config" / "lift_gateway.yaml"


def shipped() -> RegisterLiftSettings:
    settings = load(CONFIG).devices["Lift1"]
    assert isinstance(settings, RegisterLiftSettings)
    return settings


def sample(**words: int) -> LiftSample:
    """Return the sample of the example lift at L1 in AGV mode. `words` replaces words that the
    registers hold."""
    plain = {"floor": 1, "motion": 1, "door": 0, "service": 1, "overload": 0}
    return decode(shipped().map, plain | words)


AT_L1 = LiftSample("L1", DoorReading.CLOSED, motion=Motion.STOPPED, agv=True)


def test_a_car_at_a_landing_is_read_from_its_registers() -> None:
    assert sample() == AT_L1


@pytest.mark.parametrize(
    ("words", "changes"),
    [
        ({"floor": 0}, {"level": None}),
        ({"floor": 9}, {"level": None, "code_fault": "code 9 is no floor's code"}),
        ({"floor": 0xFF03}, {"level": "L3"}),
        ({"motion": 0x0100}, {"motion": Motion.UP}),
        ({"motion": 0x0300}, {"motion": Motion.CONTRADICTORY}),
        ({"door": 2}, {"door": DoorReading.OPEN}),
        ({"door": 3}, {"door": DoorReading.BETWEEN}),
        ({"door": 9}, {"door": DoorReading.UNKNOWN}),
        ({"overload": 1}, {"hazards": frozenset({Hazard.OVERLOAD})}),
        ({"overload": 0xFFFE}, {}),
    ],
)
def test_each_number_means_what_the_map_says_and_others_are_faults(
    words: dict[str, int], changes: dict[str, Any]
) -> None:
    assert sample(**words) == msgspec.structs.replace(AT_L1, **changes)


@pytest.mark.parametrize(
    ("service", "hazards"),
    [(0, set()), (2, {Hazard.FIRE}), (3, {Hazard.EMERGENCY}), (99, {Hazard.OUT_OF_SERVICE})],
)
def test_outside_agv_mode_the_floor_means_nothing(service: int, hazards: set[Hazard]) -> None:
    assert sample(service=service) == LiftSample(
        None,
        DoorReading.CLOSED,
        motion=Motion.STOPPED,
        agv=False,
        hazards=frozenset(hazards),
        floor_valid=False,
    )


def test_commands_that_share_a_register_are_joined_in_it() -> None:
    commands, calls = "holding register 10", "holding register 11"
    written = [
        encode(shipped().map, outputs)
        for outputs in (
            LiftOutputs(),
            LiftOutputs(agv_request=True, call="L3"),
            LiftOutputs(agv_request=True, hold_door=Side.FRONT),
        )
    ]
    assert written == [
        {commands: 0, calls: 0},
        {commands: 1, calls: 3},
        {commands: 3, calls: 0},
    ]


MODEL = "looks like a manual's number, and these begin at 1"


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("4: L4}\n        between", "4: L1}\n        between", "28:9: 'codes': no code for L4"),
        (
            "between_floors: [0]",
            "between_floors: [1]",
            "28:20: 'codes': 1 means between floors as well",
        ),
        (
            "at: input register 1\n",
            "at: input register 30002\n",
            f"36:13: 30002 {MODEL}: write input register 1. Write 0x7532 if 30002 really is the address"
            " on the wire",
        ),
        (
            "input register 0\n        bits: [8",
            "coil 0\n        bits: [8",
            "32:13: 'coil 0': write 'holding register 0' or 'input register 0'; addresses begin at 0",
        ),
        ("bits: [8, 9]", "bits: [8, 8]", "33:9: 'bits': a bit is listed twice"),
        ("2: down}", "4: down}", "34:39: 'codes': 4 does not fit on 2 bits"),
        (
            "0: closed, 1: moving, 2: open",
            "0: moving, 1: moving, 2: open",
            "37:9: 'codes' needs a code for open and one for closed",
        ),
        (
            "bit: 0, active",
            "active",
            "41:7: 'overload': a flag is one bit of a register: give the bit",
        ),
        (
            "ask: 2, release: 0",
            "ask: 3, release: 0",
            "44:51: 'ask': door_open shares bits of holding register 10 with agv_mode_request: give"
            " each command bits of its own",
        ),
        ("none: 0", "none: 4", "47:43: 'codes': 4 means no call already (none)"),
        (
            "4: L4}\n          none",
            "4: L4, 5: L4}\n          none",
            "47:50: 'codes': L4 is called by 4 already: give each landing one number",
        ),
        (", 4: L4}\n          none", "}\n          none", "47:11: 'codes': no code for L4"),
        (
            "    floors:",
            "    agv_mode: by_call\n    floors:",
            "44:9: 'agv_mode_request': with agv_mode: by_call a call already requests AGV mode:"
            " delete this or by_call",
        ),
    ],
)
def test_a_map_that_cannot_be_right_is_refused_where_it_stands(
    tmp_path: Path, old: str, new: str, problem: str
) -> None:
    text = CONFIG.read_text()
    assert old in text
    assert problems_of(tmp_path / "lift.yaml", text.replace(old, new, 1)) == [problem]


def test_commands_that_cannot_be_read_back_are_warned_of() -> None:
    plain = msgspec.to_builtins(shipped(), str_keys=True)
    plain["map"]["commands"]["read_back"] = False
    settings = msgspec.convert(plain, RegisterLiftSettings, strict=False)
    assert list(warnings(shipped())) == []
    assert list(warnings(settings)) == [
        (
            ("map", "commands", "read_back"),
            "commands cannot be read back: switching off is not verified",
        )
    ]


def told(title: str) -> list[tuple[str, ...]]:
    """Return the rows of the table with this title that `check` prints for the example lift."""
    return next(list(table.rows) for table in tables(shipped()) if table.title == title)


def test_each_number_is_a_row_with_what_its_register_then_reads() -> None:
    others = ", other bits 0"
    assert told("floor numbers") == [
        ("between floors", "0", f"0x0000{others}"),
        ("L1", "1", f"0x0001{others}"),
        ("L2", "2", f"0x0002{others}"),
        ("L3", "3", f"0x0003{others}"),
        ("L4", "4", f"0x0004{others}"),
        ("a fault", "any other", "-"),
    ]
    assert told("motion numbers") == [
        ("stopped", "0", f"0x0000{others}"),
        ("up", "1", f"0x0100{others}"),
        ("down", "2", f"0x0200{others}"),
        ("a car that moves", "any other", "-"),
    ]
    assert told("door numbers")[-1] == ("neither open nor closed", "any other", "-")
    assert told("service numbers")[-1] == ("out_of_service", "any other", "-")


def test_each_command_is_a_row_with_what_is_written() -> None:
    called = "on until the car is there"
    held = "on while a robot holds the lift, and 3 s longer"
    assert told("outputs") == [
        ("agv_mode_request", "holding register 10: 1", "0", held),
        ("door_open", "holding register 10: 2", "0", "on while the car waits for a robot"),
        ("call L1", "holding register 11: 1", "0", called),
        ("call L2", "holding register 11: 2", "0", called),
        ("call L3", "holding register 11: 3", "0", called),
        ("call L4", "holding register 11: 4", "0", called),
    ]


def test_the_table_shows_floors_that_are_the_wrong_way_round() -> None:
    settings = shipped()
    turned = msgspec.structs.replace(settings, floors=list(settings.floors)[::-1])
    first = next(iter(tables(turned)))
    assert [row[:2] for row in first.rows] == [
        ("lowest", "L4"),
        ("2", "L3"),
        ("3", "L2"),
        ("highest", "L1"),
    ]


CONTACTS = CONFIG.with_name("lift_gateway_contacts.yaml")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("      door_closed: {at: discrete input 2, unit: 2, active: high}\n", "",
         "33:7: 'door_opened' needs both door_opened and door_closed"),
        ("      stopped: {", "      up: {", "35:7: up and down belong together: write both"),
        ("      stopped: {at", "      moving: {at: coil 9, active: high}\n      stopped: {at",
         "36:7: moving and stopped give the motion in several ways: keep one"),
        ("      stopped: {at", "      door: {at: input register 5, codes: {0: open, 1: closed}}"
         "\n      stopped: {at",
         "33:7: 'door_opened': door and its contacts both give the door: delete one of the two"),
        ("at: discrete input 2, unit: 2", "at: discrete input 2, unit: 256",
         "34:49: 'unit' is 256: write a whole number from 0 to 255"),
        ("at: coil 1, unit: 2}", "at: coil 0, unit: 2}",
         "38:9: door_open shares bits of unit 2 coil 0 with agv_mode_request: give each"
         " command bits of its own"),
    ],
)  # fmt: skip
def test_contacts_beside_a_gateway_are_checked_where_they_stand(
    old: str, new: str, problem: str, tmp_path: Path
) -> None:
    text = CONTACTS.read_text()
    assert text.count(old) == 1
    assert problem in problems_of(tmp_path / "lift.yaml", text.replace(old, new))


def test_commands_of_one_register_are_read_back_together_or_not_at_all(tmp_path: Path) -> None:
    text = CONFIG.read_text().replace(
        "ask: 1, release: 0}", "ask: 1, release: 0, read_back: false}"
    )
    found = problems_of(tmp_path / "lift.yaml", text)
    assert "can only read the whole place back" in str(found)


def test_a_cut_wire_of_an_alarm_at_a_module_is_warned_of(tmp_path: Path) -> None:
    (tmp_path / "lift.yaml").write_text(
        CONTACTS.read_text().replace("unit: 2, active: low}", "unit: 2, active: high}")
    )
    told = [warning.text for warning in load(tmp_path / "lift.yaml").warnings]
    assert any("a cut wire reads as no fire_alarm" in text for text in told)


def test_the_units_of_a_map_are_its_own_or_the_lifts() -> None:
    settings = load(CONTACTS).devices["Lift1"]
    rows = dict(describe(settings, None))
    assert rows["floor"] == "unit 1 input register 0"
    assert rows["door_closed"] == "unit 2 discrete input 2: asserted at 1"
    assert rows["door_open"] == "unit 2 coil 1 is written"
    assert rows["unit 1 holding register 11"] == "written in every scan, and never read back"

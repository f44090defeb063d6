"""The spelling of Modbus points, impossible wirings, and points that share one request."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.hal.modbus.points import (
    Point,
    Range,
    canonical,
    describe,
    parse,
    pieces,
    ranges,
    wire_problems,
)
from drivers.hal.points import Active, Pull, Wire

UNITS = st.sampled_from([0, 1, 16, 247, 255])
CELLS = st.builds(Point, UNITS, st.sampled_from(["coil", "discrete input"]), st.integers(0, 65535))
BITS = st.builds(
    Point,
    UNITS,
    st.sampled_from(["holding register", "input register"]),
    st.integers(0, 65535),
    st.integers(0, 15),
)
POINTS = CELLS | BITS


@pytest.mark.parametrize(
    ("spelled", "one_spelling"),
    [
        ("unit 1 coil 0", "unit 1 coil 0"),
        (" Unit 1  COIL 0 ", "unit 1 coil 0"),
        ("unit1 coil0", "unit 1 coil 0"),
        ("unit 16, discrete_input 0x1f", "unit 16 discrete input 31"),
        ("unit 255 discrete-input 65535", "unit 255 discrete input 65535"),
        ("unit 1 discrete input 0x2711", "unit 1 discrete input 0x2711"),
        ("unit 1 holding 40 bit 3", "unit 1 holding register 40 bit 3"),
        ("Unit 7, input_register 0x10, bit 15", "unit 7 input register 16 bit 15"),
        ("unit 1 holding register 0x9c41 bit 0", "unit 1 holding register 0x9c41 bit 0"),
    ],
)
def test_a_point_has_one_spelling(spelled: str, one_spelling: str) -> None:
    assert canonical(spelled) == one_spelling


@given(POINTS)
def test_the_canonical_spelling_reads_as_itself(point: Point) -> None:
    assert parse(str(point)) == point
    assert canonical(str(point)) == str(point)


HOW = (
    "write 'unit 1 coil 0', 'unit 1 discrete input 0' or 'unit 1 holding register 0 bit 0';"
    " addresses begin at 0"
)
MODEL = "looks like a manual's number, and these begin at 1"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("17", f"'17' is not a Modbus point: {HOW}"),
        ("BCM4", f"'BCM4' is not a Modbus point: {HOW}"),
        ("", f"'' is not a Modbus point: {HOW}"),
        ("00000", f"'00000' is not a Modbus point: {HOW}"),
        ("00017", "'00017' is not a Modbus point: write 'unit 1 coil 16' with the right unit"),
        (
            "10001",
            "'10001' is not a Modbus point: write 'unit 1 discrete input 0' with the right unit",
        ),
        (
            "unit 1 coil 00017",
            f"00017 {MODEL}: write coil 16. Write 0x11 if 17 really is the address on the wire",
        ),
        (
            "unit 1 discrete input 10001",
            f"10001 {MODEL}: write discrete input 0. Write 0x2711 if 10001 really is the address on"
            " the wire",
        ),
        (
            "unit 1 coil 00",
            f"00 {MODEL}: the first is address 0. Write 0x0 if 0 really is the address on the wire",
        ),
        ("unit 248 coil 0", "unit 248 does not exist: units are 0 to 247, and 255 on Modbus TCP"),
        ("unit 1 coil 65536", "address 65536 does not exist: addresses are 0 to 65535"),
        (
            "40041",
            "'40041' is not a Modbus point: write 'unit 1 holding register 40 bit 0' with the right"
            " unit",
        ),
        (
            "unit 1 holding register 40041 bit 3",
            f"40041 {MODEL}: write holding register 40. Write 0x9c69 if 40041 really is the address on"
            " the wire",
        ),
        (
            "unit 1 input 3",
            "'unit 1 input 3': say which input: 'discrete input', or 'input register'",
        ),
        (
            "unit 1 holding register 4",
            "'unit 1 holding register 4': a contact is one bit: add the bit of the"
            " register, such as 'bit 0'",
        ),
        (
            "unit 1 holding register 4 bit 16",
            "'unit 1 holding register 4 bit 16': a register has bits 0 to 15, and bit 0 is"
            " the least significant",
        ),
        (
            "unit 1 coil 4 bit 0",
            "'unit 1 coil 4 bit 0': a coil is one bit already: leave 'bit 0' out",
        ),
        ("unit 1 relay 4", f"'unit 1 relay 4': there is no table 'relay': {HOW}"),
    ],
)
def test_a_text_that_is_not_a_point_is_refused_with_an_example(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(reason)}$"):
        canonical(text)


@given(st.text(max_size=40))
def test_no_text_but_a_point_gets_through(text: str) -> None:
    try:
        canonical(text)
    except ValueError:
        return
    assert text.strip().lower().startswith("unit")


def test_the_table_shows_the_number_that_the_manual_prints() -> None:
    assert describe("unit 1 coil 16") == "unit 1 coil 16 (00017)"
    assert describe("unit 2 discrete input 0") == "unit 2 discrete input 0 (10001)"
    assert describe("unit 1 holding 40 bit 3") == "unit 1 holding register 40 bit 3 (40041 bit 3)"


def output(point: str, active: Active = "high") -> Wire:
    return Wire("hold_open", "out", point, active)


def entry(point: str, pull: Pull | None = None) -> Wire:
    return Wire("opened", "in", point, "high", pull)


@pytest.mark.parametrize(
    "wire",
    [
        entry("unit 1 discrete input 0"),
        entry("unit 1 coil 0"),
        entry("unit 1 holding register 0 bit 15"),
        output("unit 1 coil 0"),
        output("no point at all"),
    ],
)
def test_a_sound_wire_has_no_problem(wire: Wire) -> None:
    assert list(wire_problems(wire)) == []


@pytest.mark.parametrize(
    ("wire", "problem"),
    [
        (
            entry("unit 1 discrete input 0", "up"),
            "pull is for GPIO pins; the module has resistors of its own: delete pull",
        ),
        (
            output("unit 1 discrete input 0"),
            "an output is a coil, and a discrete input can only be read",
        ),
        (
            output("unit 1 holding register 0 bit 3"),
            "an output must be a coil: a write to a register would also write its other bits, which"
            " another device may use. The driver 'register' can write whole registers",
        ),
        (
            output("unit 1 coil 0", "low"),
            "active: low would switch the relay on whenever the module restarts with its"
            " coils at 0: use"
            " the relay's normally open contact and write active: high",
        ),
    ],
)
def test_a_wire_that_cannot_be_right_is_named(wire: Wire, problem: str) -> None:
    assert list(wire_problems(wire)) == [problem]


@given(st.lists(CELLS, max_size=20))
def test_every_point_is_read_once_and_in_bounds(points: list[Point]) -> None:
    read = [point for bits in ranges(points) for point in bits.points()]
    assert set(points) <= set(read)
    assert len(read) == len(set(read))
    assert all(point.address <= 65535 for point in read)


@given(BITS, st.integers(0, 65535))
def test_a_bit_of_a_register_is_read_with_its_register(point: Point, word: int) -> None:
    assert point.cell == Point(point.unit, point.table, point.address)
    assert point.of(word) == int(f"{word:016b}"[15 - (point.bit or 0)])
    assert point.cell.of(word) == word


def test_a_request_reads_no_more_than_a_reply_can_carry() -> None:
    points = [Point(1, "coil", i) for i in range(4001)]
    assert [(bits.start, bits.count) for bits in ranges(points)] == [
        (0, 2000),
        (2000, 2000),
        (4000, 1),
    ]


def test_the_pieces_of_a_range_hold_no_gap() -> None:
    points = [Point(1, "coil", i) for i in (0, 1, 5, 9)]
    assert pieces(Range(1, "coil", 0, 6), points) == [
        Range(1, "coil", 0, 2),
        Range(1, "coil", 5, 1),
    ]

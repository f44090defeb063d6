"""The screen of `rmf-bridge walk`. Even on a phone the screen shows every name in full, and no line
scrolls away."""

from dataclasses import replace
from typing import Any

import pytest

from bridges.system.columns import width
from drivers.hal.points import Wire
from workbench.commissioning.walk.bench import Bench, ContactReading
from workbench.commissioning.walk.core import Switch, WalkStep, decide
from workbench.commissioning.walk.screen import DOWN, Room, Screen, room

FLOORS = [f"L{n}" for n in range(1, 13)]
STEPS = [
    WalkStep(
        f"call {floor}", f"calls the car to {floor}", floor, f"the car is at {floor}", None, str
    )
    for floor in FLOORS
]


def inputs(count: int) -> list[ContactReading]:
    found = [
        ContactReading(Wire(f"floor_parity{n}", "in", f"J8:{n}", active="high"), f"BCM{n}")
        for n in range(count)
    ]
    for n, one in enumerate(found):
        one.level, one.changed_at, one.seen = n % 2, float(n), frozenset({n % 2 == 1})
    return found


def screen(keys: str = "", count: int = 12, steps: list[WalkStep] = STEPS) -> Screen:
    nothing: Any = None
    bench = Bench(nothing, nothing, inputs(count), steps, "")
    found = Screen("Lift1", bench)
    for key in keys.split():
        found.obey(key)
    bench.memory = decide(bench.memory, Switch(0), 1.0, steps)
    return found


def shown(columns: int, rows: int, *, keys: str = "", count: int = 12) -> list[str]:
    return [text for text, _ in screen(keys, count).page(100.0, columns, rows)]


def test_a_phone_shows_the_last_changes_and_the_outputs_around_the_cursor() -> None:
    assert shown(40, 20, keys=f"{DOWN} n n") == [
        "Lift1: not read yet",
        "input           level  is   for   seen",
        "floor_parity6   low    off  94 s  off",
        "floor_parity7   high   on   93 s  on",
        "floor_parity8   low    off  92 s  off",
        "floor_parity9   high   on   91 s  on",
        "floor_parity10  low    off  90 s  off",
        "floor_parity11  high   on   89 s  on",
        "… 6 more",
        "",
        "   output   is   seen",
        "   call L3  off",
        ">  call L4  off",
        "   call L5  off",
        "call L4 calls the car to L4; should be",
        "seen: the car is at L4. So far: not",
        "tried",
        "not read yet",
        "ENTER on/off   n next   p back   y seen",
        "x not seen   q end",
    ]


@pytest.mark.parametrize(("columns", "rows"), [(40, 16), (40, 24), (80, 24), (120, 50)])
def test_no_screen_is_higher_than_the_terminal(columns: int, rows: int) -> None:
    assert len(shown(columns, rows)) <= rows


def test_a_wide_and_high_terminal_shows_every_wire_and_every_output() -> None:
    lines = "\n".join(shown(80, 50))
    assert "floor_parity0   J8:0   low" in lines
    assert all(step.name in lines for step in STEPS)


@pytest.mark.parametrize(
    ("rows", "known", "fit"),
    [
        (30, (8, 5), Room(8, 5)),
        (12, (8, 5), Room(8, 4)),
        (9, (8, 5), Room(5, 3)),
        (2, (8, 5), Room(1, 3)),
        (9, (8, 0), Room(8, 0)),
        (9, (0, 5), Room(0, 5)),
    ],
)
def test_rows_are_shared_between_inputs_and_outputs(
    rows: int, known: tuple[int, int], fit: Room
) -> None:
    assert room(rows, *known) == fit


def test_a_device_without_contacts_shows_only_what_is_decoded() -> None:
    lines = shown(40, 24, count=0)
    assert lines[1] == "no contacts; see the decoded values"
    assert "input" not in " ".join(lines)


def test_an_output_that_is_on_and_an_asserted_input_stand_out() -> None:
    device = screen()
    device._bench.memory = replace(device._bench.memory, on=1, off_at=103.0)
    styles = {text.split("  ")[0].strip("> "): style for text, style in device.page(100.0, 80, 50)}
    assert [styles[name] for name in ("floor_parity0", "floor_parity1")] == ["", "1"]
    assert [text for text, style in device.page(100.0, 80, 50) if style == "1;33"] == [
        "   call L2   ON, 3 s"
    ]


def test_a_name_that_is_too_long_is_cut_before_what_is_known_of_it() -> None:
    steps = [replace(STEPS[0], name=f"call {'北' * 40}")]
    lines = [text for text, _ in screen(steps=steps, count=0).page(100.0, 40, 24)]
    (row,) = (line for line in lines if line.startswith(">"))
    assert row == f">  call {'北' * 10}…  off"
    assert max(map(width, lines)) <= 40


def test_a_picture_is_drawn_over_the_last_one_and_scrolls_nothing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setenv("LINES", "20")
    with screen() as drawn:
        drawn.draw(100.0)
        first = capsys.readouterr().out
        drawn.draw(101.0)
        again = capsys.readouterr().out
    assert first.count("\n") == 19
    assert again.startswith("\x1b[19A\r\x1b[KLift1: ")
    assert again.endswith("\x1b[J\rx not seen   q end")

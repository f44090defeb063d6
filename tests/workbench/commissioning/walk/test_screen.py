"""What a walk shows on a terminal: every name is whole, and nothing scrolls away, also on a phone."""

import io
from typing import Any

import pytest
from rich.console import Console

from drivers.hal.points import Wire
from workbench.commissioning.walk.bench import Bench, Input
from workbench.commissioning.walk.core import Step, Switch, decide
from workbench.commissioning.walk.screen import DOWN, Room, Screen, room

FLOORS = [f"L{n}" for n in range(1, 13)]
STEPS = [
    Step(f"call {floor}", f"calls the car to {floor}", floor, f"the car is at {floor}", None, str)
    for floor in FLOORS
]


def inputs(count: int) -> list[Input]:
    found = [
        Input(Wire(f"floor_parity{n}", "in", f"J8:{n}", active="high"), f"BCM{n}")
        for n in range(count)
    ]
    for n, one in enumerate(found):
        one.level, one.changed_at, one.seen = n % 2, float(n), frozenset({n % 2 == 1})
    return found


def shown(columns: int, rows: int, *, keys: str = "", count: int = 12) -> list[str]:
    nothing: Any = None
    console = Console(file=io.StringIO(), width=columns, height=rows)
    bench = Bench(nothing, nothing, inputs(count), STEPS, "")
    screen = Screen("Lift1", bench, console)
    for key in keys.split():
        screen.obey(key)
    bench.memory = decide(bench.memory, Switch(0), 1.0, STEPS)
    lines = console.render_lines(screen.page(100.0), pad=False)
    return ["".join(segment.text for segment in line).rstrip() for line in lines]


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
    assert lines[1] == "no contacts: registers or messages,"
    assert "input" not in " ".join(lines)

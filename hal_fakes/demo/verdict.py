"""Whether the demo went right, from the journal alone: pure."""

from collections.abc import Iterable
from itertools import groupby
from typing import Any

from bridges.rmf import definitions as d
from bridges.rmf import words
from hal_fakes.demo.day import CHARGER, DOOR, FLEET, FROM, LIFT, REQUEST_ID, ROBOT, TO
from hal_fakes.demo.journal import Journal

SESSION = f"{FLEET}/{ROBOT}"
RELAYS = {
    DOOR: [("hold_open", True), ("hold_open", False)],
    LIFT: [
        ("agv_mode_request", True),
        ("door_open", True),
        ("door_open", False),
        (f"call_{TO}", True),
        (f"call_{TO}", False),
        ("door_open", True),
        ("door_open", False),
        ("agv_mode_request", False),
    ],
}
"""Every relay edge of the day, and no other."""
CHARGING = ["IDLE", "ASSIGNED", "CHARGING", "RELEASED", "IDLE"]


def problems(journal: Journal) -> list[str]:
    """Everything that was not as it should be; empty when the day went right."""
    return [*_relays(journal), *_door(journal), *_lift(journal), *_charger(journal)]


def _relays(journal: Journal) -> Iterable[str]:
    for device, expected in RELAYS.items():
        seen = [
            (e.signal, e.value) for e in journal.edges if (e.device, e.what) == (device, "relay")
        ]
        if seen != expected:
            yield f"{device}'s relays: {_edges(seen)}; expected {_edges(expected)}"


def _edges(edges: Iterable[tuple[str, Any]]) -> str:
    return ", ".join(f"{signal} {'on' if value else 'off'}" for signal, value in edges) or "none"


def _door(journal: Journal) -> Iterable[str]:
    states = [s for s in journal.states if isinstance(s, d.DoorState) and s.door_name == DOOR]
    modes = _in_order(words.condition(state) for state in states)
    if modes != ["CLOSED", "MOVING", "OPEN", "MOVING", "CLOSED"]:
        yield f"{DOOR} was {' '.join(modes)}"


def _lift(journal: Journal) -> Iterable[str]:
    states = [s for s in journal.states if isinstance(s, d.LiftState) and s.lift_name == LIFT]
    ours = [s for s in states if s.session_id == SESSION]
    opened = _in_order(s.current_floor for s in ours if s.door_state == d.LiftDoor.DOOR_OPEN)
    if opened != [FROM, TO]:
        yield f"{LIFT} was open for us at {' '.join(opened) or 'no floor'}, expected {FROM} {TO}"
    sessions = _in_order(s.session_id for s in states)
    if sessions != ["", SESSION, ""]:
        yield f"{LIFT}'s sessions were {sessions}"


def _charger(journal: Journal) -> Iterable[str]:
    states = [s for s in journal.states if isinstance(s, d.ChargerState)]
    states = [s for s in states if s.charger_name == CHARGER]
    order = _in_order(words.word(d.ChargerStateValue, s.state) for s in states)
    if order != CHARGING:
        yield f"{CHARGER} was {' '.join(order)}, expected {' '.join(CHARGING)}"
    for state in states:
        mine = ("", "", "")
        if state.state != d.ChargerStateValue.CHARGER_IDLE:
            mine = (REQUEST_ID, FLEET, ROBOT)
        shown = (state.request_id, state.robot_fleet, state.robot_name)
        if shown != mine:
            yield f"{CHARGER} showed {shown} when {words.condition(state)}, expected {mine}"
            return


def _in_order(values: Iterable[str]) -> list[str]:
    """Without the repeats."""
    return [value for value, _ in groupby(values)]

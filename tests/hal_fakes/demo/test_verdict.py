"""The demo's check of its own run. It accepts only a run without mistakes, and names each mistake."""

from collections.abc import Callable
from typing import Any

import pytest
import yaml
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.words import Stated
from hal_fakes.demo.demo_run import summary
from hal_fakes.demo.journal import Journal
from hal_fakes.demo.ride import DEMO, FROM, LIFT, RELAYS, TO, problems
from hal_fakes.plants.plant import Edge

ME = "demo/robot"
FREE = d.LiftState(lift_name="Lift1", current_floor="L1", current_mode=1)
OURS = replace(FREE, session_id=ME)
LIFT_STATES = [
    FREE,
    OURS,
    replace(OURS, door_state=2, current_mode=2),
    replace(OURS, destination_floor="L3"),
    replace(OURS, current_floor="", door_state=1),
    replace(OURS, current_floor="L3", door_state=2),
    replace(FREE, current_floor="L3", door_state=2),
    replace(FREE, current_floor="L3"),
]
CHARGER = d.ChargerState(charger_name="charger_a", state=1)
ASSIGNED = replace(CHARGER, state=2, request_id="demo-1", robot_fleet="demo", robot_name="robot")
CHARGER_STATES = [
    CHARGER,
    ASSIGNED,
    replace(ASSIGNED, state=3),
    replace(ASSIGNED, state=4),
    CHARGER,
]
DOOR_STATES = [d.DoorState(d.Time(), "ward_door", d.DoorMode(mode)) for mode in (0, 1, 2, 2, 1, 0)]


def right_day() -> Journal:
    journal = Journal(100.0, lambda _: None, colour=False)
    journal.edges = [
        Edge(100.0 + n, device, "relay", signal, value)
        for device, edges in RELAYS.items()
        for n, (signal, value) in enumerate(edges)
    ]
    journal.states = [*DOOR_STATES, *LIFT_STATES, *CHARGER_STATES]
    return journal


def test_a_demo_without_faults_has_no_problems() -> None:
    assert problems(right_day()) == []


def edge_too_many(journal: Journal) -> None:
    journal.edges.insert(4, Edge(101.0, "Lift1", "relay", "call_L1", True))


def door_held(journal: Journal) -> None:
    journal.edges = [e for e in journal.edges if (e.signal, e.value) != ("hold_open", False)]


def state_after(states: list[Stated], after: Stated) -> Callable[[Journal], None]:
    def change(journal: Journal) -> None:
        at = journal.states.index(after) + 1
        journal.states[at:at] = states

    return change


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (edge_too_many, "Lift1's relays: agv_mode_request on, door_open on, call_L1 on"),
        (door_held, "ward_door's relays: hold_open on; expected hold_open on, hold_open off"),
        (
            state_after([d.DoorState(d.Time(), "ward_door", d.DoorMode(4))], DOOR_STATES[1]),
            "ward_door was CLOSED MOVING UNKNOWN OPEN MOVING CLOSED",
        ),
        (
            state_after([replace(OURS, current_floor="L2", door_state=2)], LIFT_STATES[4]),
            "Lift1 was open for the robot at L1 L2 L3, expected L1 L3",
        ),
        (
            state_after([replace(FREE, session_id="fleet/other")], LIFT_STATES[0]),
            "Lift1's sessions were: none, fleet/other, demo/robot, none",
        ),
        (
            state_after([replace(CHARGER, state=200)], ASSIGNED),
            "charger_a was IDLE ASSIGNED ERROR CHARGING RELEASED IDLE, expected",
        ),
        (
            state_after([replace(ASSIGNED, request_id="")], ASSIGNED),
            "charger_a was assigned for demo/robot, expected demo/robot (request demo-1)",
        ),
        (
            state_after([replace(CHARGER, request_id="demo-1")], CHARGER),
            "charger_a was idle for request demo-1, expected nobody",
        ),
    ],
)
def test_each_deviation_from_the_plan_is_named(
    change: Callable[[Journal], None], says: str
) -> None:
    journal = right_day()
    change(journal)
    assert problems(journal)[0].startswith(says)


def test_a_demo_without_events_is_wrong() -> None:
    assert len(problems(Journal(0.0, lambda _: None, colour=False))) == 6


def test_the_devices_and_floors_of_the_day_are_those_of_the_shipped_files() -> None:
    named: dict[str, Any] = {}
    for file in DEMO.files.values():
        content = yaml.safe_load(file.read_text())
        named |= content.get("lifts", {}) | content.get("doors", {}) | content.get("chargers", {})
    assert list(named) == list(DEMO.files)
    assert {FROM, TO} <= set(named[LIFT]["floors"])


# --- the journal, which prints the messages and edges of a run ----------------------------------


def printed() -> tuple[Journal, list[str]]:
    lines: list[str] = []
    return Journal(100.0, lines.append, colour=False), lines


def test_lines_come_in_the_order_of_the_events() -> None:
    journal, lines = printed()
    journal.state(FREE, 100.5)
    journal.edge(Edge(100.25, "Lift1", "relay", "call_L3", True))
    journal.flush(100.3)
    journal.edge(Edge(100.4, "Lift1", "sensor", "agv_mode", False))
    journal.flush(101.0)
    assert lines == [
        "   0.250 s  relay    Lift1       call_L3 on\n",
        "   0.400 s  sensor   Lift1       agv_mode off\n",
        "   0.500 s  state    Lift1       car at L1, door closed, mode HUMAN\n",
    ]


def test_a_repeat_is_counted_but_not_printed() -> None:
    journal, lines = printed()
    request = d.LiftRequest("Lift1", d.Time(1), ME, 1, "L3", 2)
    for n in range(3):
        journal.request(replace(request, request_time=d.Time(n)), 100.0 + n)
        journal.state(replace(FREE, lift_time=d.Time(n)), 100.0 + n)
    journal.request(replace(request, request_type=0), 104.0)
    journal.flush(110.0)
    assert [line.split()[2] for line in lines] == ["request", "state", "request"]
    assert journal.counts() == {"requests": 4, "states": 3}


def test_the_journal_knows_the_relays_that_are_on() -> None:
    journal = right_day()
    assert journal.relays_on() == []
    door_held(journal)
    assert journal.relays_on() == ["ward_door hold_open"]


def test_the_day_begins_with_the_last_state_of_each_device_and_without_edges() -> None:
    journal = right_day()
    journal.begin_day()
    assert (journal.edges, journal.requests) == ([], [])
    assert journal.states == [DOOR_STATES[-1], LIFT_STATES[-1], CHARGER]


def test_colour_is_only_for_a_terminal() -> None:
    lines: list[str] = []
    journal = Journal(100.0, lines.append, colour=True)
    journal.edge(Edge(100.0, "Lift1", "relay", "call_L3", False))
    journal.flush(100.0)
    assert lines == ["   0.000 s  \x1b[33mrelay    Lift1       call_L3 off\x1b[0m\n"]


def test_the_summary_has_the_counts_and_the_duration() -> None:
    journal = right_day()
    journal.legs = {"door": 4.1, "lift": 11.9}
    assert summary(DEMO, journal) == (
        "\nRIGHT: the robot went through the door, rode from L1 to L3 and charged; every relay is off."
        "\n       10 relay edges, 0 requests, 19 states\n       door 4.1 s, lift 11.9 s\n"
    )

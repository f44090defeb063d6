"""The memory of our observers about all devices. The tests cover the bounds of this memory, stepped
clocks, the age of messages, and two nodes with one name."""

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.observe.all_devices import PlainGraph
from bridges.observe.device import reading_age
from bridges.observe.limits import (
    FLAPS_WITHIN_S,
    FORGOTTEN_S,
    MOST_DEVICES,
    MOST_SPEAKERS,
    OLD_S,
)
from bridges.observe.requesters import Moment
from tests.observe.story import BLUE, LIFT, RED, WALL, Story


def lift(at: float, name: str) -> Heard:
    return Heard(at, WALL + at, "lift_states", replace(LIFT, lift_name=name))


def asked(at: float, name: str) -> Heard:
    return Heard(at, WALL + at, "adapter_lift_requests", d.LiftRequest(name, session_id=RED))


def test_known_devices_stay_until_they_are_silent_for_a_minute() -> None:
    graph = PlainGraph()
    for number in range(2 * MOST_DEVICES):
        graph.hear(lift(number / 100, f"lift {number}"))
    first = [f"lift {number}" for number in range(MOST_DEVICES)]
    assert [one.id for one in graph.stated("lift")] == first
    assert graph.crowded == {"lift"}
    graph.hear(lift(FORGOTTEN_S + 1, "new"))
    assert [one.id for one in graph.stated("lift")] == [*first[1:], "new"]


def test_a_device_that_only_gets_requests_gives_way_to_a_device_that_publishes() -> None:
    graph = PlainGraph()
    for number in range(2 * MOST_DEVICES):
        graph.hear(asked(0.0, f"made up {number}"))
    assert len(graph.known) == MOST_DEVICES
    graph.hear(lift(0.1, "Lift1"))
    graph.hear(asked(0.2, "made up again"))
    assert [one.id for one in graph.stated()] == ["Lift1"]
    assert len(graph.known) == MOST_DEVICES
    assert graph.crowded == set()


def test_each_kind_has_its_own_room_and_an_empty_name_is_no_device() -> None:
    graph = PlainGraph()
    for number in range(MOST_DEVICES):
        graph.hear(lift(0.0, f"lift {number}"))
    graph.hear(Heard(0.0, WALL, "door_states", d.DoorState(door_name="lift 0")))
    graph.hear(lift(0.0, ""))
    assert ("door", "lift 0") in graph.known
    assert len(graph.known) == MOST_DEVICES + 1


def test_a_message_in_the_wrong_order_counts_as_new_and_a_stepped_clock_is_noted() -> None:
    graph = PlainGraph()
    for at, wall in ((5.0, WALL), (3.0, WALL - 2), (6.0, WALL + 1), (7.0, WALL + 3602)):
        graph.hear(Heard(at, wall, "lift_states", LIFT))
    assert graph.now.at == 7.0
    assert [(moment.at, by_s) for moment, by_s in graph.steps] == [(7.0, 3600.0)]


@pytest.mark.parametrize(
    ("age_s", "told"),
    [
        (0.0, ""),
        (OLD_S, ""),
        (OLD_S + 1, "is old"),
        (-OLD_S, ""),
        (-OLD_S - 1, "is from the future"),
    ],
)
def test_the_stamp_shows_whether_a_reading_is_old_or_ahead(age_s: float, told: str) -> None:
    assert reading_age(WALL - age_s, WALL) == told
    assert reading_age(0.0, WALL) == "was never read"


def test_only_stamps_of_two_nodes_go_back_and_forth() -> None:
    one, two = Story(), Story()
    for _ in range(6):
        for story, behind_s in ((one, 0.0), (two, 0.0), (two, 1.0)):
            said = replace(LIFT, lift_time=stamp(WALL + story.now - behind_s))
            story.hear("lift_states", said)
        one.passes(1)
        two.passes(1)
    back = [s.device("lift", "Lift1").steps_back(6.0, 0.2, 15.0) for s in (one, two)]
    assert back == [0, 6]


def test_the_known_fleet_adapters_are_bounded_and_an_end_proves_no_adapter() -> None:
    story = Story().asks(RED).passes(1).asks_door(BLUE).passes(1).ends(RED).passes(1)
    story.hear("fleet_states", d.FleetState("fleet"))
    assert {who: at.at for who, at in story.graph.spoke.items()} == {
        BLUE: 1,
        "fleet": 2,
        "fleet/": 3,
    }
    for number in range(2 * MOST_SPEAKERS):
        story.asks(f"made/up{number}")
    assert len(story.graph.spoke) == MOST_SPEAKERS


@pytest.mark.parametrize("mode", [4, 2])
def test_only_a_device_that_goes_offline_and_returns_flaps(
    mode: int,
) -> None:
    story = Story()
    for number in range(8):
        story.hear("lift_states", replace(LIFT, current_mode=mode if number % 2 else 1)).passes(3)
    flaps = story.device("lift", "Lift1").flaps(story.graph.now)
    assert len(flaps) == (7 if mode == 4 else 0)
    story.passes(FLAPS_WITHIN_S)
    assert story.device("lift", "Lift1").flaps(Moment(story.now, WALL)) == []

"""The memory of our observers about a door and a charger: requesters, holders and waits."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.observe.door import ObservedDoor
from bridges.observe.limits import MOST_HOLDERS, UNSEEN_S
from bridges.observe.requesters import DeviceRequester
from tests.observe.story import BLUE, CHARGER, CLOSED, OPEN, RED, Story


def test_a_passage_from_open_to_the_heartbeat_that_lists_nobody() -> None:
    story = Story().door(CLOSED).passes(4).asks_door(RED).lists(RED).passes(1)
    story.asks_door("door_supervisor", topic="door_requests").door(1).passes(1).asks_door(RED)
    story.door(OPEN).passes(1).asks_door(RED, CLOSED).lists()
    assert story.told() == [
        "4 asks fleet/red",
        "4 has fleet/red",
        "5 states again",
        "5 changed",
        "6 changed",
        "6 met fleet/red",
        "7 asks fleet/red",
        "7 lost fleet/red",
    ]


def missing(door: ObservedDoor, one: DeviceRequester) -> list[str]:
    return [f"{check.name}: {check.shown}" for check in door.checks(one) if not check.met]


def held_by_red(story: Story) -> Story:
    """Let red hold the open door. Red drives through, and says nothing more."""
    return story.door(OPEN).passes(4).asks_door(RED).lists(RED).passes(1).door(OPEN).passes(4)


def holders(story: Story) -> tuple[dict[str, float], dict[str, float]]:
    """Return the holders and the forgotten requesters, with the times since when."""
    door = story.device("door", "ward")
    assert isinstance(door, ObservedDoor)
    return (
        {who: since.at for who, since in door.holders.items()},
        {who: since.at for who, since in door.forgotten.items()},
    )


def test_a_close_from_the_supervisor_shows_that_a_restart_has_lost_the_holders() -> None:
    story = held_by_red(Story())
    assert holders(story) == ({RED: 4}, {})
    story.asks_door("door_supervisor", CLOSED, "door_requests")
    assert holders(story) == ({}, {RED: 9})
    assert holders(story.passes(1).asks_door(RED).lists(RED)) == ({RED: 10}, {})


def test_a_holder_that_a_heartbeat_drops_without_close_is_forgotten_until_it_sends_close() -> None:
    story = held_by_red(Story()).asks_door(BLUE).lists(BLUE)
    assert holders(story) == ({BLUE: 9}, {RED: 9})
    assert holders(story.passes(1).asks_door(RED, CLOSED)) == ({BLUE: 9}, {})


def test_a_holder_that_sends_close_is_not_forgotten() -> None:
    story = held_by_red(Story()).asks_door(RED, CLOSED)
    story.asks_door("door_supervisor", CLOSED, "door_requests").lists()
    assert holders(story) == ({}, {})


def test_a_close_of_somebody_else_or_a_late_one_takes_no_holder_away() -> None:
    story = held_by_red(Story()).asks_door("rmf_bridge_send", CLOSED, "door_requests")
    story.passes(1).asks_door(BLUE).lists(RED, BLUE).passes(0.1)
    story.asks_door("door_supervisor", CLOSED, "door_requests")
    assert holders(story) == ({RED: 4, BLUE: 10}, {})


def test_forgotten_requesters_are_bounded() -> None:
    story = Story().door(CLOSED)
    for n in range(2 * MOST_HOLDERS):
        story.passes(1).asks_door(f"made/up{n}").lists(f"made/up{n}")
    held, forgotten = holders(story.lists())
    assert (len(held), len(forgotten)) == (0, MOST_HOLDERS)


def test_the_phase_door_open_waits_for_the_door_and_then_for_the_heartbeat() -> None:
    story = Story().door(CLOSED).asks_door(RED)
    door = story.device("door", "ward")
    assert isinstance(door, ObservedDoor)
    (one,) = door.requesters
    assert missing(door, one) == ["door: closed", "heartbeat: not heard"]
    story.door(OPEN)
    assert missing(door, one) == ["heartbeat: not heard"]
    story.lists(BLUE)
    assert missing(door, one) == ["heartbeat: does not list it"]
    story.lists(RED, BLUE)
    assert door.matches(one)


def test_a_heartbeat_before_the_first_door_state_counts() -> None:
    story = Story().lists(RED).passes(5).door(OPEN)
    door = story.device("door", "ward")
    assert isinstance(door, ObservedDoor)
    assert {who: since.at for who, since in door.holders.items()} == {RED: 0}


def test_without_heartbeats_an_open_door_ends_the_wait() -> None:
    story = Story().door(CLOSED).asks_door(RED).asks_door(BLUE, topic="door_requests")
    assert story.waits("door", "ward") == [(RED, "OPEN", 0), (BLUE, "OPEN", 0)]
    assert story.door(OPEN).waits("door", "ward") == []
    assert story.lists().waits("door", "ward") == [(RED, "OPEN", 0)]


def test_invented_holders_in_a_heartbeat_are_bounded() -> None:
    story = Story().door(CLOSED).lists(*(f"made/up{n}" for n in range(10 * MOST_HOLDERS)))
    door = story.device("door", "ward")
    assert isinstance(door, ObservedDoor)
    assert len(door.holders) == MOST_HOLDERS


def charger(story: Story, state: int, robot: str = "", request: str = "") -> Story:
    fleet = "fleet" if robot else ""
    said = replace(CHARGER, state=state, robot_fleet=fleet, robot_name=robot, request_id=request)
    return story.hear("charger_states", said)


def test_a_robot_waits_at_a_charger_from_its_assignment_until_it_charges() -> None:
    story = charger(Story(), 1).passes(1)
    story.hear("charger_requests", d.ChargerRequest("bay", "fleet", "red", d.Duration(), "r1"))
    charger(story.passes(1), 2, "red", "r1").passes(9)
    assert story.waits("charger", "bay") == [("r1", "CHARGING", 2)]
    assert charger(story, 3, "red", "r1").waits("charger", "bay") == []
    story.hear("charger_cancels", d.ChargerCancel("bay", "r1"))
    assert [one for one in story.told() if "read" not in one and "again" not in one] == [
        "1 asks r1",
        "2 changed",
        "11 changed",
        "11 ends r1",
    ]


def test_the_memory_has_the_robot_at_a_charger_and_the_beginning_of_its_states() -> None:
    story, since = Story(), []
    for seconds in (0.0, 1.0, 2.0, UNSEEN_S + 1.0, 1.0):
        charger(story.passes(seconds), 3, "red" if story.now < 3 else "blue", "r1")
        moment = story.device("charger", "bay").robot.since  # type: ignore[attr-defined]
        since.append((moment.at, moment.seen))
    assert since == [(0, False), (0, False), (3, True), (14, False), (14, False)]

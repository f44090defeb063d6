"""Counts of rides, waits, door cycles, charges and availability, made from the messages on the
graph."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.words import Kind
from bridges.observe.all_devices import PlainGraph
from bridges.observe.limits import SLOWEST_S
from bridges.observe.tally import BOUNDS_S, DeviceCounts, DurationHistogram
from tests.observe.story import BLUE, CHARGER, CLOSED, LIFT, OPEN, RED, Story


def counted(story: Story, kind: Kind, name: str) -> DeviceCounts:
    return story.tally.devices[kind, name].counts


def durations(histogram: DurationHistogram) -> tuple[int, float]:
    return histogram.total, histogram.sum_s


def asks_for(story: Story, floor: str, seconds: int, shown: tuple[str, str]) -> Story:
    """Let a robot repeat its request for `seconds`. The lift shows this session and floor in that
    time."""
    for _ in range(seconds):
        story.asks(RED, floor).lift(*shown).passes(1)
    return story.asks(RED, floor)


FREE, HELD = ("", "L2"), (RED, "L1")


def ride(story: Story) -> Story:
    """Let a robot request the lift at L1, get it after 20 s, and request L2. The lift is open at L2
    another 8 s later."""
    asks_for(story.lift(*FREE), "L1", 20, FREE).lift(RED, "L1", OPEN)
    asks_for(story, "L2", 8, HELD).lift(RED, "L2", OPEN)
    return story.ends(RED).ends(RED, passed=True).lift()


def test_a_ride_counts_as_one_wait_and_one_ride_for_any_moves_of_the_door() -> None:
    story = ride(Story().lift(*FREE).passes(10))
    whole = counted(story, "lift", "Lift1")
    assert (durations(whole.waits), durations(whole.rides), whole.cycles) == ((1, 20), (1, 8), 2)
    story.passes(1).asks(BLUE, "L1").lift(BLUE, "L1", OPEN)
    for _ in range(3):
        story.passes(1).asks(BLUE, "L1").lift(BLUE, "L1", CLOSED).lift(BLUE, "L1", OPEN)
    assert durations(whole.waits) == (2, 20)


def test_a_wait_that_began_before_the_first_message_is_not_counted() -> None:
    story = ride(Story())
    assert durations(counted(story, "lift", "Lift1").waits) == (0, 0)
    assert durations(counted(story, "lift", "Lift1").rides) == (1, 8)


def test_openings_of_a_door_and_waits_of_robots_are_counted() -> None:
    story = Story().door(CLOSED).lists().passes(5)
    story.asks_door(RED).passes(3).asks_door(RED).lists(RED).door(OPEN)
    story.passes(1).asks_door(BLUE).lists(RED, BLUE).door(OPEN).lists().passes(4).door(CLOSED)
    door = counted(story, "door", "ward")
    assert (durations(door.waits), door.cycles) == ((2, 3), 1)


def test_charges_and_their_waits_and_the_reported_energy_are_counted() -> None:
    values = [("kind", "charger"), ("volts", "24.0"), ("amps", "10.0")]
    pairs = tuple(d.KeyValue(*pair) for pair in values)
    said = d.DiagnosticStatus(0, "node: bay", "OK", "bay", pairs)
    story = Story().hear("charger_states", CHARGER).passes(20)
    request = d.ChargerRequest("bay", "fleet", "red", request_id="r1")
    story.hear("charger_requests", request).passes(5)
    charging = replace(CHARGER, state=3, request_id="r1")
    story.hear("charger_states", charging).hear("/diagnostics", d.DiagnosticArray(status=(said,)))
    for _ in range(10):
        story.passes(1).hear("charger_states", charging)
    bay = counted(story, "charger", "bay")
    assert (durations(bay.waits), bay.cycles, bay.energy_j) == ((1, 5), 1, 2400.0)


def test_time_in_service_needs_states_and_a_silence_counts_as_neither() -> None:
    serving = replace(LIFT, current_mode=d.LiftMode.MODE_AGV)
    story = Story().hear("lift_states", serving)
    for _ in range(10):
        story.passes(1).hear("lift_states", serving)
    offline = replace(LIFT, current_mode=d.LiftMode.MODE_OFFLINE)
    for _ in range(5):
        story.passes(1).hear("lift_states", offline)
    story.passes(SLOWEST_S + 1).lift()
    lift = counted(story, "lift", "Lift1")
    assert (lift.watched_s, lift.served_s) == (15.0, 10.0)


def test_a_quantile_is_the_bound_of_its_bucket_or_infinite() -> None:
    histogram = DurationHistogram()
    assert histogram.quantile(0.5) is None
    for duration_s in (0.5, 4.0, 4.0, 900.0):
        histogram.add(duration_s)
    assert [histogram.quantile(share) for share in (0.25, 0.5, 0.75, 1.0)] == [
        BOUNDS_S[0],
        5.0,
        5.0,
        float("inf"),
    ]


def test_invented_names_add_no_counts() -> None:
    story = Story(graph=PlainGraph(most=5))
    for number in range(50):
        story.passes(100).hear("lift_states", replace(LIFT, lift_name=f"made up {number}"))
    assert len(story.tally.devices) <= 6


def test_counts_begin_anew_after_each_read_and_add_up() -> None:
    story = ride(Story().lift(*FREE).passes(10))
    first = story.tally.take_out()["lift", "Lift1"]
    assert counted(story, "lift", "Lift1") == DeviceCounts()
    story.passes(1).lift(*FREE)
    second = story.tally.take_out()["lift", "Lift1"]
    assert (second.watched_s, second.waits.total) == (1.0, 0)
    watched_s = first.watched_s
    first.add(second)
    assert (first.watched_s, durations(first.waits)) == (watched_s + 1.0, (1, 20))

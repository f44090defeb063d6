from bridges.messages import definitions as d
from bridges.messages.topics import DOOR_REQUESTS, FIRE_ALARM_TRIGGER
from bridges.transports.repeats import MOST, Repeats


def test_a_retained_message_that_was_sent_once_counts_once() -> None:
    repeats = Repeats(FIRE_ALARM_TRIGGER)
    arrivals = [(1, False), (2, True), (1, False), (2, True), (3, False)]
    heard = [on for sent, on in arrivals if not repeats.has(sent, d.Bool(on))]
    assert heard == [False, True, False]


def test_messages_that_two_nodes_sent_at_the_same_time_both_count() -> None:
    repeats = Repeats(FIRE_ALARM_TRIGGER)
    assert [repeats.has(1, d.Bool(on)) for on in (True, False)] == [False, False]


def test_without_a_word_about_the_sending_and_on_topics_that_retain_nothing_each_message_counts() -> (
    None
):
    repeats = Repeats(FIRE_ALARM_TRIGGER)
    assert [repeats.has(sent, d.Bool(True)) for sent in (None, None, 0, 0)] == [False] * 4
    repeats = Repeats(DOOR_REQUESTS)
    assert [repeats.has(1, d.DoorRequest()) for _ in range(2)] == [False, False]


def test_the_memory_is_limited_and_keeps_what_was_heard_last() -> None:
    repeats = Repeats(FIRE_ALARM_TRIGGER)
    for sent in range(1, MOST + 1):
        repeats.has(sent, d.Bool(True))
    assert repeats.has(1, d.Bool(True))
    assert not repeats.has(MOST + 1, d.Bool(True))
    assert repeats.has(1, d.Bool(True))
    assert not repeats.has(2, d.Bool(True))

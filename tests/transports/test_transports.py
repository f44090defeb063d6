"""Requirements on every transport, including the `memory` transport."""

from typing import Any

import pytest
from hypothesis import given
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.heard import Sender
from bridges.messages.topics import RETAINED, VOLATILE, Topic
from bridges.transports.transport import Publisher, Subscription, TransportError
from tests.transports.joining import RELEASE, Join
from tests.transports.values import MESSAGE_TYPES, repeatable, values
from tests.waiting import wait_until

HEARD = Topic("heard", d.DoorRequest)
CARRIED = [kind for kind in MESSAGE_TYPES if RELEASE.has(kind)]
KEPT = Topic("kept", d.DoorRequest, publish=RETAINED, subscribe=RETAINED)


def numbered(number: int) -> d.DoorRequest:
    return d.DoorRequest(d.Time(number), f"robot {number}", "door", d.DoorMode(2))


def numbers(received: list[d.DoorRequest]) -> list[int]:
    return [message.request_time.sec for message in received]


def wait_for_match(publisher: Publisher[Any], subscription: Subscription) -> None:
    wait_until(lambda: publisher.matched() and subscription.matched(), "both ends match")


@pytest.mark.parametrize("message_type", CARRIED, ids=lambda kind: kind.__name__)
def test_every_message_arrives_as_it_was_sent(join: Join, message_type: Any) -> None:
    topic: Topic[Any] = Topic("any", message_type)
    received: list[Any] = []
    subscription = join("listener").subscribe(topic, received.append)
    publisher = join("speaker").publisher(topic)
    wait_for_match(publisher, subscription)

    @repeatable
    @given(values(message_type, RELEASE))
    def arrives(message: Any) -> None:
        received.clear()
        publisher.publish(message)
        wait_until(lambda: received, f"{message} arrives")
        assert received == [message]

    arrives()


def test_a_burst_as_deep_as_the_history_loses_nothing_and_keeps_its_order(join: Join) -> None:
    received: list[d.DoorRequest] = []
    subscription = join("listener").subscribe(HEARD, received.append)
    publisher = join("speaker").publisher(HEARD)
    wait_for_match(publisher, subscription)
    for number in range(100):
        publisher.publish(numbered(number))
    wait_until(lambda: len(received) == 100, "all 100 arrive")
    assert numbers(received) == list(range(100))


def test_a_late_joiner_gets_the_newest_retained_messages_as_deep_as_the_history(
    join: Join,
) -> None:
    publisher = join("speaker").publisher(KEPT)
    for number in range(130):
        publisher.publish(numbered(number))
    received: list[d.DoorRequest] = []
    join("late").subscribe(KEPT, received.append)
    wait_until(lambda: len(received) == 100, "100 retained messages arrive")
    publisher.publish(numbered(130))
    wait_until(lambda: len(received) == 101, "a new message arrives after them")
    assert numbers(received) == list(range(30, 131))


def test_a_volatile_subscription_gets_no_earlier_messages(join: Join) -> None:
    publisher = join("speaker").publisher(KEPT)
    publisher.publish(numbered(1))
    received: list[d.DoorRequest] = []
    subscription = join("late").subscribe(replace(KEPT, subscribe=VOLATILE), received.append)
    wait_for_match(publisher, subscription)
    publisher.publish(numbered(2))
    wait_until(lambda: received, "the new message arrives")
    assert numbers(received) == [2]


def test_a_subscription_to_retained_messages_does_not_hear_a_publisher_that_retains_none(
    join: Join,
) -> None:
    forgetful = join("speaker").publisher(replace(KEPT, publish=VOLATILE))
    keeper = join("keeper").publisher(KEPT)
    received: list[d.DoorRequest] = []
    subscription = join("listener").subscribe(KEPT, received.append)
    wait_for_match(keeper, subscription)
    forgetful.publish(numbered(1))
    keeper.publish(numbered(2))
    wait_until(lambda: received, "the retained message arrives")
    assert numbers(received) == [2]
    assert (forgetful.matched(), keeper.matched(), subscription.matched()) == (0, 1, 1)


def test_another_type_under_the_same_name_is_not_heard(join: Join) -> None:
    stranger = join("stranger").publisher(Topic("heard", d.DoorState))
    speaker = join("speaker").publisher(HEARD)
    received: list[d.DoorRequest] = []
    subscription = join("listener").subscribe(HEARD, received.append)
    wait_for_match(speaker, subscription)
    stranger.publish(d.DoorState())
    speaker.publish(numbered(1))
    wait_until(lambda: received, "the right message arrives")
    assert received == [numbered(1)]
    assert (stranger.matched(), subscription.matched()) == (0, 1)


def test_others_only_leaves_out_the_nodes_own_messages(join: Join) -> None:
    ours, other = join("ours"), join("other")
    echoed: list[d.DoorRequest] = []
    from_others: list[d.DoorRequest] = []
    everything = ours.subscribe(HEARD, echoed.append)
    others_only = ours.subscribe(HEARD, from_others.append, others_only=True)
    our_voice, other_voice = ours.publisher(HEARD), other.publisher(HEARD)
    wait_until(
        lambda: our_voice.matched() == 1, "our publisher reaches one of the two subscriptions"
    )
    wait_until(
        lambda: other_voice.matched() == 2, "the other node's publisher reaches both subscriptions"
    )
    wait_until(
        lambda: (everything.matched(), others_only.matched()) == (2, 1),
        "both subscriptions count their publishers",
    )
    our_voice.publish(numbered(1))
    other_voice.publish(numbered(2))
    wait_until(lambda: len(echoed) == 2 and from_others, "all messages have arrived")
    assert sorted(numbers(echoed)) == [1, 2]
    assert numbers(from_others) == [2]
    our_voice.publish(numbered(3))
    other_voice.publish(numbered(3))  # the text of the third message, but from another node
    wait_until(lambda: len(echoed) == 4 and len(from_others) == 2, "all messages have arrived")
    assert numbers(from_others) == [2, 3]
    assert (everything.matched(), others_only.matched()) == (2, 1)


def test_a_subscription_knows_the_nodes_that_send_to_it_and_leaves_itself_out(join: Join) -> None:
    ours, other = join("ours"), join("other")
    heard = ours.subscribe(HEARD, print, others_only=True)
    ours.publisher(HEARD)
    assert heard.senders() == []
    voice = other.publisher(HEARD)
    wait_until(lambda: heard.senders() == [f"/{other.name}"], "the sender has a name")
    voice.close()
    wait_until(lambda: heard.senders() == [], "the sender has gone")


def test_a_listener_may_ask_who_published_a_message_of_two_that_say_the_same(join: Join) -> None:
    ours, one, two = join("ours"), join("one"), join("two")
    heard: list[Sender | None] = []
    subscription = ours.subscribe(HEARD, lambda _: heard.append(ours.sender()))
    voices = one.publisher(HEARD), two.publisher(HEARD)
    wait_until(lambda: subscription.matched() == 2, "both are heard")
    for voice in voices:
        wait_for_match(voice, subscription)

    def named() -> bool:
        heard.clear()
        for voice in voices * 2:
            count = len(heard)
            voice.publish(numbered(1))
            wait_until(lambda count=count: len(heard) > count, "the message arrives")  # type: ignore[misc]
        return ours.speaks == "ros2" or all(sender and sender.node for sender in heard)

    wait_until(named, "discovery has told the nodes")
    if ours.speaks == "ros2":
        assert heard == [None] * 4  # rclpy (Jazzy) does not name the sender
    else:
        assert [sender and sender.node for sender in heard] == [f"/{one.name}", f"/{two.name}"] * 2
        assert len(set(heard)) == 2


def test_matches_are_counted_up_and_down(join: Join) -> None:
    publisher = join("speaker").publisher(HEARD)
    assert publisher.matched() == 0
    first, second = join("first"), join("second")
    heard = first.subscribe(HEARD, print)
    second.subscribe(HEARD, print)
    wait_until(lambda: (publisher.matched(), heard.matched()) == (2, 1), "both subscriptions match")
    second.close()
    wait_until(lambda: publisher.matched() == 1, "the second is gone")


def test_a_node_that_leaves_is_gone_for_the_others_and_may_leave_twice(join: Join) -> None:
    speaker, listener = join("speaker"), join("listener")
    received: list[d.DoorRequest] = []
    publisher = speaker.publisher(HEARD)
    subscription = listener.subscribe(HEARD, received.append)
    wait_for_match(publisher, subscription)
    speaker.close()
    speaker.close()
    wait_until(lambda: subscription.matched() == 0, "the publisher is gone")
    assert publisher.matched() == 0
    with pytest.raises(TransportError):
        publisher.publish(numbered(1))
    with pytest.raises(TransportError, match="has left the graph"):
        speaker.publisher(HEARD)
    with pytest.raises(TransportError, match="has left the graph"):
        speaker.subscribe(HEARD, received.append)
    assert received == []


def test_one_end_may_leave_and_come_back_while_its_node_stays(join: Join) -> None:
    speaker, listener = join("speaker"), join("listener")
    received: list[d.DoorRequest] = []
    subscription = listener.subscribe(HEARD, received.append)
    first = speaker.publisher(HEARD)
    wait_for_match(first, subscription)
    first.close()
    first.close()
    wait_until(lambda: subscription.matched() == 0, "the end is gone")
    assert first.matched() == 0
    with pytest.raises(TransportError):
        first.publish(numbered(1))
    second = speaker.publisher(HEARD)
    wait_for_match(second, subscription)
    second.publish(numbered(2))
    wait_until(lambda: received, "the new end is heard")
    assert numbers(received) == [2]


def test_what_a_node_retained_leaves_with_it(join: Join) -> None:
    first = join("first")
    first.publisher(KEPT).publish(numbered(1))
    first.close()
    stays = join("stays").publisher(KEPT)
    stays.publish(numbered(2))
    received: list[d.DoorRequest] = []
    join("late").subscribe(KEPT, received.append)
    wait_until(lambda: received, "the message that is still retained arrives")
    assert numbers(received) == [2]


def test_a_message_that_cannot_be_put_into_bytes_is_refused_where_it_is_sent(join: Join) -> None:
    publisher = join("speaker").publisher(Topic("lift_states", d.LiftState))
    with pytest.raises(ValueError, match="cannot be sent as LiftState"):
        publisher.publish(d.LiftState(door_state=300))
    with pytest.raises(ValueError, match="cannot be sent as LiftState"):
        publisher.publish(d.DoorState())  # type: ignore[arg-type]


def test_a_node_has_the_name_that_it_was_given_and_has_dropped_nothing(join: Join) -> None:
    node = join("lift_node")
    assert (node.name, node.dropped) == ("lift_node", {})


def test_a_defect_of_a_listener_costs_one_message_and_the_transport_lives(
    join: Join, caplog: pytest.LogCaptureFixture
) -> None:
    received: list[d.DoorRequest] = []

    def listens(message: d.DoorRequest) -> None:
        if message.request_time.sec == 1:
            raise ZeroDivisionError("defect")
        received.append(message)

    listener = join("listener")
    subscription = listener.subscribe(HEARD, listens)
    publisher = join("speaker").publisher(HEARD)
    wait_for_match(publisher, subscription)
    for number in (1, 2):
        publisher.publish(numbered(number))
    wait_until(lambda: received, "the next message arrives")
    assert (numbers(received), listener.dropped, listener.lives) == ([2], {"heard": 1}, True)
    assert [r.getMessage() for r in caplog.records if r.exc_info] == [
        'sample_dropped topic=heard reason="a defect: ZeroDivisionError: defect"'
        ' further="only counted"'
    ]
    listener.close()
    assert not listener.lives

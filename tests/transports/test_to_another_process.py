"""Requirements on a transport between two processes of one machine. The tests run on every wire in
turn.

`ros2` runs where ROS is installed (make test-ros). `zenoh` runs without a router and with both key
formats.
"""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given

from bridges.messages import definitions as d
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES, Topic
from bridges.transports.transport import Transport
from tests.transports import peer
from tests.transports.joining import RELEASE, ZENOH, joining, on_fast_dds
from tests.transports.values import repeatable, values
from tests.waiting import LEASE_S, wait_until

Pair = tuple[str, str]
"""(our transport, the transport of the other process)"""
PAIRS = [
    pytest.param(("dds", "dds"), marks=pytest.mark.dds),
    *(
        pytest.param(pair, marks=[pytest.mark.dds, pytest.mark.ros])
        for pair in (("dds", "ros2"), ("ros2", "dds"), ("ros2", "ros2"))
    ),
    *(pytest.param((way, way), id=way) for way in ZENOH),
]
RETAINED = {"EMERGENCY_SIGNAL", "FIRE_ALARM_TRIGGER", "ADAPTER_LIFT_REQUESTS"} & set(peer.TOPICS)


class Here:
    """A node of this project in its own domain. `theirs` is the transport of the other process."""

    def __init__(self, pair: Pair, domain: int) -> None:
        (self.ours, self.theirs), self.domain = pair, domain
        self.node: Transport = joining(self.ours, domain)("here")


@pytest.fixture(params=PAIRS)
def here(request: pytest.FixtureRequest, domain: int) -> Iterator[Here]:
    made = Here(request.param, domain)
    yield made
    made.node.close()


@pytest.fixture(scope="module", params=PAIRS)
def echoed(request: pytest.FixtureRequest, module_domain: int) -> Iterator[Transport]:
    """Yield a node. A second process returns the messages that this node sends."""
    made = Here(request.param, module_domain)
    with peer.running("echo", made.domain, made.theirs):
        yield made.node
    made.node.close()


@pytest.mark.parametrize("topic", peer.TOPICS.values(), ids=peer.TOPICS.keys())
def test_every_message_survives_the_wire_to_another_process_and_back(
    echoed: Transport, topic: Topic[Any]
) -> None:
    received: list[Any] = []
    subscription = echoed.subscribe(topic.named(f"pong_{topic.name}"), received.append)
    publisher = echoed.publisher(topic.named(f"ping_{topic.name}"))
    wait_until(lambda: publisher.matched() and subscription.matched(), "the echo matches")

    @repeatable
    @given(values(topic.type, RELEASE))
    def comes_back(message: Any) -> None:
        publisher.publish(message)
        wait_until(lambda: received[-1] == message, f"{message} comes back")

    wait_until(lambda: received or peer.sent(publisher, topic.type()), "a first echo comes back")
    comes_back()
    assert echoed.dropped == {}


@pytest.mark.parametrize("name", sorted(RETAINED))
def test_retained_messages_reach_a_process_that_starts_later(here: Here, name: str) -> None:
    topic = peer.TOPICS[name]
    numbered: dict[Any, Callable[[int], d.Message]] = {
        d.EmergencySignal: lambda number: d.EmergencySignal((str(number),), True),
        d.Bool: lambda number: d.Bool(number % 3 == 0),
        d.LiftRequest: lambda number: d.LiftRequest(destination_floor=str(number)),
    }
    received: list[Any] = []
    sent = [numbered[topic.type](number) for number in range(130)]
    here.node.subscribe(topic.named(f"pong_{topic.name}"), received.append)
    publisher = here.node.publisher(topic.named(f"ping_{topic.name}"))
    for message in sent:
        publisher.publish(message)
    with peer.running("echo", here.domain, here.theirs):
        wait_until(lambda: len(received) >= 100, "the hundred newest come back")
    assert received == sent[30:]


def test_what_a_supervisor_retained_is_not_replayed_to_a_lift_that_starts_later(here: Here) -> None:
    received: list[d.LiftRequest] = []
    before, after = d.LiftRequest("before"), d.LiftRequest("after")
    publisher = here.node.publisher(LIFT_REQUESTS.named("ping_lift_requests"))
    here.node.subscribe(LIFT_REQUESTS.named("pong_lift_requests"), received.append)
    publisher.publish(before)
    with peer.running("echo", here.domain, here.theirs):
        wait_until(
            lambda: after in received or peer.sent(publisher, after), "a new message comes back"
        )
    # Fast DDS asks Cyclone for earlier messages, and Cyclone sends them (docs/how-to/ros.md).
    replays = (here.ours, here.theirs) == ("dds", "ros2") and on_fast_dds()
    assert set(received) - ({before} if replays else set()) == {after}


def test_a_process_that_leaves_is_gone_at_once_for_the_others(here: Here) -> None:
    publisher = here.node.publisher(LIFT_STATES.named("ping_lift_states"))
    subscription = here.node.subscribe(LIFT_STATES.named("pong_lift_states"), print)
    with peer.running("echo", here.domain, here.theirs):
        wait_until(
            lambda: publisher.matched() and subscription.matched(), "the other process is found"
        )
    # Fast DDS does not hear Cyclone's farewell. Without a farewell a node notices the departure only
    # when the lease ends.
    unheard = (here.ours, here.theirs) == ("ros2", "dds") and on_fast_dds()
    wait_until(
        lambda: not publisher.matched() and not subscription.matched(),
        "the other process is gone",
        LEASE_S * (2 if unheard else 1),
    )


@pytest.mark.parametrize("here", [(way, way) for way in ZENOH], indirect=True)
def test_nodes_that_stay_find_a_newcomer_after_the_first_of_them_has_gone(here: Here) -> None:
    states = LIFT_STATES
    stays = joining(here.ours, here.domain)("stays")
    try:
        heard: list[d.LiftState] = []
        subscription = stays.subscribe(states, heard.append)
        publisher = here.node.publisher(states)
        wait_until(
            lambda: publisher.matched() and subscription.matched(), "the first two nodes meet"
        )
        here.node.close()
        wait_until(lambda: not subscription.matched(), "the first has gone")
        late = joining(here.ours, here.domain)("late")
        try:
            said = late.publisher(states)
            wait_until(
                lambda: heard or peer.sent(said, d.LiftState(lift_name="Lift1")),
                "the newcomer is heard",
            )
        finally:
            late.close()
    finally:
        stays.close()
    assert set(map(repr, heard)) == {repr(d.LiftState(lift_name="Lift1"))}

"""`zenoh` between processes of one machine, without a router, in both ways of naming things."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given

from bridges.messages import definitions as d
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES, Topic
from bridges.transports.zenoh.transport import ZenohTransport
from tests.transports import peer
from tests.transports.joining import RELEASE, ZENOH, joining
from tests.transports.values import repeatable, values
from tests.waiting import LEASE_S, wait_until

ALL_TOPICS = pytest.mark.parametrize("topic", peer.TOPICS.values(), ids=peer.TOPICS.keys())


class Here:
    """Our node, and a domain of its own."""

    def __init__(self, way: str, domain: int) -> None:
        self.way, self.domain = way, domain
        self.node = ZenohTransport(
            "here", domain, loopback=True, settings=ZENOH[way], release=RELEASE
        )


@pytest.fixture(params=ZENOH)
def here(request: pytest.FixtureRequest, domain: int) -> Iterator[Here]:
    made = Here(request.param, domain)
    yield made
    made.node.close()


@pytest.fixture(scope="module", params=ZENOH)
def echoed(request: pytest.FixtureRequest, module_domain: int) -> Iterator[ZenohTransport]:
    """A node, and a second process that sends back what it says."""
    made = Here(request.param, module_domain)
    with peer.running("echo", made.domain, made.way):
        yield made.node
    made.node.close()


@ALL_TOPICS
def test_every_message_survives_the_wire_to_another_process_and_back(
    echoed: ZenohTransport, topic: Topic[Any]
) -> None:
    received: list[Any] = []
    subscription = echoed.subscribe(topic.named(f"pong_{topic.name}"), received.append)
    publisher = echoed.publisher(topic.named(f"ping_{topic.name}"))
    wait_until(lambda: publisher.matched() and subscription.matched(), "the echo matches")

    @repeatable
    @given(values(topic.type))
    def comes_back(message: Any) -> None:
        publisher.publish(message)
        wait_until(lambda: received and received[-1] == message, f"{message} comes back")

    comes_back()
    assert echoed.dropped == {}


@pytest.mark.parametrize(
    "name", ["EMERGENCY_SIGNAL", "FIRE_ALARM_TRIGGER", "ADAPTER_LIFT_REQUESTS"]
)
def test_retained_messages_reach_a_process_that_starts_later(here: Here, name: str) -> None:
    topic = peer.TOPICS[name]
    numbered: dict[Any, Callable[[int], d.Message]] = {
        d.EmergencySignal: lambda number: d.EmergencySignal((str(number),), True),
        d.Bool: lambda number: d.Bool(number % 3 == 0),
        d.LiftRequest: lambda number: d.LiftRequest(destination_floor=str(number)),
    }
    sent = [numbered[topic.type](number) for number in range(130)]
    received: list[Any] = []
    here.node.subscribe(topic.named(f"pong_{topic.name}"), received.append)
    publisher = here.node.publisher(topic.named(f"ping_{topic.name}"))
    for message in sent:
        publisher.publish(message)
    with peer.running("echo", here.domain, here.way):
        wait_until(lambda: len(received) >= 100, "the hundred newest come back")
    assert received == sent[30:]


def test_what_a_supervisor_retained_is_not_replayed_to_a_lift_that_starts_later(here: Here) -> None:
    received: list[d.LiftRequest] = []
    publisher = here.node.publisher(LIFT_REQUESTS.named("ping_lift_requests"))
    here.node.subscribe(LIFT_REQUESTS.named("pong_lift_requests"), received.append)
    publisher.publish(d.LiftRequest("before"))
    after = d.LiftRequest("after")
    with peer.running("echo", here.domain, here.way):
        wait_until(lambda: received or peer.sent(publisher, after), "a new one comes back")
    assert set(received) == {after}


def test_a_process_that_leaves_is_gone_at_once_for_the_others(here: Here) -> None:
    publisher = here.node.publisher(LIFT_STATES.named("ping_lift_states"))
    subscription = here.node.subscribe(LIFT_STATES.named("pong_lift_states"), print)
    with peer.running("echo", here.domain, here.way):
        wait_until(lambda: publisher.matched() and subscription.matched(), "it is found")
    wait_until(
        lambda: not publisher.matched() and not subscription.matched(), "it is gone", LEASE_S
    )


def test_nodes_that_stay_find_a_newcomer_after_the_first_of_them_has_gone(here: Here) -> None:
    states = LIFT_STATES
    stays = joining(here.way, here.domain)("stays")
    try:
        heard: list[d.LiftState] = []
        subscription = stays.subscribe(states, heard.append)
        publisher = here.node.publisher(states)
        wait_until(lambda: publisher.matched() and subscription.matched(), "they meet")
        here.node.close()
        wait_until(lambda: not subscription.matched(), "the first has gone")
        late = joining(here.way, here.domain)("late")
        try:
            said = late.publisher(states)
            wait_until(
                lambda: heard or peer.sent(said, d.LiftState(lift_name="Lift1")), "they meet too"
            )
        finally:
            late.close()
    finally:
        stays.close()
    assert set(map(repr, heard)) == {repr(d.LiftState(lift_name="Lift1"))}

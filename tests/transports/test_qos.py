"""The type and QoS of every topic, compared with a table that was typed by hand."""

from typing import Any

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.topics import Topic
from tests.transports.golden_qos import GOLDEN, PLAIN, RETAINED, Qos
from tests.transports.memory import MemoryNetwork, MemoryTransport

TOPICS = {topic.name: topic for topic in vars(topics).values() if isinstance(topic, Topic)}


def typed(qos: topics.Qos) -> Qos:
    """Return a QoS in the form of the golden table. `topics.Qos` is always RELIABLE and KEEP_LAST."""
    return Qos("RELIABLE", qos.durability.upper(), "KEEP_LAST", qos.depth)


def test_the_table_of_topics_is_the_golden_one() -> None:
    ours = {
        name: (
            f"{d.PACKAGES[topic.type]}/{topic.type.__name__}",
            typed(topic.publish),
            typed(topic.subscribe),
        )
        for name, topic in TOPICS.items()
    }
    assert ours == GOLDEN


def test_a_lifts_node_hears_adapters_without_what_they_retain() -> None:
    ours = topics.ADAPTER_LIFT_REQUESTS.live()
    assert (ours.name, typed(ours.subscribe)) == ("adapter_lift_requests", PLAIN)


def test_a_node_that_joins_again_repeats_states_that_still_hold_and_no_request() -> None:
    assert {name: topic.repeats for name, topic in TOPICS.items() if topic.repeats} == {
        "charging_assignments": 100,
        "alert": 100,
        "fire_alarm_trigger": 100,
        "emergency_signal": 100,
    }


@pytest.mark.parametrize("name", GOLDEN)
def test_on_the_memory_transport_a_late_subscriber_hears_what_the_golden_depths_retain(
    name: str,
) -> None:
    """Publisher and subscription match for each topic. The late subscriber gets as many retained
    messages as the depths in the golden table permit."""
    topic: Topic[Any] = TOPICS[name]
    _, publish, subscribe = GOLDEN[name]
    network = MemoryNetwork()
    publisher = MemoryTransport(network, "speaker").publisher(topic)
    for _ in range(publish.depth + 1):
        publisher.publish(topic.type())
    heard: list[Any] = []
    MemoryTransport(network, "late").subscribe(topic, heard.append)
    retained = (publish.durability, subscribe.durability) == (RETAINED.durability,) * 2
    assert len(heard) == (min(publish.depth, subscribe.depth) if retained else 0)
    assert publisher.matched() == 1

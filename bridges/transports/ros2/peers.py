"""The types and type hashes with which other nodes publish or subscribe to our topics, as rclpy reports
them."""

from collections.abc import Iterable, Sequence
from typing import Protocol

from bridges.messages.topics import AnyTopic
from bridges.transports.peers import Announced, Peers


class EndpointInfo(Protocol):
    """The parts of rclpy's TopicEndpointInfo that this file reads."""

    @property
    def topic_type(self) -> str: ...
    @property
    def topic_type_hash(self) -> object: ...
    @property
    def endpoint_gid(self) -> Iterable[int]: ...


class Graph(Protocol):
    """The graph queries of an rclpy node."""

    def get_publishers_info_by_topic(self, topic_name: str) -> Sequence[EndpointInfo]:
        """Return every publisher of a topic."""

    def get_subscriptions_info_by_topic(self, topic_name: str) -> Sequence[EndpointInfo]:
        """Return every subscription of a topic."""


def look(graph: Graph, peers: Peers, ours: Iterable[tuple[AnyTopic, bool]]) -> None:
    """Report the present ends to `peers`. `ours`: pairs of a topic and True if we publish it."""
    peers.clear()
    for topic, publishes in ours:
        peers.ours(topic, publishes=publishes)
        others = graph.get_subscriptions_info_by_topic
        for info in (others if publishes else graph.get_publishers_info_by_topic)(topic.name):
            hashed = str(info.topic_type_hash)
            known = hashed if hashed.startswith("RIHS01_") else ""
            end = Announced(topic.name.strip("/"), info.topic_type, known, not publishes)
            peers.seen(bytes(info.endpoint_gid), end)
    peers.settle()
    peers.name_misfits()

"""Examine RMF's graph from this machine: interface, domain, nodes, and message versions.

The doctor joins the graph for some seconds, as `watch` does, and only listens.
"""

import importlib.metadata
import logging
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Any, Final

from bridges.kinds import kind_called
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.messages import words
from bridges.messages.definitions import PACKAGES
from bridges.runtime.service import named_by
from bridges.settings.load import Config
from bridges.transports.addresses import addresses
from bridges.transports.choose import domain_id, open_transport, peers_of, stays_on_loopback
from bridges.transports.transport import Subscription, Transport, TransportError
from workbench.commissioning.doctor.finding import Finding, note, ok, warning, wrong
from workbench.graph.live import Ear

NETWORK: Final = "network"
GRAPH: Final = "RMF"
MESSAGES: Final = "messages"
SENDERS: Final = {
    "lift_requests": "RMF's lift supervisor, or rmf-bridge run lift_supervisor.yaml",
    "door_requests": "RMF's door supervisor, or rmf-bridge run door_supervisor.yaml",
    "charger_requests": "the charger coordinator, or a fleet adapter",
    "adapter_lift_requests": "RMF's fleet adapters",
    "adapter_door_requests": "RMF's fleet adapters",
    "fleet_states": "RMF's fleet adapters",
}
"""Topic -> its publishers in RMF. Without these publishers, no requests reach the devices. On any other
topic, there may be no publisher."""
LIBRARIES: Final = {"dds": "cyclonedds", "zenoh": "eclipse-zenoh"}


@dataclass(frozen=True, slots=True)
class GraphLook:
    """Settings for examining the graph.

    - `listen_s`: time (s) to listen.
    - `serving`: whether our own daemon is on the graph; None if unknown.
    - `watch`: the command that shows this graph.
    """

    localhost: bool
    listen_s: float
    serving: bool | None
    watch: str
    ros_args: Sequence[str] = ()

    @property
    def alone(self) -> str:
        """The remedy if no other node is heard on the graph."""
        return (
            f"docs/how-to/ros.md: domain, multicast, interfaces; {self.watch} shows what is heard"
        )


def graph(config: Config, look: GraphLook) -> Iterator[Finding]:
    """Examine the network, RMF's graph, and the versions of RMF's messages."""
    try:
        domain = domain_id(config.rmf, os.environ)
        peers = peers_of(config.rmf.transport, os.environ)
        loopback = look.localhost or stays_on_loopback(config.rmf, os.environ, peers)
        yield _interface(domain, loopback)
        with overheard() as said:
            transport = open_transport(
                config.rmf, "rmf_bridge_doctor", localhost=look.localhost, ros_args=look.ros_args
            )
            with closing(transport):
                yield from _heard(config, transport, look)
                yield from _messages(transport)
        for text in dict.fromkeys(said):
            yield warning(GRAPH, text, "the transport reports this about other nodes", look.alone)
    except TransportError as error:
        yield wrong(GRAPH, str(error), "RMF neither hears nor is heard", look.alone)


def _interface(domain: int, loopback: bool) -> Finding:
    if loopback:
        means = "no other machine is heard"
        do = "network: of the YAML, or ROS's variables"
        return note(NETWORK, f"domain {domain}, on this machine alone", means, do)
    found = sorted(address for _, address in addresses())
    if not found:
        means = "RMF on another machine is not heard; dds and zenoh join once an address is there"
        return wrong(NETWORK, "no interface with a link has an IPv4 address", means, "ip addr")
    text = f"domain {domain}, from the address {' and '.join(found)}"
    if len(found) > 1 and not os.environ.get("CYCLONEDDS_URI"):
        return note(
            NETWORK,
            text,
            "DDS uses only one of these interfaces",
            'docs/how-to/ros.md, "Two network interfaces"',
        )
    return ok(NETWORK, text)


def _heard(config: Config, transport: Transport, look: GraphLook) -> Iterator[Finding]:
    kind = kind_called(config.kind)
    ends = {
        topic.name: transport.subscribe(named_by(config, topic), _ignore) for topic in kind.requests
    }
    if isinstance(kind, GraphKind):
        rivals = [transport.subscribe(named_by(config, topic), _ignore) for topic in kind.sole]
        _listened(Ear(transport, ()), look.listen_s)
        found = _rivals(rivals, look.serving)
    else:
        states = [named_by(config, topic) for topic in kind.stated_on]
        messages = _listened(Ear(transport, states), look.listen_s)
        found = _ours(list(config.devices), set(map(kind.device_name, messages)), look)
    yield ok(GRAPH, f"joined by {transport.speaks} for {look.listen_s:g} s")
    for topic, end in ends.items():
        yield _senders(topic, end, look)
    yield from found


def _listened(ear: Ear, listen_s: float) -> list[Any]:
    """Return every message that arrives within `listen_s` (s)."""
    until, messages = time.monotonic() + listen_s, list[Any]()
    while (left_s := until - time.monotonic()) > 0:
        messages += [heard.message for heard in ear.listen(left_s)]
    return messages


def _senders(topic: str, end: Subscription, look: GraphLook) -> Finding:
    nodes, who = end.matched(), SENDERS.get(topic)
    if nodes:
        return ok(GRAPH, f"{topic}: from {nodes} node{'s' if nodes > 1 else ''}")
    if who is None:
        return note(GRAPH, f"{topic}: nobody sends")
    means = "no robot's request arrives here"
    return warning(GRAPH, f"{topic}: nobody sends", means, f"start {who}; {look.alone}")


def _rivals(ends: Sequence[Subscription], serving: bool | None) -> Iterator[Finding]:
    """Find other nodes that do the same work as our node."""
    rivals = max((end.matched() for end in ends), default=0) - (serving is not False)
    if rivals > 0:
        means = "our node only listens (passive) while the other node is there"
        do = "stop RMF's own node, or ours"
        yield warning(GRAPH, f"{rivals} other node(s) have the same task", means, do)


def _ours(devices: Sequence[str], heard: set[str], look: GraphLook) -> Iterator[Finding]:
    serving = look.serving
    for name in devices:
        if name in heard and serving is False:
            means = "two nodes would publish the same name, and RMF would believe each in turn"
            do = "stop the other node, which may run on another machine"
            yield wrong(GRAPH, f"somebody already publishes {name}", means, do)
        elif serving and name not in heard:
            do = f"rmf-bridge log FILE; {look.alone}"
            yield warning(
                GRAPH, f"{name} is not heard from our daemon", "RMF may not hear {name} either", do
            )
        elif serving:
            yield ok(GRAPH, f"{name} is heard")
    if others := sorted(heard - set(devices)):
        shown = words.printable(", ".join(others))
        yield note(GRAPH, f"other devices of this kind are heard: {shown}")


def _messages(transport: Transport) -> Iterator[Finding]:
    for topic, count in transport.dropped.items():
        means = "the sender has another version of RMF's messages, or sends invalid data"
        do = "install the same release of RMF's message packages on every machine"
        yield wrong(MESSAGES, f"{count} messages on {topic} could not be decoded", means, do)
    if transport.speaks == "ros2":
        yield from _installed()
    else:
        library = LIBRARIES.get(transport.speaks, transport.speaks)
        version = importlib.metadata.version(library)
        yield ok(MESSAGES, f"RMF's messages are built in; {library} {version}")


def _installed() -> Iterator[Finding]:
    from bridges.transports.ros2.types import ros_type

    problems = []
    for message_type in PACKAGES:
        try:
            ros_type(message_type)
        except TransportError as error:
            problems.append(str(error))
    for text in problems:
        means = "the package's samples would be misread, so the package is not used"
        yield wrong(MESSAGES, text, means, "install the same release of RMF's packages everywhere")
    if not problems:
        yield ok(MESSAGES, "the installed ROS packages agree with RMF's releases")


@contextmanager
def overheard() -> Iterator[list[str]]:
    """Yield a list. During the block, the list collects the warnings and errors that transports log."""
    said: list[str] = []
    ears = logging.Handler(logging.WARNING)
    ears.emit = lambda record: said.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("bridges.transports")
    before = logger.level, logger.propagate
    logger.setLevel(logging.WARNING)
    logger.propagate = False
    logger.addHandler(ears)
    try:
        yield said
    finally:
        logger.removeHandler(ears)
        logger.setLevel(before[0])
        logger.propagate = before[1]


def _ignore(message: object) -> None:
    """Discard a message, because the doctor only counts senders."""

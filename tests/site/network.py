"""The site's graph: the `memory` transport, with a simulated network between its nodes.

The network keeps the guarantees of the QoS RELIABLE and KEEP_LAST. A reader gets the samples of one
writer in order. If the network must send a sample twice, the sample arrives late.

On real sites RMF's own readers of states are best effort (Fast DDS). So here these readers lose some
samples. The network is harsher than DDS, because all other readers lose a few samples too. Only what
RMF's supervisors publish is never lost: they do not repeat an OPEN for a door that is still open, and
rely on RELIABLE. A few samples also come twice.

A node that is cut off for less than a lease gets all samples afterwards in one burst. A node that is
cut off for longer loses all samples of that time. Afterwards it gets the messages that other nodes
retain.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from random import Random
from typing import Any

from bridges.messages import words
from bridges.messages.definitions import Message
from bridges.messages.heard import Sender
from bridges.messages.releases import NEWEST
from bridges.messages.topics import CHARGER_STATES, DOOR_STATES, LIFT_STATES, Topic
from tests.site.timeline import NEVER, Timeline
from tests.transports.memory import MemoryNetwork, MemoryTransport

LEASE_S = 10.0
STATES = (LIFT_STATES.name, DOOR_STATES.name)
SORTED = (*STATES, CHARGER_STATES.name)
RETAINED = "retained"
"""The name that stands in for the sender's name when a late joiner gets retained messages."""

Watch = Callable[[str, Topic[Any], Message], None]


@dataclass(frozen=True)
class Weather:
    """The probabilities of disturbances. `lost`: a sample is lost. `states_lost`: a state to a node of
    RMF is also lost. `late`: a sample is up to `latest_s` late. `twice`: a sample arrives twice."""

    lost: float = 0.005
    states_lost: float = 0.02
    late: float = 0.02
    twice: float = 0.005
    latest_s: float = 2.0


CLEAR = Weather(0.0, 0.0, 0.0, 0.0)


NameOf = Callable[[Any], str]
"""A function that returns the device's name in a message."""
Heeded = tuple[str, str]
"""A topic of states and the name of the device that a robot heeds; "" for every device."""


class Air:
    """The network between the nodes. Nodes in `best_effort` lose more states than other nodes do, as
    RMF's nodes do. The samples of nodes in `unrepeated` are late in place of lost. `watch` gets all
    samples.

    With `sorts`, a node gets no message that changes nothing for it. A device gets only messages that
    name it (`Place.subscribe_to`). A robot gets only states that it heeds (`Place.heed`), and those
    with its session. After the state of a device that it heeds, it also gets the next state of another
    device, because this state replaces the first one in RMF's DoorOpen. In a hospital with 200 doors
    all but a few of the samples would change nothing.
    """

    def __init__(self, timeline: Timeline, random: Random) -> None:
        self.timeline = timeline
        self.memory = MemoryNetwork()
        self.weather = Weather()
        self.best_effort: set[str] = set()
        self.unrepeated: set[str] = set()
        self.watch: Watch = lambda speaker, topic, message: None
        self.speaker = RETAINED
        self.release = NEWEST
        self.counts = dict.fromkeys(("sent", "arrived", "lost", "late", "twice"), 0)
        self.sorts = False
        self.addressed: dict[str, tuple[NameOf, dict[str, list[_Ear]]]] = {}
        self.choosy: dict[str, dict[str, _Ear]] = {}
        self.heeding: dict[tuple[str, str], dict[str, _Ear]] = {}
        self.replacing: dict[str, dict[str, _Ear]] = {}
        self._random = random
        self._cut: dict[str, float] = {}
        self._arrived: dict[tuple[str, str, str], float] = {}

    def cut_off(self, name: str, until: float) -> None:
        """Block all messages to and from this node until this time."""
        self._cut[name] = until
        lost = until - self.timeline.now > LEASE_S
        self.timeline.at(until, partial(self._found_again, name, lost))

    def delays(self, speaker: str, hearer: str, topic: Topic[Any]) -> Sequence[float]:
        """Return the delay of each copy of a sample (s). A lost sample has no copy."""
        weather, random, now = self.weather, self._random.random, self.timeline.now
        delay = 0.002 + 0.02 * random()
        if self._cut:
            until = max(self._cut.get(speaker, now), self._cut.get(hearer, now))
            if until - now > LEASE_S:
                return ()
            delay += until - now
        draw = random()
        lost = weather.lost
        if hearer in self.best_effort and topic.name in STATES:
            lost += weather.states_lost
        if draw < lost:
            return (delay + weather.latest_s,) if speaker in self.unrepeated else ()
        if draw > 1.0 - weather.late:
            self.counts["late"] += 1
            delay += weather.latest_s * random()
        if random() < weather.twice:
            self.counts["twice"] += 1
            return (delay, delay + 0.1 * random())
        return (delay,)

    def carry(
        self, hearer: "Place", topic: Topic[Any], received: Callable[[Any], None], message: Any
    ) -> None:
        """Carry one sample to one subscription."""
        self.counts["sent"] += 1
        delays = self.delays(self.speaker, hearer.name, topic)
        link = (self.speaker, hearer.name, topic.name)
        for delay in delays:
            at = max(self.timeline.now + delay, self._arrived.get(link, 0.0))
            self._arrived[link] = at
            self.timeline.at(at, partial(hearer.arrive, received, message, hearer.heard_from))
        if not delays:
            self.counts["lost"] += 1

    def forget_links(self) -> None:
        """Forget the links whose samples have all arrived, because in a hospital their number grows for
        hours. A later sample cannot overtake them any more."""
        now = self.timeline.now
        self._arrived = {link: at for link, at in self._arrived.items() if at > now}

    def _found_again(self, name: str, lost: bool) -> None:
        if self._cut.get(name, NEVER) > self.timeline.now:
            return
        del self._cut[name]
        if not lost:
            return
        for end in [end for ends in self.memory.subscriptions.values() for end in ends]:
            if end.node.name == name:
                end.catch_up()
            else:
                self._give_again(name, end)

    def _give_again(self, name: str, end: Any) -> None:
        """Give the subscription the retained messages of the node that has returned."""
        for publisher in self.memory.publishers[end.topic.name]:
            if publisher.node.name == name and _wants_retained(end, publisher):
                for message in list(publisher.retained):
                    end.received(message)


class Place(MemoryTransport):
    """One node's place on the graph. `heard` runs after each sample that the node gets. A `choosy` node
    gets only the states that it heeds."""

    def __init__(
        self, air: Air, name: str, heard: Callable[[], None], *, choosy: bool = False
    ) -> None:
        super().__init__(air.memory, name, air.release)
        self._choosy = choosy and air.sorts
        self._heeded: frozenset[Heeded] = frozenset()
        self._air = air
        self._heard = heard

    def publisher(self, topic: Topic[Any]) -> Any:
        return _Mouth(self, self._air, super().publisher(topic))

    def subscribe(
        self, topic: Topic[Any], received: Callable[[Any], None], *, others_only: bool = False
    ) -> Any:
        if self._choosy and topic.name in SORTED:
            self._air.choosy.setdefault(topic.name, {})[self.name] = _Ear(
                self, received, others_only
            )
            return None
        carried = partial(self._air.carry, self, topic, received)
        return super().subscribe(topic, carried, others_only=others_only)

    def heed(self, heeded: frozenset[Heeded]) -> None:
        """Get the states of these devices from now on. Of other devices get only the states with the
        node's session."""
        if heeded == self._heeded or not self._choosy:
            return
        air = self._air
        for one in self._heeded - heeded:
            air.heeding[one].pop(self.name, None)
            air.replacing.get(one[0], {}).pop(self.name, None)
        for one in heeded - self._heeded:
            air.heeding.setdefault(one, {})[self.name] = air.choosy[one[0]][self.name]
        self._heeded = heeded

    def close(self) -> None:
        """Leave the graph, and heed nothing more."""
        self.heed(frozenset())
        super().close()

    def subscribe_to(
        self,
        name: str,
        name_of: NameOf,
        topic: Topic[Any],
        received: Callable[[Any], None],
        *,
        others_only: bool = False,
    ) -> None:
        """Subscribe for a device that drops all messages without its name. Retained messages do not
        arrive if the network sorts."""
        if not self._air.sorts:
            self.subscribe(topic, received, others_only=others_only)
            return
        ears = self._air.addressed.setdefault(topic.name, (name_of, {}))[1].setdefault(name, [])
        _add(ears, _Ear(self, received, others_only))

    def arrive(self, received: Callable[[Any], None], message: Any, sender: Sender | None) -> None:
        """Hand the message over if the node is still on the graph."""
        if not self._closed:
            self.heard_from = sender
            self._air.counts["arrived"] += 1
            received(message)
            self._heard()


@dataclass(frozen=True)
class _Ear:
    """A device's subscription to messages with its name, or a choosy node's subscription to states."""

    place: Place
    received: Callable[[Any], None]
    others_only: bool


def _add(ears: list[_Ear], ear: _Ear) -> None:
    """Add an ear in place of those of nodes that have left the graph."""
    ears[:] = [*(one for one in ears if one.place.lives), ear]


class _Mouth:
    def __init__(self, place: Place, air: Air, inner: Any) -> None:
        self._place = place
        self._air = air
        self._inner = inner

    def publish(self, message: Any) -> None:
        self._air.watch(self._place.name, self._inner.topic, message)
        self._air.speaker = self._place.name
        self._inner.publish(message)
        for ear in self._ears(message):
            if ear.place.lives and not (ear.others_only and ear.place is self._place):
                ear.place.heard_from = self._inner.sender
                self._air.carry(ear.place, self._inner.topic, ear.received, message)
        self._air.speaker = RETAINED

    def _ears(self, message: Any) -> Iterator[_Ear]:
        """Yield the ears that a sorting network finds for the message."""
        topic = self._inner.topic.name
        if topic in self._air.addressed:
            name_of, ears = self._air.addressed[topic]
            yield from ears.get(name_of(message), ())
        if topic in self._air.choosy:
            of_all = self._air.heeding.get((topic, ""), {})
            of_it = self._air.heeding.get((topic, words.device(message)), {})
            replacing = self._air.replacing.setdefault(topic, {})
            others = {name: ear for name, ear in replacing.items() if name not in of_it}
            self._air.replacing[topic] = dict(of_it)
            session = getattr(message, "session_id", "")
            if session and (ear := self._air.choosy[topic].get(session)):
                others[session] = ear
            yield from {**others, **of_all, **of_it}.values()

    def matched(self) -> int:
        return int(self._inner.matched())

    def close(self) -> None:
        self._inner.close()


def _wants_retained(end: Any, publisher: Any) -> bool:
    both = end.topic.subscribe.durability, publisher.topic.publish.durability
    return both == ("transient_local", "transient_local") and bool(end.hears(publisher))

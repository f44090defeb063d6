"""RMF's side of a demo on a real graph: supervisors, fleet adapters, robots, and the received messages.

Requests take the same way as in RMF. A fleet adapter publishes on the adapter topics. The supervisor
receives these messages from the wire, and publishes on the daemon's topic.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.topics import AnyTopic
from bridges.messages.words import Requested, Stated
from bridges.transports.transport import Publisher, Transport
from hal_fakes.demo.daemons import DaemonProcess, DemoFailed
from hal_fakes.demo.journal import SETTLES_S, Journal
from hal_fakes.plants.plant import Edge
from workbench.rmf_model import Party, Said

TO_DAEMONS: Final[tuple[AnyTopic, ...]] = (
    topics.LIFT_REQUESTS,
    topics.DOOR_REQUESTS,
    topics.CHARGER_REQUESTS,
    topics.CHARGER_CANCELS,
)
STATES: Final[tuple[AnyTopic, ...]] = (
    topics.LIFT_STATES,
    topics.DOOR_STATES,
    topics.CHARGER_STATES,
)
PUBLISHED: Final[tuple[AnyTopic, ...]] = (
    *TO_DAEMONS[:3],
    topics.ADAPTER_LIFT_REQUESTS,
    topics.ADAPTER_DOOR_REQUESTS,
    topics.ADAPTER_CHARGER_REQUESTS,
    topics.DOOR_SUPERVISOR_HEARTBEAT,
    topics.FLEET_STATES,
)
LOOK_EVERY_S: Final = 0.05


class World:
    """RMF's side of a demo, with one inbox for messages and edges. The demo's day waits in `until`.
    During the wait this class takes messages from the inbox, and lets the supervisors and fleets
    act.

    `places` holds the assigned place of each robot, where the robot charges or waits. `alerts` are
    texts for a person. `page` is the line with the page's address, if there is a page.
    """

    def __init__(
        self,
        transport: Transport,
        daemons: Mapping[str, DaemonProcess],
        journal: Journal,
        check: Callable[[], None],
        patience: float = 1.0,
        *,
        publishes: Iterable[AnyTopic] = PUBLISHED,
    ) -> None:
        """Join the graph.

        `until` calls `check` again and again, and `check` raises an error when the demo must end.
        `patience` is a factor on the time limits of `until`. `publishes` are the topics that this side
        publishes. It must leave out the topics of real supervisors, because a supervisor stays passive
        while it hears another publisher on its topics.
        """
        self.daemons = daemons
        self.journal = journal
        self.places: dict[str, str] = {}
        self.alerts: list[d.Alert] = []
        self.page = ""
        self._parties: list[Party] = []
        self._check = check
        self._patience = patience
        self._transport = transport
        self._inbox: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._publishers: dict[str, Publisher[d.Message]] = {
            topic.name: transport.publisher(topic) for topic in publishes
        }
        self._heard: set[str] = set()
        self._hear(*STATES, topics.CHARGING_ASSIGNMENTS, topics.ALERT)
        for topic in TO_DAEMONS:  # only other nodes: `say` records this side's own messages
            transport.subscribe(topic, self._to_inbox(topic), others_only=True)

    def edge(self, edge: Edge) -> None:
        """Record a plant's edge. Any thread may call `edge`."""
        self._inbox.put(lambda: self.journal.edge(edge))

    def join(self, *parties: Party) -> None:
        """Add participants to RMF's side, such as a supervisor or a fleet."""
        self._parties += parties
        self._hear(*(topic for party in parties for topic in party.subscribes))

    # ---- questions of the demo

    def wall(self) -> float:
        """Return the time of RMF's clock (s since the epoch)."""
        return time.time()

    def listened_to(self, *to: AnyTopic) -> bool:
        """Does a daemon listen to each of these request topics?"""
        return all(self._publishers[topic.name].matched() for topic in to)

    def door_is(self, door: str, mode: d.DoorModeValue) -> bool:
        """Does the door's last state have this mode?"""
        latest = self.journal.latest(door)
        return isinstance(latest, d.DoorState) and latest.current_mode.value == mode

    def charger_is(self, charger: str, state: str, robot: str = "", error: str = "") -> bool:
        """Does the charger's last state have this state and robot, and this text in its error
        message?"""
        latest = self.journal.latest(charger)
        return (
            isinstance(latest, d.ChargerState)
            and words.word(d.ChargerStateValue, latest.state) == state
            and robot in ("", latest.robot_name)
            and error in latest.error_message
        )

    def alerted(self, code: str) -> bool:
        """Has RMF sent a person an alert with this code?"""
        return any(alert.subtitle == code for alert in self.alerts)

    # ---- actions of the demo

    def say(self, said: Iterable[Said]) -> None:
        """Publish these messages. Record messages to a daemon in the journal."""
        for topic, message in said:
            if topic in TO_DAEMONS:
                assert isinstance(message, Requested)
                self.journal.request(message, time.monotonic())
            self._publishers[topic.name].publish(message)

    def press(self, device: str, signal_name: str, on: bool) -> None:
        """Act on a plant as a person does, or as the building does."""
        self.daemons[device].order(f"press {device} {signal_name} {'on' if on else 'off'}")

    def fail(self, device: str, part: str, mode: str) -> None:
        """Let a part of a plant fail. The mode `ok` mends the part."""
        self.daemons[device].order(f"fail {device} {part} {mode}")

    def note(self, text: str, who: str = "") -> None:
        """Add a line about a robot or the demo to the journal."""
        self.journal.note("robot" if who else "demo", text, time.monotonic(), who)

    @contextmanager
    def leg(self, name: str, text: str = "") -> Iterator[None]:
        """Measure the time that a part of the day takes. If `text` is given, announce the part with
        this text."""
        began_at = time.monotonic()
        if text:
            self.note(f"-- {name}: {text}")
        try:
            yield
        except DemoFailed as wrong:
            raise DemoFailed(f"{name}: {wrong}" if text else str(wrong)) from wrong
        self.journal.legs[name] = time.monotonic() - began_at

    def until(
        self, ready: Callable[[], bool], within_s: float, what: str, repeat: Said | None = None
    ) -> None:
        """Wait until `ready()` is true. If `repeat` is given, publish its message now, and then every
        second.

        Raises DemoFailed with the text `what` after `within_s` times the patience.
        """
        within_s *= self._patience
        deadline = time.monotonic() + within_s
        repeat_at = time.monotonic() if repeat else float("inf")
        while not ready():
            if time.monotonic() >= deadline:
                raise DemoFailed(f"waited {within_s:g} s for {what}")
            if repeat and time.monotonic() >= repeat_at:
                repeat_at += 1.0
                self.say([repeat])
            self._turn(LOOK_EVERY_S)

    def shows(self, what: str, ready: Callable[[], bool], within_s: float = 10.0) -> None:
        """Wait until `ready()`, and print `what`. Raises DemoFailed after the time limit."""
        self.until(ready, within_s, what)
        self.note(f"   so: {what}")

    def pause(self, seconds: float) -> None:
        """Let this many seconds pass."""
        over_at = time.monotonic() + seconds
        while (left_s := over_at - time.monotonic()) > 0:
            self._turn(min(LOOK_EVERY_S, left_s))

    # ---- private methods

    def _turn(self, timeout_s: float) -> None:
        self._check()
        for party in self._parties:
            if party.wake_at() <= time.time():
                self.say(party.tick(time.time()))
        try:
            taken = self._inbox.get(timeout=timeout_s)
        except Empty:
            pass
        else:
            taken()
        self.journal.flush(time.monotonic() - SETTLES_S)

    def _take(self, at: float, topic: AnyTopic, message: d.Message) -> None:
        self._journal(at, topic, message)
        for party in self._parties:
            if topic in party.subscribes:
                self.say(party.hear(message, time.time()))

    def _journal(self, at: float, topic: AnyTopic, message: d.Message) -> None:
        if isinstance(message, Stated):
            self.journal.state(message, at)
        elif isinstance(message, Requested) and topic in TO_DAEMONS:
            self.journal.request(message, at)
        elif isinstance(message, d.ChargingAssignments):
            self._sent(message, at)
        elif isinstance(message, d.Alert):
            self.alerts.append(message)
            self.journal.note("alert", f"{message.title}: {message.message}", at)

    def _sent(self, message: d.ChargingAssignments, at: float) -> None:
        for one in message.assignments:
            place = f"{words.plain(d.ChargingMode, one.mode)} at {one.waypoint_name}"
            if self.places.get(one.robot_name) != place:
                self.places[one.robot_name] = place
                self.journal.note("place", place, at, one.robot_name)

    def _hear(self, *heard: AnyTopic) -> None:
        for topic in heard:
            if topic.name not in self._heard:
                self._heard.add(topic.name)
                self._transport.subscribe(topic, self._to_inbox(topic))

    def _to_inbox(self, topic: AnyTopic) -> Callable[[d.Message], None]:
        def put(message: d.Message) -> None:
            at = time.monotonic()
            self._inbox.put(lambda: self._take(at, topic, message))

        return put

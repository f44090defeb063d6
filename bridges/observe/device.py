"""Observation of any kind of device: its states, their pace and age, its requesters and waits."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator
from typing import ClassVar, Generic, NamedTuple, TypeVar

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Sender
from bridges.observe.diagnosis import Diagnosis, report
from bridges.observe.limits import FLAPS_WITHIN_S, MOST_NODES, OLD_S, SILENT_S
from bridges.observe.news import News
from bridges.observe.publishers import StatePublishers
from bridges.observe.requesters import DeviceRequester, DeviceRequesters, Fact, Moment

T = TypeVar("T", d.LiftState, d.DoorState, d.ChargerState, d.DispenserState)


class Check(NamedTuple):
    """One condition of an RMF phase: the value that is shown, and the value that RMF wants."""

    name: str
    shown: str
    wanted: str
    met: bool


class Wait(NamedTuple):
    """A requester's wait for a floor, for OPEN or for CHARGING."""

    who: str
    wants: str
    since: Moment


def reading_age(stamped_at: float, wall: float) -> str:
    """Return the fault in a reading's age, such as `is old`; "" if there is none."""
    if stamped_at <= 0.0:
        return "was never read"
    if wall - stamped_at > OLD_S:
        return "is old"
    return "is from the future" if wall - stamped_at < -OLD_S else ""


class ObservedDevice(ABC, Generic[T]):
    """One device, as we heard it. `id`: its name on the graph. `began`: the time of its first message.

    `state`, `before`: the two latest states; `gap_s` is the time between them. `first_state`,
    `last_state`: the times of the first and the latest state. `changed`: the facts that the latest
    state changed, with their earlier values. `diagnoses`: the reports of our nodes on the device, by
    `<node>: <device>`.
    """

    kind: ClassVar[words.Kind]

    def __init__(self, name: str, began: Moment) -> None:
        self.id = name
        self.began = began
        self.requesters = DeviceRequesters(began)
        self.state: T | None = None
        self.before: T | None = None
        self.first_state: Moment | None = None
        self.last_state: Moment | None = None
        self.gap_s = 0.0
        self.stamped_at = self.stamp_age_s = 0.0
        self.reading = Fact("", began)
        self.changed: dict[str, str] = {}
        self.diagnoses: dict[str, Diagnosis] = {}
        self._publishers = StatePublishers()
        self._back: deque[tuple[float, float]] = deque(maxlen=8)
        self._flips: deque[tuple[float, float]] = deque(maxlen=100)

    def published_by(self, sender: Sender | None, now: Moment) -> None:
        """Note the publisher of a state."""
        self._publishers.hear(sender, now.at)

    def publishers(self, now: Moment) -> tuple[Sender, ...]:
        """Return the publishers of the device's states in the last 5 s. There are several only if they
        take turns, which two nodes under one name do. The result is empty if the publisher is
        unknown, as in recordings and on `ros2`; then use `steps_back`."""
        return self._publishers.at(now.at)

    def hear(self, moment: Moment, topic: str, message: d.Message) -> list[News]:
        """Take a message about the device. `topic`: the last part of the topic's name."""
        if isinstance(message, words.Stated):
            return [*self._hear_state(moment, message)]  # type: ignore[arg-type]
        return [*self._hear_other(moment, topic, message)]

    def diagnose(self, moment: Moment, status: d.DiagnosticStatus) -> list[News]:
        """Take a diagnostic status about the device from one of our nodes."""
        seen = status.name in self.diagnoses or moment.at - self.began.at > SILENT_S
        moment = Moment(moment.at, moment.wall, seen)
        said = report(self.diagnoses, MOST_NODES, status, moment)
        if said is None:
            return []
        return list(said.take(moment, status, self.text, self.sentence))

    def text(self, name: str) -> str:
        """Return a name from the network in the form in which we remember it. `explain` remembers a
        printable form."""
        return name

    def sentence(self, text: str) -> str:
        """Return a sentence from the network in the form in which we remember it. `explain` remembers a
        bounded form."""
        return text

    def is_silent(self, now: Moment, after_s: float = SILENT_S) -> bool:
        """Return whether the device's states have stopped. Before the first state the answer is
        False."""
        return self.silent_s(now) > after_s

    def silent_s(self, now: Moment) -> float:
        """Return the age (s) of the device's last state."""
        return 0.0 if self.last_state is None else now.at - self.last_state.at

    def steps_back(self, now: float, by_s: float, within_s: float) -> int:
        """Count how often the stamps lately stepped back by more than `by_s`. Two nodes under one name
        cause such steps."""
        return sum(by > by_s and now - at < within_s for at, by in self._back)

    def flaps(self, now: Moment) -> list[float]:
        """Return, for each recent change to OFFLINE or back, the age (s) of the reading at that
        time."""
        return [age_s for at, age_s in self._flips if now.at - at < FLAPS_WITHIN_S]

    def checks(self, one: DeviceRequester) -> tuple[Check, ...]:
        """List the conditions of the RMF phase in which this requester is; empty if RMF has no such
        phase."""
        return ()

    def matches(self, one: DeviceRequester) -> bool:
        """Return whether RMF sees this requester's wish fulfilled."""
        return all(check.met for check in self.checks(one))

    @abstractmethod
    def waits(self, now: Moment) -> Iterator[Wait]:
        """Yield each requester that waits, with its wish and the start of its wait."""

    @abstractmethod
    def facts(self, state: T) -> dict[str, str]:
        """Return the facts in a state, by the names of this object's `Fact`s."""

    @abstractmethod
    def _settle(self, moment: Moment) -> Iterator[News]:
        """Yield the news of a new state. `changed` is already up to date. At the first state `before`
        is None."""

    @abstractmethod
    def _hear_other(self, moment: Moment, topic: str, message: d.Message) -> Iterator[News]:
        """Take a message that is not a state."""

    def _hear_state(self, moment: Moment, state: T) -> Iterator[News]:
        last, stamped_at = self.last_state, words.stamped_at(state)
        if last is None:
            near = moment.at - self.began.at <= SILENT_S
            self.first_state = moment = Moment(moment.at, moment.wall, seen=not near)
            if moment.seen:
                yield News("first state", moment)
        else:
            self.gap_s = moment.at - last.at
            if self.gap_s > SILENT_S:
                yield News("states again", moment, gap_s=self.gap_s)
        if (back_s := self.stamped_at - stamped_at) > 0.0:
            self._back.append((moment.at, back_s))
        self.before, self.state, self.last_state = self.state, state, moment
        self.stamped_at, self.stamp_age_s = stamped_at, moment.wall - stamped_at
        if self.reading.say(reading_age(stamped_at, moment.wall), moment):
            yield News("read", moment, text=self.reading.value)
        self.changed = {}
        for name, value in self.facts(state).items():
            fact: Fact = getattr(self, name)
            before = fact.value
            if fact.say(value, moment):
                self.changed[name] = before
                if name == "mode" and before and "OFFLINE" in (before.upper(), value.upper()):
                    self._flips.append((moment.at, self.stamp_age_s))
        yield from self._settle(moment)

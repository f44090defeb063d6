"""Observation of a device of any kind: the rate and the age of its states, its requesters, and its
waits."""

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
    """One condition of an RMF phase. `shown`: the present value. `wanted`: the value for which RMF
    waits."""

    name: str
    shown: str
    wanted: str
    met: bool


class Wait(NamedTuple):
    """A wait of a requester. `wants`: a floor, OPEN or CHARGING."""

    who: str
    wants: str
    since: Moment


def reading_age(stamped_at: float, wall: float) -> str:
    """Return a problem with the age of a reading, such as `is old`. Return "" if the reading is
    recent."""
    if stamped_at <= 0.0:
        return "was never read"
    if wall - stamped_at > OLD_S:
        return "is old"
    return "is from the future" if wall - stamped_at < -OLD_S else ""


class ObservedDevice(ABC, Generic[T]):
    """One device, as observed. `id`: its name in RMF. `began`: the time when observation began.

    - `state`, `before`: the latest state, and the state before it. `gap_s`: the time (s) between these
      states.
    - `first_state`, `last_state`: the time of the first state, and the time of the latest state
    - `changed`: the earlier values of the facts that the latest state changed
    - `diagnoses`: the reports of our nodes on the device. The key is `<node>: <device>`.
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
        self.stamped_at = self.stamp_age_s = self._last_read = 0.0
        self.reading = Fact("", began)
        self.changed: dict[str, str] = {}
        self.diagnoses: dict[str, Diagnosis] = {}
        self._publishers = StatePublishers()
        self._back: deque[tuple[float, float]] = deque(maxlen=8)
        self._flips: deque[tuple[float, float]] = deque(maxlen=100)

    @property
    def said(self) -> list[Diagnosis]:
        """Our nodes' reports on the device that belong to its last state. So a silent device keeps its
        faults, and stays simulated."""
        last = self.last_state
        return [one for one in self.diagnoses.values() if last and one.is_current(last.at)]

    def published_by(self, sender: Sender | None, now: Moment) -> None:
        """Note the publisher of a state."""
        self._publishers.hear(sender, now.at)

    def publishers(self, now: Moment) -> tuple[Sender, ...]:
        """Return the publishers of the device's states in the last SLOWEST_S.

        More than one publisher is returned only if the publishers alternate. In that case two nodes
        publish under the name of one device. The result is empty if the publisher is unknown, as in
        recordings and on `ros2`. Then use `steps_back` instead.
        """
        return self._publishers.at(now.at)

    def hear(self, moment: Moment, topic: str, message: d.Message) -> list[News]:
        """Take a message about the device. Return the news. `topic`: the last part of the topic's
        name."""
        if isinstance(message, words.Stated):
            return [*self._hear_state(moment, message)]  # type: ignore[arg-type]
        return [*self._hear_other(moment, topic, message)]

    def diagnose(self, moment: Moment, status: d.DiagnosticStatus) -> list[News]:
        """Take a diagnostic status from one of our nodes about the device. Return the news."""
        seen = status.name in self.diagnoses or moment.at - self.began.at > SILENT_S
        moment = Moment(moment.at, moment.wall, seen)
        said = report(self.diagnoses, MOST_NODES, status, moment)
        if said is None:
            return []
        return list(said.take(moment, status, self.text, self.sentence))

    def text(self, name: str) -> str:
        """Return a name from the network in the form that is kept in memory. `explain` overrides this
        method and makes the name printable."""
        return name

    def sentence(self, text: str) -> str:
        """Return a sentence from the network in the form that is kept in memory. `explain` overrides
        this method and shortens the sentence."""
        return text

    def is_silent(self, now: Moment, after_s: float = SILENT_S) -> bool:
        """Return whether the device's states have stopped. Return False before the first state."""
        return self.silent_s(now) > after_s

    def silent_s(self, now: Moment) -> float:
        """Return the age (s) of the device's last state. Return 0 before the first state."""
        return 0.0 if self.last_state is None else now.at - self.last_state.at

    def steps_back(self, now: float, by_s: float, within_s: float) -> int:
        """Count how often a stamp was older than the stamp before it by more than `by_s`, within the
        last `within_s`. Two nodes under one name cause such stamps."""
        return sum(by > by_s and now - at < within_s for at, by in self._back)

    def flaps(self, now: Moment) -> list[float]:
        """Return the age (s) of the reading at each recent change to or from OFFLINE."""
        return [age_s for at, age_s in self._flips if now.at - at < FLAPS_WITHIN_S]

    def checks(self, one: DeviceRequester) -> tuple[Check, ...]:
        """List the conditions of the requester's present RMF phase. Return nothing for a device without
        such a phase."""
        return ()

    def matches(self, one: DeviceRequester) -> bool:
        """Return whether RMF sees the requester's wish as fulfilled."""
        return all(check.met for check in self.checks(one))

    @abstractmethod
    def waits(self, now: Moment) -> Iterator[Wait]:
        """Yield a `Wait` for each requester that waits."""

    @abstractmethod
    def facts(self, state: T) -> dict[str, str]:
        """Return the facts in a state by name. Each name is an attribute of this object that holds a
        `Fact`."""

    @abstractmethod
    def _settle(self, moment: Moment) -> Iterator[News]:
        """Take a new state, and yield its news (changes to report). The caller has already set
        `changed` to the facts that this state changes. `before` is the previous state. At the first
        state `before` is None."""

    @abstractmethod
    def _hear_other(self, moment: Moment, topic: str, message: d.Message) -> Iterator[News]:
        """Take a message that is not a state. Yield the news."""

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
        if stamped_at > 0.0:  # a stamp of 0 says that nothing was read
            if (back_s := self._last_read - stamped_at) > 0.0:
                self._back.append((moment.at, back_s))
            self._last_read = stamped_at
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

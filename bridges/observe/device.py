"""What is remembered of every kind of device: its states, their pace and age, who asks, who waits."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator
from typing import ClassVar, Generic, NamedTuple, TypeVar

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.observe.diagnosis import Diagnosis, report
from bridges.observe.limits import MOST_NODES, OLD_S, SILENT_S
from bridges.observe.news import News
from bridges.observe.requesters import DeviceRequester, DeviceRequesters, Fact, Moment

T = TypeVar("T", d.LiftState, d.DoorState, d.ChargerState)


class Check(NamedTuple):
    """One of the things that a phase of RMF waits for: what is shown, and what is wanted."""

    name: str
    shown: str
    wanted: str
    met: bool


class Wait(NamedTuple):
    """Somebody waits for something: a floor, OPEN, CHARGING."""

    who: str
    wants: str
    since: Moment


def reading_age(stamped_at: float, wall: float) -> str:
    """What is wrong with the age of a state's reading, such as `is old`; "" if nothing is."""
    if stamped_at <= 0.0:
        return "was never read"
    if wall - stamped_at > OLD_S:
        return "is old"
    return "is from the future" if wall - stamped_at < -OLD_S else ""


class ObservedDevice(ABC, Generic[T]):
    """One device as it was heard. `id`: its name on the graph. `began`: when anything was heard first.

    `state`, `before`: the two latest states; `gap_s` lies between them. `first_state`, `last_state`:
    when the first and the latest came. `changed`: fact -> its value before the latest state.
    `diagnoses`: what nodes of ours say of it, by `<node>: <device>`.
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
        self._back: deque[tuple[float, float]] = deque(maxlen=8)

    def hear(self, moment: Moment, topic: str, message: d.Message) -> list[News]:
        """Take a message about it. `topic`: its last part."""
        if isinstance(message, words.Stated):
            return [*self._hear_state(moment, message)]  # type: ignore[arg-type]
        return [*self._hear_other(moment, topic, message)]

    def diagnose(self, moment: Moment, status: d.DiagnosticStatus) -> list[News]:
        """Take a status about it, of a node of ours."""
        seen = status.name in self.diagnoses or moment.at - self.began.at > SILENT_S
        moment = Moment(moment.at, moment.wall, seen)
        said = report(self.diagnoses, MOST_NODES, status, moment)
        if said is None:
            return []
        return list(said.take(moment, status, self.text))

    def text(self, name: str) -> str:
        """A name from the network as it is remembered; `explain` keeps what can be shown."""
        return name

    def is_silent(self, now: Moment, after_s: float = SILENT_S) -> bool:
        """Have its states stopped? False before the first one."""
        return self.silent_s(now) > after_s

    def silent_s(self, now: Moment) -> float:
        """How long ago its last state came (s)."""
        return 0.0 if self.last_state is None else now.at - self.last_state.at

    def steps_back(self, now: float, by_s: float, within_s: float) -> int:
        """How often the stamps went back by more than this lately, as those of two nodes do."""
        return sum(by > by_s and now - at < within_s for at, by in self._back)

    def checks(self, one: DeviceRequester) -> tuple[Check, ...]:
        """What RMF's phase of this requester looks at; nothing where RMF has none."""
        return ()

    def matches(self, one: DeviceRequester) -> bool:
        """Does RMF see what this requester waits for?"""
        return all(check.met for check in self.checks(one))

    @abstractmethod
    def waits(self, now: Moment) -> Iterator[Wait]:
        """Who waits, for what, since when."""

    @abstractmethod
    def facts(self, state: T) -> dict[str, str]:
        """What a state shows, by the names of our `Fact`s."""

    @abstractmethod
    def _settle(self, moment: Moment) -> Iterator[News]:
        """What the new state means; `changed` is set, and `before` is None at the first one."""

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
        yield from self._settle(moment)

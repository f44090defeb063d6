"""What is remembered of one device while its messages are heard; bounded, however many come.

A scene takes messages and decides nothing; laws read it. This file has what all three kinds share:
the pace of states, their stamps, and what followed a request.
"""

from abc import ABC, abstractmethod
from collections import deque
from typing import ClassVar, Final, Generic, TypeVar

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard

SILENT_S: Final = 5.0
"""The slowest pace in the contract is a state every 2 s; after this long two are missing."""
REMEMBERED: Final = 200
"""How many requesters a scene remembers; a site has some dozens."""
BURST: Final = 20
FROZEN_S: Final = 0.05
ANSWERS_WITHIN_S: Final = 0.1
EARLY_S: Final = 0.15
"""A state this early (s) cannot be explained by a timer's jitter."""

NOT_YET: Final = float("-inf")

T = TypeVar("T", d.LiftState, d.DoorState, d.ChargerState)
V = TypeVar("V")


def keep(known: dict[str, V], key: str, value: V) -> None:
    """Put it last, and forget the oldest if there are too many."""
    known.pop(key, None)
    known[key] = value
    if len(known) > REMEMBERED:
        del known[next(iter(known))]


class Scene(ABC, Generic[T]):
    """One device. Times are those of what was heard (s).

    `news`: the message taken last, None when only time has passed. `state`, `before`: the two latest
    states; `before` is None at the first one, and after a silence, because the node may have
    restarted. `since`: when that was. `gap_s`: from one to the other. `frozen_s`: for how long the
    states have shown the same stamp. `burst_s`: how long the latest BURST unchanged states took.
    `back`: when stamps went backwards.
    """

    kind: ClassVar[type[words.Stated]]

    def __init__(self, name: str) -> None:
        self.name = name
        self.now = self.since = self.heard_at = NOT_YET
        self.news: d.Message | None = None
        self.state: T | None = None
        self.before: T | None = None
        self.gap_s = 0.0
        self.frozen_s = 0.0
        self.burst_s = float("inf")
        self.states = 0
        self.back: deque[float] = deque(maxlen=4)
        self.others: set[str] = set()
        self._unchanged: deque[float] = deque(maxlen=BURST)
        self._stamp = self._moved_at = NOT_YET
        self._asked_at = NOT_YET
        self._answers: deque[bool] = deque(maxlen=8)
        self._quiet: deque[float] = deque(maxlen=15)

    def take(self, heard: Heard) -> bool:
        """Take a message. False if no law needs to look, because it is not about this device."""
        self.now, self.news = heard.at, heard.message
        if isinstance(heard.message, self.kind):
            return self._take_state(heard.message)  # type: ignore[arg-type]
        return self.take_other(heard)

    def pass_time(self, now: float) -> None:
        """Note that time has passed and nothing was heard."""
        self.now, self.news = now, None

    @abstractmethod
    def take_other(self, heard: Heard) -> bool:
        """Take a message that is not a state."""

    @abstractmethod
    def settle(self, state: T) -> None:
        """Note what the new state means; `before` and `state` are set."""

    def forget(self) -> None:
        """Forget what a silence may have ended."""

    def asked(self) -> None:
        """Note a request to this device."""
        self._asked_at = self.now

    @property
    def new(self) -> T | None:
        """The state, if it is the latest message."""
        return self.state if self.news is self.state else None

    @property
    def answers(self) -> int:
        """How many of the latest 8 requests were each answered by a state that was not due."""
        return sum(self._answers)

    def _take_state(self, state: T) -> bool:
        if words.device(state) != self.name:
            if len(self.others) < REMEMBERED:
                self.others.add(words.device(state))
            return False
        self.states += 1
        self.gap_s = self.now - self.heard_at
        self.before = self.state
        if self.state is None or self.gap_s > SILENT_S:
            self.before, self.since = None, self.now
            self.forget()
        self.state = state
        self._look_at_stamp(words.stamped_at(state))
        self._look_at_pace(state)
        self.heard_at = self.now
        self.settle(state)
        return True

    def _look_at_stamp(self, stamp: float) -> None:
        if stamp < self._stamp - 0.5:
            self.back.append(self.now)
        if abs(stamp - self._stamp) > FROZEN_S or self.before is None:
            self._stamp, self._moved_at = stamp, self.now
        self.frozen_s = self.now - self._moved_at

    def _look_at_pace(self, state: T) -> None:
        """Note the pace of unchanged states: they are due at the node's own rate, never at a
        request."""
        if self.before is None or _content(state) != _content(self.before):
            return
        self._unchanged.append(self.now)
        if len(self._unchanged) == BURST:
            self.burst_s = self.now - self._unchanged[0]
        if self._asked_at <= self.heard_at:
            self._quiet.append(self.gap_s)
        elif self._quiet:
            at_once = self.now - self._asked_at < ANSWERS_WITHIN_S
            usual_s = sorted(self._quiet)[len(self._quiet) * 3 // 4]
            early = at_once and self.gap_s < usual_s - EARLY_S
            self._answers.append(early)


def _content(state: words.Stated) -> words.Stated:
    """All but the stamp."""
    match state:
        case d.LiftState():
            return replace(state, lift_time=d.Time())
        case d.DoorState():
            return replace(state, door_time=d.Time())
        case d.ChargerState():
            return replace(state, charger_time=d.Time())

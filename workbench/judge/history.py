"""The history of one device, from its messages. The memory of a history is limited.

A history takes messages and decides nothing. Laws read the history. This file has the part that all
kinds share: messages, the pace and stamps of states, and the answers to requests.
"""

from abc import ABC, abstractmethod
from collections import deque
from itertools import pairwise
from typing import Any, ClassVar, Final, Generic, TypeVar

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard, Sender
from bridges.observe.all_devices import AnyDevice
from bridges.observe.limits import SLOWEST_S
from bridges.observe.requesters import Moment

REMEMBERED: Final = 200
"""Maximum number of requesters in a history. A site has some dozens of requesters."""
BURST: Final = 20
FROZEN_S: Final = 0.05
ANSWERS_WITHIN_S: Final = 0.1
OFTEN_S: Final = 30.0
EARLY_S: Final = 0.15
"""Limit (s) for a timer's jitter. If a state comes early by more than this time, the jitter is not the
cause."""
PAUSE_S: Final = 2.0
PAUSE: Final = 1.4
"""Limit for a pause, as a multiple of the usual gap between states. A longer pause may be a restart, if
it also lasts PAUSE_S."""
KNOWN: Final = 3
RHYTHM: Final = 10
TURNS: Final = 4
"""Number of times within OFTEN_S that the publisher of the states changes. A restart of one node cannot
explain so many changes."""
STEADY_S: Final = 0.05
UNEVEN_S: Final = 0.1
CROSSED_S: Final = 1.0
"""Time (s) from a request until a state must show the request's effect. After this time without a
change, the request has had no effect."""
TESTED_S: Final = 5.0
SILENCES: Final = 5

NOT_YET: Final = float("-inf")
StatedOrRequested = words.Stated | words.Requested

T = TypeVar("T", d.LiftState, d.DoorState, d.ChargerState, d.DispenserState)
V = TypeVar("V")


def keep(known: dict[str, V], key: str, value: V, most: int = REMEMBERED) -> None:
    """Put an entry at the end of `known`. If there are more than `most` entries, forget the oldest
    entry."""
    known.pop(key, None)
    known[key] = value
    if len(known) > most:
        del known[next(iter(known))]


class AnyHistory(ABC):
    """The part that all histories share. Times are the messages' times (s).

    - `news`: the latest message; None if only time has passed.
    - `own`: whether the judge sent the latest message.
    - `states`: number of states; for an adapter, number of its requests.
    - `senders`: the publishers on the topic of the states; empty for a recording.
    - `others`: names of other devices of the same kind.
    - `network_s`: how long (s) the whole network was silent after the previous state. A silence counts
      only if another device was heard shortly before it.
    - `silences`: the first SILENCES silences of the network that lasted longer than SLOWEST_S. Each has
      its beginning (wall clock) and its length (s).
    - `burst_s`: duration (s) of the latest BURST unchanged states.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.now = NOT_YET
        self.news: d.Message | None = None
        self.own = False
        self.states = 0
        self.senders: tuple[str, ...] = ()
        self.others: set[str] = set()
        self.network_s = 0.0
        self.silences: list[tuple[float, float]] = []
        self.burst_s = float("inf")
        self._any_at = self._other_at = NOT_YET

    @abstractmethod
    def take(self, heard: Heard, own: bool = False) -> bool:
        """Take a message. `own` tells whether the judge sent the message. Return whether the laws have
        to be checked now."""

    @property
    def state(self) -> words.Stated | None:
        """The latest state, if the history is about a device."""
        return None

    @abstractmethod
    def checked(self) -> None:
        """Forget what lasts only until the next check, because the laws have checked the latest
        message."""

    def often(self, times: deque[float]) -> bool:
        """Return whether `times` is full, and all its times are within OFTEN_S."""
        return len(times) == times.maxlen and self.now - times[0] < OFTEN_S

    def pass_time(self, now: float, wall: float) -> None:
        """Note that time has passed without a message."""
        self.now, self.news = now, None
        self._end_silence(now, wall)
        self._any_at = now

    def _begin(self, heard: Heard, own: bool) -> None:
        """Note a message's time."""
        self.now, self.news, self.own = heard.at, heard.message, own
        if not own:
            self._end_silence(heard.at, heard.wall)
            self._any_at = heard.at

    def _end_silence(self, now: float, wall: float) -> None:
        """If the whole network was silent until now, add the silence to `network_s` and `silences`. A
        silence counts only if other devices were heard shortly before it."""
        silent_s = now - self._any_at
        if silent_s > PAUSE_S and self._any_at - self._other_at <= SLOWEST_S:
            self.network_s += silent_s - PAUSE_S  # a healthy network may pause for PAUSE_S
            if silent_s > SLOWEST_S:
                self.silences = [*self.silences, (wall - silent_s, silent_s)][:SILENCES]


class History(AnyHistory, Generic[T]):
    """The history of one device.

    - `seen`: the device's observations.
    - `before`: the state before the latest state. None at the first state and after a pause, because
      the node may have restarted.
    - `since`: the time at which `before` was last None.
    - `frozen_s`: how long (s) the states have shown the same stamp.
    - `claimed_s`: for how long (s) a robot would have acted on every state (see `claims`).
    - `asked_last`: time of the latest request.
    - `turns`: times at which a state came from another publisher than the state before.
    """

    observes: ClassVar[type[AnyDevice]]

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.seen: AnyDevice = self.observes(name, Moment(0.0, 0.0))
        self.since = NOT_YET
        self.before: T | None = None
        self.frozen_s = self.claimed_s = 0.0
        self._unchanged: deque[float] = deque(maxlen=BURST)
        self._stamp = self._moved_at = self._claims_since = NOT_YET
        self.asked_last = self._quiet_since = NOT_YET
        self._answers: deque[tuple[bool, float]] = deque(maxlen=8)
        self._quiet: deque[float] = deque(maxlen=15)
        self._usual_s = self._catches_up_s = 0.0
        self._gaps: deque[float] = deque(maxlen=RHYTHM)
        self._sender: Sender | None = None
        self.turns: deque[float] = deque(maxlen=TURNS)

    def take(self, heard: Heard, own: bool = False) -> bool:
        """Take a message. `own` tells whether the judge sent the message. Return False if no check is
        needed, for example after a message about another device."""
        self._begin(heard, own)
        message = heard.message
        if not isinstance(message, StatedOrRequested):
            return self.take_other(heard)
        kind, name = words.kind(message), words.device(message)
        if kind == self.seen.kind and name == self.name:
            earlier = self.heard_at
            self.seen.hear(Moment(heard.at, heard.wall), heard.topic, message)
            if isinstance(message, words.Stated):
                self._published_by(heard)
                return self._take_state(message, earlier)  # type: ignore[arg-type]
        elif isinstance(message, words.Stated):
            self._other_at = self.now
            if kind == self.seen.kind and len(self.others) < REMEMBERED:
                self.others.add(name)
            return False
        return self.take_other(heard)

    def _published_by(self, heard: Heard) -> None:
        """Note the state's publisher. If another publisher sent the state before, and both still
        publish, note the time in `turns`."""
        moment, before = Moment(heard.at, heard.wall), self._sender
        self.seen.published_by(heard.sender, moment)
        self._sender = heard.sender
        if before is not self._sender and len(self.seen.publishers(moment)) > 1:
            self.turns.append(heard.at)

    @property
    def publisher(self) -> str:
        """The node that publishes the device's states; "" if nobody knows. The topic's only publisher
        publishes this device too."""
        if self._sender is not None:
            return self._sender.node
        return self.senders[0] if len(self.senders) == 1 else ""

    @abstractmethod
    def take_other(self, heard: Heard) -> bool:
        """Take a message that is not a state."""

    @abstractmethod
    def settle(self, state: T) -> None:
        """Note what a history of this kind of device needs from the new state. `before` and `state`
        already have their new values."""

    @staticmethod
    @abstractmethod
    def claims(state: Any) -> bool:
        """Return whether the state claims something on which a robot would act."""

    def forget(self) -> None:
        """Forget requests after a pause, because the node may have restarted."""

    def asked(self) -> None:
        """Note a request to this device."""
        self.asked_last = self.now

    @property
    def state(self) -> T | None:
        """The latest state."""
        return self.seen.state

    @property
    def heard_at(self) -> float:
        """Time (s) of the latest state."""
        return self.seen.last_state.at if self.seen.last_state else NOT_YET

    @property
    def new(self) -> T | None:
        """The latest state, if it is the latest message. Otherwise None."""
        return self.state if self.news is self.state else None

    @property
    def tested(self) -> int:
        """Number of requests, out of the latest 8, that an unchanged state has followed."""
        return len(self._answers)

    @property
    def answers(self) -> int:
        """Number of requests, out of the latest 8, that a state has followed immediately, although no
        state was due.

        A loaded machine sends messages in bunches, but sends no more states than usual. Therefore the
        result is 0 if states come at the usual pace.
        """
        pace_s = sum(gap_s for _, gap_s in self._answers) / max(1, self.tested)
        return sum(early for early, _ in self._answers) if pace_s < self._early_s else 0

    @property
    def has_rhythm(self) -> bool:
        """Return whether enough states have come to judge their pace and to find their publishers."""
        return len(self._gaps) == RHYTHM

    @property
    def two_rhythms(self) -> bool:
        """Return whether long and short gaps alternate. All long gaps must have one length, and all
        short gaps another length."""
        gaps = [*self._gaps]
        steady = all(abs(b - a) < STEADY_S for a, b in zip(gaps, gaps[2:], strict=False))
        uneven = all(abs(b - a) > UNEVEN_S for a, b in pairwise(gaps))
        return self.has_rhythm and steady and uneven

    def was_tested(self, at: float) -> bool:
        """Return whether a request at time `at` was recent, and later states have had time to show its
        effect."""
        return CROSSED_S < self.now - at < TESTED_S

    @property
    def _early_s(self) -> float:
        return self._usual_s - EARLY_S

    def _take_state(self, state: T, earlier: float) -> bool:
        """Take the new state. `earlier` is the time (s) of the previous state."""
        self.states += 1
        self.before = self.seen.before
        if self.before is None or self._paused(words.stamped_at(self.before)):
            self.before, self.since, self.burst_s = None, self.now, float("inf")
            self._unchanged.clear()
            self.forget()
        self._look_at_stamp(self.seen.stamped_at)
        self._look_at_pace(state, earlier)
        self.settle(state)
        return True

    def checked(self) -> None:
        """Forget the network's silence, because the laws have checked the gap before this state."""
        if self.new is not None:
            self.network_s = 0.0

    def _paused(self, stamped_before: float) -> bool:
        """Return whether there was a pause that is long enough for a restart.

        After a pause, a network may deliver several delayed states together. For all these states the
        result is True.
        """
        gap_s, step_s = self.seen.gap_s, self.seen.stamped_at - stamped_before
        known = len(self._quiet) >= KNOWN
        if gap_s > (max(PAUSE_S, PAUSE * self._usual_s) if known else SLOWEST_S):
            self._catches_up_s = gap_s
            return True
        self._catches_up_s -= step_s - gap_s
        if self._catches_up_s <= 0.0 or step_s < gap_s + FROZEN_S:
            self._catches_up_s = 0.0
        return self._catches_up_s > 0.0

    def _look_at_stamp(self, stamp: float) -> None:
        if abs(stamp - self._stamp) > FROZEN_S or self.before is None:
            self._stamp, self._moved_at = stamp, self.now
        self.frozen_s = self.now - self._moved_at
        if self.before is None or not self.claims(self.before):
            self._claims_since = self.now
        self.claimed_s = self.now - self._claims_since

    def _look_at_pace(self, state: T, earlier: float) -> None:
        """Note how fast unchanged states come. A correct node sends unchanged states at its own rate,
        and never as the answer to a request."""
        self._gaps.append(self.seen.gap_s)
        quiet_since, self._quiet_since = self._quiet_since, earlier
        if self.before is None or _content(state) != _content(self.before):
            return
        self._unchanged.append(self.now)
        if len(self._unchanged) == BURST:
            self.burst_s = self.now - self._unchanged[0]
        if self.asked_last < quiet_since:
            self._quiet.append(self.seen.gap_s)
            self._usual_s = sorted(self._quiet)[len(self._quiet) // 4]
        elif self.asked_last >= earlier and self._quiet:
            at_once = self.now - self.asked_last < ANSWERS_WITHIN_S
            early = at_once and self.seen.gap_s < self._early_s
            self._answers.append((early, self.seen.gap_s))


def _content(state: words.Stated) -> words.Stated:
    """Return the state without its stamp."""
    kind = words.kind(state)
    stamp = "time" if kind in ("dispenser", "ingestor") else f"{kind}_time"
    return replace(state, **{stamp: d.Time()})

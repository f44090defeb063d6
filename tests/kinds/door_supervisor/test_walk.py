"""Tests of the door supervisor's rules in all histories up to a depth, and in random histories. The
tests judge the messages without the core's code.

The first walk has all 4^7 = 16384 histories of seven steps, 0.75 s apart. In these histories each of
two requesters sends OPEN or CLOSE, and the stamps are in order. The second walk has all 6^5 = 7776
histories of five steps: late requests, states of the door, and changes of the permission to publish.

`make test` shortens the histories to five steps in the first walk, and to four in the second walk.
"""

from collections.abc import Callable
from copy import copy
from itertools import product
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.kinds.door_supervisor import core, keep
from bridges.kinds.door_supervisor.memory import OPEN, DoorSupervisorLimits, SupervisedDoor
from bridges.kinds.door_supervisor.settings import DoorSupervisorSettings
from bridges.kinds.door_supervisor.signals import DoorStateHeard, RequesterCloses, RequesterOpens
from bridges.kinds.shared.durations import GAP_S, REPEAT_S
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.definitions import DoorModeValue, DoorRequest
from tests.depth import depth, examples
from tests.walk import histories

LIMITS = DoorSupervisorLimits(open_alarm_s=30.0)
CLOCK_AHEAD = 1000
STEP_S = 0.75


class Ledger:
    """The core, and a table of holders that the test keeps by RMF's rules, from requests in order.

    The test compares the core's table with its own table, and checks each message of the core.
    """

    def __init__(self, *, speaks: bool) -> None:
        self.memory: SupervisedDoor = core.initial("ward", 0.0)
        self.holders: set[str] = set()
        self.newest: dict[str, int] = {}
        self.speaks = False
        self.begins = True
        self.now = 0.0
        self.wake_at = 0.0
        self.sent: list[tuple[float, int]] = []
        self.hears(MaySpeak(speaks))

    def copy(self) -> "Ledger":
        """Return a copy, so that several histories can begin with the same steps."""
        made = copy(self)
        made.holders, made.newest, made.sent = set(self.holders), dict(self.newest), [*self.sent]
        return made

    def hears(self, event: Any) -> None:
        self._note(event)
        decided = core.decide(self.memory, event, self.now, LIMITS)
        self.memory, self.wake_at = decided.memory, decided.wake_at
        assert {h.requester for h in self.memory.holders} == self.holders
        assert self.wake_at > self.now
        for _, message in decided.publish:
            assert isinstance(message, DoorRequest)
            self._check(message.requested_mode.value)
        late = [h.requester for h in self.memory.holders if self.now >= h.since + 30.0]
        codes = [fault.code for fault in decided.report.faults]
        assert ("DOOR_HELD_OPEN" in codes) == bool(late)
        assert bool(decided.report.waits) == (bool(self.holders) and not self.speaks)
        # A new holder's OPEN must reach the door's node soon. So either OPEN was the last message, or
        # the core wants to be woken within GAP_S.
        if self.speaks and self.holders:
            assert self.memory.sent == OPEN or self.wake_at <= self.now + GAP_S

    def until(self, at: float) -> None:
        while self.wake_at <= at:
            self.now = self.wake_at
            self.hears(Woken())
        self.now = at

    def _note(self, event: Any) -> None:
        match event:
            case RequesterOpens(who, stamp) if stamp >= self.newest.get(who, 0):
                self.newest[who] = stamp
                self.holders.add(who)
            case RequesterCloses(who, stamp) if stamp >= self.newest.get(who, 0):
                self.newest[who] = stamp
                self.holders.discard(who)
            case MaySpeak(yes):
                self.speaks, self.begins = yes, True

    def _check(self, word: int) -> None:
        assert self.speaks
        assert word == (DoorModeValue.MODE_OPEN if self.holders else DoorModeValue.MODE_CLOSED)
        if self.sent:
            at, before = self.sent[-1]
            assert self.now >= at + GAP_S
            assert self.now >= at + REPEAT_S or word != before or self.begins
        self.sent.append((self.now, word))
        self.begins = False


def stamp(now: float, aged: float = 0.0) -> int:
    return int((CLOCK_AHEAD + now - aged) * 1e9)


def after(ledger: Ledger, event: Callable[[float], Any]) -> Ledger:
    """Return a copy of the ledger after this event and after STEP_S more seconds."""
    ledger = ledger.copy()
    ledger.hears(event(ledger.now))
    ledger.until(ledger.now + STEP_S)
    return ledger


def asked(ledger: Ledger, move: tuple[Any, str]) -> Ledger:
    """Return a copy of the ledger after this requester's OPEN or CLOSE, and after STEP_S more
    seconds."""
    word, who = move
    return after(ledger, lambda now: word(who, stamp(now)))


def test_every_history_of_two_requesters_keeps_the_rules() -> None:
    words = list(product((RequesterOpens, RequesterCloses), "ab"))
    for ledger, history in histories(Ledger(speaks=True), words, depth(5, 7), asked):
        ledger.until(6.0)
        last = {who: word for word, who in history}
        held = RequesterOpens in last.values()
        words_sent = [word for _, word in ledger.sent]
        opened = any(word is RequesterOpens for word, _ in history)
        assert words_sent[-1:] == ([2] if held else [0] if opened else [])


def test_every_history_of_late_requests_and_states_keeps_the_rules() -> None:
    events: list[Callable[[float], Any]] = [
        lambda now: RequesterOpens("a", stamp(now)),
        lambda now: RequesterCloses("a", stamp(now)),
        lambda now: RequesterCloses("a", stamp(now, aged=1.0)),
        lambda now: RequesterOpens("a", stamp(now, aged=1.0)),
        lambda now: DoorStateHeard(DoorModeValue.MODE_OPEN),
        lambda now: MaySpeak(int(now / STEP_S) % 2 == 1),
    ]
    for ledger, _ in histories(Ledger(speaks=False), events, depth(4, 5), after):
        ledger.until(5.0)


EVENTS = st.one_of(
    st.tuples(
        st.sampled_from([RequesterOpens, RequesterCloses]),
        st.sampled_from("abc"),
        st.sampled_from([0, 0, 2, 5]),
    ),
    st.sampled_from(list(DoorModeValue)).map(DoorStateHeard),
    st.booleans().map(MaySpeak),
    st.just(Woken()),
)
HISTORIES = st.lists(
    st.tuples(st.sampled_from([0.0, 0.05, 0.5, 1.0, 2.0, 35.0]), EVENTS), max_size=40
)


def told(history: list[tuple[float, Any]]) -> Ledger:
    ledger = Ledger(speaks=True)
    for passed, event in history:
        ledger.until(ledger.now + passed)
        if isinstance(event, tuple):
            word, who, aged = event
            event = word(who, stamp(ledger.now, aged))
        if not _would_be_believed(ledger, event):
            ledger.hears(event)
    return ledger


def _would_be_believed(ledger: Ledger, event: Any) -> bool:
    """Return whether the core would accept this request although its stamp is old.

    The core accepts an old stamp if the requester has been silent for long, or if its clock seems to
    have been set back. test_core has stories of both cases.
    """
    if not isinstance(event, RequesterOpens | RequesterCloses) or event.stamp >= ledger.newest.get(
        event.requester, 0
    ):
        return False
    requester = ledger.memory.requesters[event.requester]
    return ledger.now > requester.heard_at + 9.0 or requester.doubted_at > requester.doubted_since


@settings(max_examples=examples(300))
@given(HISTORIES)
def test_in_every_history_the_requests_follow_the_table_and_their_pace(
    history: list[tuple[float, Any]],
) -> None:
    ledger = told(history)
    ledger.until(ledger.now + 10.0)


@settings(max_examples=examples(300))
@given(HISTORIES)
def test_after_every_history_a_restart_knows_the_holders_of_the_door(
    history: list[tuple[float, Any]],
) -> None:
    ledger = told(history)
    kept = keep.persist({"ward": ledger.memory})
    restored = keep.restore(kept, DoorSupervisorSettings(), 0.0)
    holders = {h.requester for memory in restored.values() for h in memory.holders}
    assert holders == ledger.holders
    assert keep.persist(restored) == kept
    if restored:
        spoken = core.decide(restored["ward"], MaySpeak(True), 3.0, LIMITS)
        assert [
            m.requested_mode.value for _, m in spoken.publish if isinstance(m, DoorRequest)
        ] == [2]


@settings(max_examples=examples(200))
@given(st.binary(max_size=60))
def test_a_damaged_table_of_holders_is_refused_as_a_whole(kept: bytes) -> None:
    try:
        restored = keep.restore(kept, DoorSupervisorSettings(), 0.0)
    except ValueError:
        return
    assert all(memory.door == name for name, memory in restored.items())

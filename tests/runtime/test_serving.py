"""The thread of a service. The test chooses what the thread's rounds do."""

import threading
import time

import pytest

from bridges.runtime.clock import Clock
from bridges.runtime.inbox import Inbox
from bridges.runtime.serving import Serving, stop
from tests.waiting import PATIENCE_S, wait_until

CLOCK = Clock(time.monotonic, time.time)


class Rounds:
    """Rounds for the thread. With `works` false a round fails. `end` waits for `after`, and returns
    `safe`."""

    name = "rounds"

    def __init__(self, *, safe: bool = True, after: threading.Event | None = None) -> None:
        self.inbox: Inbox[str] = Inbox()
        self.wake_at = CLOCK.monotonic() + 3600.0
        self.ready = False
        self.works = True
        self.finished = 0
        self.ended = 0
        self.off = threading.Event()
        self._after = after
        self._safe = safe

    def round(self) -> None:
        if not self.works:
            raise RuntimeError("a defect of ours")

    def end(self) -> bool:
        self.ended += 1
        in_time = self._after is None or self._after.wait(PATIENCE_S)
        self.off.set()
        return self._safe and in_time


def test_a_thread_is_ready_when_a_round_is_done_and_what_it_serves_says_so() -> None:
    rounds = Rounds()
    rounds.ready = True
    thread = Serving(rounds, CLOCK)
    assert (thread.alive, thread.ready, thread.finished) == (False, False, 0)
    thread.start()
    rounds.inbox.wake()
    wait_until(lambda: thread.ready, "a round is done")
    rounds.ready = False
    assert not thread.ready
    assert stop([thread], 10.0)
    assert (thread.alive, rounds.ended) == (False, 1)


def test_a_thread_that_could_not_switch_off_says_so_when_it_is_stopped() -> None:
    rounds = Rounds(safe=False)
    thread = Serving(rounds, CLOCK)
    thread.start()
    assert not stop([thread], 10.0)
    assert (thread.alive, rounds.ended) == (False, 1)


def test_a_thread_that_dies_of_a_defect_switches_off_first(
    caplog: pytest.LogCaptureFixture,
) -> None:
    rounds = Rounds()
    rounds.works = False
    thread = Serving(rounds, CLOCK)
    thread.start()
    rounds.inbox.wake()
    wait_until(lambda: not thread.alive, "the thread has died")
    thread.ended(10.0)  # it logs its death, and switches off, a moment later
    died = 'died thread=rounds reason="a defect of ours"'
    assert [r.getMessage() for r in caplog.records] == [died]
    assert (rounds.ended, thread.finished) == (1, 0)


def test_a_thread_that_takes_long_to_switch_off_keeps_no_other_from_it() -> None:
    last = Rounds()
    first = Rounds(after=last.off)
    threads = [Serving(first, CLOCK), Serving(last, CLOCK)]
    for thread in threads:
        thread.start()
    assert stop(threads, PATIENCE_S)


def test_a_thread_that_has_a_defect_serves_no_more_though_it_still_switches_off() -> None:
    rest = threading.Event()
    rounds = Rounds(after=rest)
    rounds.works = False
    thread = Serving(rounds, CLOCK)
    thread.start()
    rounds.inbox.wake()
    wait_until(lambda: rounds.ended, "the thread switches off")
    assert (thread.alive, rounds.off.is_set()) == (False, False)
    rest.set()
    assert stop([thread], PATIENCE_S)


def test_where_one_thread_cannot_be_started_the_others_are_stopped() -> None:
    threads = [Serving(Rounds(), CLOCK), Serving(Rounds(), CLOCK)]
    threads[0].start()
    assert not stop(threads, PATIENCE_S), "the thread that never started counts as switched off"
    assert not threads[0].alive

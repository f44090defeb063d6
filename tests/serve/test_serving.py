"""The thread of a service, with rounds as a test writes them down."""

import time

import pytest

from bridges.serve.clock import Clock
from bridges.serve.inbox import Inbox
from bridges.serve.serving import Serving
from tests.waiting import wait_until

CLOCK = Clock(time.monotonic, time.time)


class Rounds:
    """`works`: until when rounds do not fail. `safe`: what the end says."""

    name = "rounds"

    def __init__(self, *, safe: bool = True) -> None:
        self.inbox: Inbox[str] = Inbox()
        self.wake_at = CLOCK.monotonic() + 3600.0
        self.ready = False
        self.works = True
        self.finished = 0
        self.ended = 0
        self._safe = safe

    def round(self) -> None:
        if not self.works:
            raise RuntimeError("a defect of ours")

    def end(self) -> bool:
        self.ended += 1
        return self._safe


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
    assert thread.stop(10.0)
    assert (thread.alive, rounds.ended) == (False, 1)


def test_a_thread_that_could_not_switch_off_says_so_when_it_is_stopped() -> None:
    rounds = Rounds(safe=False)
    thread = Serving(rounds, CLOCK)
    thread.start()
    assert not thread.stop(10.0)
    assert (thread.alive, rounds.ended) == (False, 1)


def test_a_thread_that_dies_of_a_defect_switches_off_first(
    caplog: pytest.LogCaptureFixture,
) -> None:
    rounds = Rounds()
    rounds.works = False
    thread = Serving(rounds, CLOCK)
    thread.start()
    rounds.inbox.wake()
    wait_until(lambda: not thread.alive, "it has died")
    died = 'died thread=rounds reason="a defect of ours"'
    assert [r.getMessage() for r in caplog.records] == [died]
    assert (rounds.ended, thread.finished) == (1, 0)

"""The stamps of adapters and our clock decide whether an adapter's request counts."""

import math

import pytest

from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.freshness import Requester, Rules, in_ns
from bridges.messages.definitions import Time

STAMP = 1_800_000_000.0
STARTED = Rules(most_s=5.0)
"""The rules of a daemon that started 5 s ago. So a request may be at most 5 s old."""


class Clocked:
    """One requester. Its clock is `skew` seconds ahead of ours."""

    def __init__(self, rules: Rules = STARTED, skew: float = 0.0) -> None:
        self.rules = rules
        self.skew = skew
        self.requester = Requester()

    def at(self, now: float, *, sent: float | None = None, ends: bool = False) -> bool:
        """Return whether a message that arrives at `now` counts.

        `sent` is the time of sending (s) by our clock, by default `now`.
        """
        sent = now if sent is None else sent
        stamp = STAMP + sent + self.skew
        age_s = now - sent - self.skew
        self.requester, counts = self.requester.hears(stamp, age_s, now, self.rules, ends=ends)
        return counts


# ---- FRESHNESS-1, FRESHNESS-2, FRESHNESS-4: stamps


def test_a_request_sent_after_our_start_counts_at_once() -> None:
    requester = Clocked()
    assert [requester.at(0.0), requester.at(0.0, sent=0.1), requester.at(9.0, sent=1.0)] == [
        True,
        True,
        True,
    ]


def test_a_request_must_be_newer_than_the_last_request_that_counted() -> None:
    requester = Clocked()
    assert requester.at(2.0)
    assert not requester.at(2.0)
    assert not requester.at(2.1, sent=1.0)
    assert requester.at(2.2)


def test_replayed_requests_do_not_count_but_a_live_repeat_counts() -> None:
    requester = Clocked(skew=-3600.0)
    replay = [requester.at(0.1, sent=-100.0 + number) for number in range(100)]
    assert replay == [False] * 100
    assert [requester.at(1.0), requester.at(1.2), requester.at(1.3)] == [False, True, True]


def test_a_requester_whose_request_has_counted_may_be_silent_for_long() -> None:
    requester = Clocked(skew=-3600.0)
    assert [requester.at(0.0), requester.at(1.0), requester.at(900.0)] == [False, True, True]


def test_with_synchronised_clocks_an_old_request_is_stale_even_from_a_known_requester() -> None:
    requester = Clocked(Rules(most_s=10.0, known_clocks=False))
    assert requester.at(0.0, sent=-9.0)
    assert not requester.at(100.0, sent=89.0)
    assert requester.at(100.5)


def test_a_request_from_the_future_counts_unless_a_limit_is_set() -> None:
    assert Clocked(skew=300.0).at(0.0)
    assert Clocked(Rules(5.0, future_s=2.0), skew=1.9).at(0.0)
    assert not Clocked(Rules(5.0, future_s=2.0), skew=2.1).at(0.0)


# ---- FRESHNESS-1: END


def test_an_end_is_compared_with_earlier_ends_only() -> None:
    """An END may come from an operator, whose clock may differ from the robot's clock."""
    requester = Clocked()
    assert requester.at(100.0)
    assert requester.at(100.0, sent=95.0, ends=True)
    assert not requester.at(100.5, sent=95.0, ends=True)
    assert not requester.at(100.6, sent=94.0, ends=True)
    assert requester.at(101.0)


def test_an_end_makes_earlier_requests_stale() -> None:
    requester = Clocked()
    assert requester.at(10.0, ends=True)
    assert not requester.at(10.1, sent=9.0)


# ---- FRESHNESS-5: wrong clocks


def test_a_requester_whose_clock_is_set_back_is_believed_after_a_second() -> None:
    requester = Clocked()
    assert requester.at(10.0, ends=True)
    requester.skew = -3600.0
    assert [requester.at(11.0), requester.at(11.9), requester.at(12.0)] == [False, False, True]
    assert [requester.at(12.1), requester.at(13.0, ends=True)] == [True, True]


def test_after_a_clock_was_set_back_an_end_counts_when_it_is_repeated() -> None:
    requester = Clocked()
    assert requester.at(10.0, ends=True)
    requester.skew = -3600.0
    assert [requester.at(t, ends=True) for t in (11.0, 11.5, 12.0, 12.5)] == [
        False,
        False,
        True,
        True,
    ]


def test_an_end_that_counted_because_of_its_repeats_does_not_count_again() -> None:
    requester = Clocked(skew=-3600.0)
    assert [requester.at(t, ends=True) for t in (0.0, 1.0)] == [False, True]
    assert not requester.at(1.1, sent=1.0, ends=True)


def test_an_end_with_a_slower_clock_counts_after_requests_that_counted_because_of_repeats() -> None:
    requester = Clocked(skew=-3600.0)
    assert [requester.at(0.0), requester.at(1.0)] == [False, True]
    assert requester.at(1.5, sent=0.5, ends=True)


def test_late_copies_in_a_wrong_order_do_not_look_like_a_live_requester() -> None:
    requester = Clocked()
    assert requester.at(60.0)
    echoes = [requester.at(61.0 + number, sent=50.0 - number) for number in range(10)]
    assert echoes == [False] * 10


def test_copies_with_long_pauses_do_not_look_like_a_live_requester() -> None:
    requester = Clocked()
    assert requester.at(60.0)
    assert [requester.at(t, sent=t / 10) for t in (61.0, 64.1, 67.2)] == [False] * 3


def test_a_requester_without_stamps_counts_when_it_repeats_itself() -> None:
    requester, counted = Requester(), []
    for now in (50.0, 50.5, 51.0, 52.0, 53.0):
        requester, counts = requester.hears(0.0, STAMP + now, now, STARTED, ends=False)
        counted.append(counts)
    assert counted == [False, False, True, True, True]


def test_a_requester_never_heard_has_no_stamps() -> None:
    assert Requester() == Requester(*[-math.inf] * 6)


def test_a_requester_is_remembered_after_its_repeats_have_counted() -> None:
    requester = Clocked(skew=-3600.0)
    assert [requester.at(100.0), requester.at(101.0)] == [False, True]
    assert requester.requester.heard_at == 101.0


def test_an_impossible_stamp_is_refused_and_a_missing_stamp_is_accepted() -> None:
    assert [in_ns(Time(0, 0)), in_ns(Time(1, 999_999_999))] == [0, 1_999_999_999]
    for stamp, text in ((Time(-1, 0), "-1 s 0 ns"), (Time(0, 10**9), "0 s 1000000000 ns")):
        with pytest.raises(RequestRefused, match=f"^impossible request_time: {text}$"):
            in_ns(stamp)

"""All histories of moves up to a depth. In each history the supervisor must pass on each request for a
lift, or report why not.

There are nine moves: two requests of robots, one END, four states of the lift, a change of the
permission to publish, and 12 s of time. `make deep` has all 9^5 = 59,049 histories of five moves. `make
test` has all 9^4 = 6,561 histories of four moves. The test judges the sent messages and the report.
"""

from collections.abc import Callable
from copy import copy

from bridges.kinds.shared.graph_kind import LISTENS, MaySpeak
from tests.depth import depth
from tests.kinds.lift_supervisor.alone import Alone
from tests.walk import histories

Move = Callable[[Alone], None]

MOVES: list[Move] = [
    lambda one: one.asks("a", "L3"),
    lambda one: one.asks("b", "L1"),
    lambda one: one.ends("a"),
    lambda one: one.shows(),
    lambda one: one.shows("a", to="L3"),
    lambda one: one.shows("b", "L1", to="L1", open=True),
    lambda one: one.shows(mode="FIRE"),
    lambda one: one.hears(MaySpeak(not one.memory.may_speak, waits="for the rival")),
    lambda one: one.until(one.now + 12.0),
]
PACE_S = 0.2
"""A pause (s) after each move. It is longer than the least time between two messages."""


def after(one: Alone, move: Move) -> Alone:
    one = copy(one)
    one.sent, one.refused = [*one.sent], [*one.refused]
    move(one)
    one.until(one.now + PACE_S)
    check(one)
    return one


def check(one: Alone) -> None:
    """If the supervisor's last message is not the request of each robot, require a reason in the
    report."""
    last = one.sent[-1][1] if one.sent else ""
    unserved = [c for c in one.memory.claims if last != f"AGV {c.session} {c.target.floor}"]
    assert bool(one.report.waits) >= bool(unserved), one.report
    assert bool(one.report.waits) >= bool(one.waiting), one.report
    assert bool(one.memory.claims) >= bool(one.report.waits)


def test_in_every_history_the_report_tells_why_a_robot_waits() -> None:
    said = {
        one.report.waits for one, _ in histories(Alone(speaks=False), MOVES, depth(4, 5), after)
    }
    assert said == {
        "",
        LISTENS,
        "for the rival",
        "for the lift to release a",
        "for the lift to release b",
        "for the lift to take a",
        "for the lift to take b",
        "for END of a",
        "for END of b",
        "for a request or the END of a, because the lift shows it",
        "for a request or the END of b, because the lift shows it",
        "for the end of the lift's FIRE mode",
        "for the lift's states",
    }

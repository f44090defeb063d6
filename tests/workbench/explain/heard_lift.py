"""A lift of another maker, as heard on a graph without our daemons: short stories for `explain`."""

from collections.abc import Callable, Iterable

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from workbench.explain.explanation import Explanation
from workbench.explain.heard_devices import HeardDevices

WALL = 1_800_000_000.0
RED, BLUE = "fleet/red", "fleet/blue"
CLOSED, OPEN = 0, 2
HUMAN, AGV, FIRE, OFFLINE, EMERGENCY = 1, 2, 3, 4, 5
END, ASKS_AGV, ASKS_HUMAN = 0, 1, 2


def heard(at: float, topic: str, message: d.Message) -> Heard:
    return Heard(at, WALL + at, topic, message)


def shows(
    at: float, session: str = "", floor: str = "L1", door: int = CLOSED, mode: int = AGV
) -> Heard:
    """Return a LiftState. The car stands."""
    served = ("L1", "L2", "L3")
    read = stamp(WALL + at)
    state = d.LiftState(read, "Lift1", served, floor, "", door, 0, (HUMAN, AGV), mode, session)
    return heard(at, "lift_states", state)


def asks(
    at: float, floor: str = "L2", who: str = RED, kind: int = ASKS_AGV, *, passed: bool = False
) -> Heard:
    """Return a LiftRequest of a robot. If `passed` is true, the supervisor has sent it."""
    topic = "lift_requests" if passed else "adapter_lift_requests"
    floor = "" if kind == END else floor
    return heard(at, topic, d.LiftRequest("Lift1", stamp(WALL + at), who, kind, floor, OPEN))


def each_second(begin: float, end: float, line: Callable[[float], Heard]) -> list[Heard]:
    return [line(begin + n) for n in range(int(end - begin))]


def explained(lines: Iterable[Heard]) -> Explanation:
    """Explain the lift at the end of these messages."""
    site = HeardDevices("Lift1")
    for one in sorted(lines, key=lambda one: one.at):
        site.take(one)
    return site.explain("lift", "Lift1", None)

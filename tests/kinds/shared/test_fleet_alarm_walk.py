"""A check of all states that two daemons, a stranger's node and the robots can reach within some moves.

The walk starts on a ROS graph without alarms. After each move 9 s pass, so that every message has
arrived. The rules check the messages since the move, and the state after these 9 s. They do not use the
core's code.
"""

from collections.abc import Callable, Hashable, Iterator, Mapping
from functools import partial
from typing import Final

from msgspec.structs import replace

from bridges.kinds.shared import fleet_alarm, kept_alarm
from bridges.kinds.shared.fleet_alarm_memory import (
    FleetAlarmMemory,
    overlap,
)
from tests.depth import depth
from tests.kinds.shared.fleets import AlarmGraph, graph
from tests.walk import reached

A, B = "a", "b"
REST_S: Final = 9.0

Move = Callable[[AlarmGraph], AlarmGraph]


def moves(*fleets: str) -> dict[str, Move]:
    """Return every move of the walk by its name. The stranger publishes for these fleets."""
    found: dict[str, Move] = {
        "the stranger alarms": lambda g: g.stranger_says(True, *fleets),
        "the stranger ends": lambda g: g.stranger_says(False, *fleets),
    }
    for name in (A, B):
        found |= {
            f"{name} burns": lambda g, n=name: g.tells(n, "fire"),  # type: ignore[misc]
            f"{name} is out": lambda g, n=name: g.tells(n),  # type: ignore[misc]
            f"{name} drills": lambda g, n=name: g.tells(n, drill=True),  # type: ignore[misc]
            f"{name} is ordered to drill": lambda g, n=name: g.drills(n, 12.0),  # type: ignore[misc]
            f"{name} is unread": lambda g, n=name: g.tells(n, seen=False),  # type: ignore[misc]
            f"{name} is reset": lambda g, n=name: g.resets(n),  # type: ignore[misc]
            f"{name} dies": lambda g, n=name: g.kill(n),  # type: ignore[misc]
            f"{name} starts": lambda g, n=name: g.start(n) if _dead(g, n) else g,  # type: ignore[misc]
        }
    return found


def _dead(g: AlarmGraph, name: str) -> bool:
    return g.daemons[name].memory is None


def latched(g: AlarmGraph, name: str) -> bool:
    """Return whether this daemon has read a cause of an alarm that nobody has reset. The daemon may be
    dead now."""
    return bool(kept(g, name).latched)


def kept(g: AlarmGraph, name: str) -> FleetAlarmMemory:
    """Return the memory on a daemon's disk."""
    disk = g.daemons[name].disk
    return fleet_alarm.initial() if disk is None else kept_alarm.restore(disk)


def key(g: AlarmGraph) -> Hashable:
    """Return the graph without its times and its history. Two graphs with the same key count as one
    state."""
    return (
        tuple(
            (d.disk, d.memory is None, d.present, d.drill, d.seen, d.retained, d.state, d.faults)
            for d in g.daemons.values()
        ),
        tuple(g.stands.items()),
        g.stranger,
        g.stranger_spoke,
    )


def neighbours(g: AlarmGraph, moves: Mapping[str, Move]) -> Iterator[AlarmGraph]:
    """Yield the graph after each of these moves and REST_S more seconds. Check each move."""
    for name, move in moves.items():
        after = move(replace(g, said=(), path=(*g.path, name))).until(g.now + REST_S)
        check_messages(g, after)
        check_rest(after)
        yield after


def check_messages(before: AlarmGraph, after: AlarmGraph) -> None:
    """Check everything that the daemons have published since the move."""
    for name, daemon in after.daemons.items():
        if latched(before, name) and not latched(after, name):
            assert after.path[-1] == f"{name} is reset", f"an end without a reset: {after.path}"
            clear = daemon.seen and not daemon.present
            assert clear, f"a reset in an alarm: {after.path}"
        told = [on for _, who, on, _ in after.said if who == name]
        had_told = kept(before, name).told is not None
        for on in told:
            assert on or had_told, f"a false from a daemon that has published no true: {after.path}"
            had_told = on
        assert told.count(True) <= 2, f"a flood of true: {after.path}"
        if False in told:
            assert not latched(after, name), f"a false without a reset: {after.path}"
            strange = after.stranger and overlap(after.stranger_fleets, _told_to(after, name))
            assert not strange, f"a false against the stranger's alarm: {after.path}"
            other = next(one for one in after.daemons if one != name)
            stands = latched(after, other) or after.daemons[other].state == "drill"
            overruled = _dead(after, other) and _is_overruled(before, after, name, other)
            assert not stands or overruled, f"a false against another's alarm: {after.path}"


def _is_overruled(before: AlarmGraph, after: AlarmGraph, name: str, other: str) -> bool:
    """Return whether daemon `name` may end the alarm although `other` is dead and has not ended its
    alarm.

    The daemon may do so if the stranger's `false` has just freed the robots. It may also do so if it
    does not know the alarm of `other`, because it was dead itself at that time.
    """
    memory = before.daemons[name].memory or kept(before, name)
    return after.path[-1] == "the stranger ends" or other not in memory.others


def _told_to(g: AlarmGraph, name: str) -> frozenset[str]:
    """Return the fleets in a daemon's last `false`."""
    return frozenset(next(f for _, who, on, f in reversed(g.said) if who == name and not on))


def check_rest(g: AlarmGraph) -> None:
    """Check a graph on which every message has arrived."""
    live = [d for d in g.daemons.values() if d.memory is not None]
    raised = [d for d in live if d.state in ("alarm", "drill")]
    for daemon in raised:
        stand = all(g.stands[fleet] for fleet in daemon.fleets or g.stands)
        assert stand, f"a robot drives during an alarm: {g.path}"
        assert daemon.retained[-1:] == (True,), f"a late fleet adapter drives: {g.path}"
    if raised:
        late = any(d.retained[-1:] == (False,) for d in live)
        assert not late, f"a late fleet adapter may get an old false as the last message: {g.path}"
    # If a daemon is dead, the end of its alarm was perhaps never published.
    gone = any(_dead(g, name) for name in g.daemons)
    over = not any(latched(g, name) for name in g.daemons) and not raised and not g.stranger
    if over and not gone:
        assert {d.state for d in live} <= {"quiet"}, f"the alarm does not end: {g.path}"
        assert not any(d.retained for d in live), f"a late adapter hears an old alarm: {g.path}"
    for daemon in live:
        memory = daemon.memory
        assert memory is not None
        assert (daemon.state == "alarm") == bool(memory.latched)
        assert not daemon.present or daemon.state == "alarm"


def test_no_state_of_two_daemons_lets_a_robot_drive_in_an_alarm_or_stand_for_ever() -> None:
    found = reached([graph(a=(), b=())], depth(4, 12), partial(neighbours, moves=moves()), key)
    states = {tuple(d.state for d in g.daemons.values()) for g in found}
    assert {("alarm", "reset"), ("reset", "drill"), ("quiet", "alarm")} <= states
    assert len(found) >= depth(1000, 30_000)


def test_an_alarm_for_some_fleets_neither_holds_nor_frees_the_others() -> None:
    """Daemon a publishes for the fleets x and y, daemon b for y, and the stranger for x."""
    start = graph(a=("x", "y"), b=("y",))
    found = reached([start], depth(4, 12), partial(neighbours, moves=moves("x")), key)
    assert {True, False} == {g.stands["x"] for g in found if g.stands["y"]}
    assert len(found) >= depth(1000, 30_000)

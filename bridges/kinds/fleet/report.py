"""A robot's report: its place and its command for RMF's adapter, and its faults."""

from collections.abc import Iterator

import msgspec

from bridges.kinds.fleet.light import LightQuestion, question
from bridges.kinds.fleet.memory import RobotLimits, RobotMemory, silent_at
from bridges.kinds.fleet.sensing import off_goal_m, on_other_map, stands
from bridges.kinds.fleet.signals import Pose
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import SILENT_S

NEAR_M = 1.0
"""The distance (m) within which a robot counts as standing at a waypoint."""
UNFIT = frozenset(
    ("ROBOT_SILENT", "ROBOT_FAULT", "ROBOT_TAKEN_OUT", "ROBOT_ON_OTHER_MAP", "ROBOT_NOT_OBEYING")
)
"""The faults that keep a robot from getting a new task."""


class RobotReport(msgspec.Struct, frozen=True):
    """The values for RMF's adapter. `at`: the robot's place on its own map, from a fresh reading; None
    if RMF must get no place. `battery`: a fraction of 1. `activity`: the number of the present
    command; 0 without a command. `finished`: the number of the last command that was carried out.
    `fit`: whether the robot may get new tasks. RMF gives no tasks to a robot that it can only pause.
    For such a robot `fit` is None, and `light` has its progress.

    `where`: the nearest waypoint, for people. `doing`: the command, for people.
    """

    at: Pose | None = None
    battery: float = 0.0
    activity: int = 0
    finished: int = 0
    fit: bool | None = False
    where: str = ""
    doing: str = ""
    read_at: float | None = None
    faults: tuple[Fault, ...] = ()
    light: LightQuestion | None = None

    def news(self) -> object:
        """Return the report without its age."""
        levels = self.at, self.battery, self.activity, self.finished, self.fit
        return *levels, self.faults, self.light


def report(memory: RobotMemory, now: float, limits: RobotLimits) -> RobotReport:
    """Report the present state of the robot."""
    found = tuple(faults(memory, now, limits))
    command, reading = memory.command, memory.reading
    fit = reading is not None and not any(fault.code in UNFIT for fault in found)
    return RobotReport(
        at=_place(memory, limits),
        battery=reading.battery if reading else 0.0,
        activity=command.id if command and command.doing != "stop" else 0,
        finished=memory.finished,
        fit=None if limits.light else fit,
        where=_where(memory, limits),
        doing=_light(memory, limits) if limits.light else _doing(memory),
        read_at=memory.read_at,
        faults=found,
        light=question(memory, limits) if limits.light else None,
    )


def _place(memory: RobotMemory, limits: RobotLimits) -> Pose | None:
    if memory.reading is None or not memory.fresh or on_other_map(memory, limits):
        return None
    command = memory.command
    if command and command.doing == "localize" and command.goal:
        return None  # the robot still reports the map of the floor that the lift has left
    return memory.reading.at


def _where(memory: RobotMemory, limits: RobotLimits) -> str:
    if memory.reading is None:
        return "unknown"
    at = limits.site.on_rmfs_map(memory.reading.at)
    near = limits.site.graph.nearest(at, NEAR_M)
    return f"{at.map} {near.name}" if near else f"{at.map} between waypoints"


def _doing(memory: RobotMemory) -> str:
    command = memory.command
    if command is None:
        return "nothing"
    again = f" (attempt {command.attempt})" if command.attempt > 1 else ""
    if command.goal is None:
        return f"{command.activity or 'stop'}{again}"
    at = command.goal.at
    to = command.goal.dock or command.goal.name or f"{at.x:.1f}, {at.y:.1f}"
    return f"{command.doing} to {at.map} {to}{again}"


def _light(memory: RobotMemory, limits: RobotLimits) -> str:
    light, command = memory.light, memory.command
    told = command is not None and command.doing == "pause"
    paused = "told to pause" if told else "paused by us" if light.held else ""
    if not light.path:
        return paused or "nothing"
    to = light.path[-1]
    near = limits.site.graph.nearest(to, NEAR_M)
    name = near.name if near else f"{to.x:.1f}, {to.y:.1f}"
    says = light.answer.says if light.answer else "no answer"
    way = f"path to {to.map} {name}, at checkpoint {light.passed} of {len(light.path) - 1}"
    return f"{way}, RMF's light: {says}" + (f", {paused}" if paused else "")


def charges(memory: RobotMemory, charger: str, now: float) -> bool | None:
    """Return whether the robot charges, as the robot itself or the charger reports. Return None if
    neither has ever reported a charge or its absence."""
    pad = memory.pads.get(charger)
    own = memory.reading.charging if memory.reading else None
    if pad is None and own is None:
        return None
    return bool(own) or bool(pad and pad.state.charging and now < pad.at + SILENT_S)


def faults(memory: RobotMemory, now: float, limits: RobotLimits) -> Iterator[Fault]:
    """Yield all present faults, most serious first. No text contains a number that changes all the
    time."""
    if now >= silent_at(memory, limits):
        yield Fault("ROBOT_SILENT", memory.unread or f"no reading for {limits.t.stale_after_s} s")
    elif memory.unread and not memory.fresh:
        yield Fault("ROBOT_NOT_READ", memory.unread)
    if memory.reading is None:
        return
    if memory.reading.fault:
        yield Fault("ROBOT_FAULT", memory.reading.fault)
    if memory.reading.taken_out:
        yield Fault("ROBOT_TAKEN_OUT", memory.reading.taken_out)
    if memory.reading.paused and not memory.light.held:
        whose = (
            "this daemon resumes only its own pauses" if limits.light else "RMF resumes no robot"
        )
        yield Fault("ROBOT_PAUSED_BY_OTHERS", f"it is paused, and {whose}")
    yield from _of_place(memory, limits)
    yield from _of_charge(memory, now, limits)
    yield from _of_command(memory, limits)
    if limits.light:
        yield from _of_light(memory)


def _of_light(memory: RobotMemory) -> Iterator[Fault]:
    light, reading = memory.light, memory.reading
    assert reading is not None
    if light.answer is not None and light.answer.says == "error":
        yield Fault("ROBOT_PASSED_LIGHT", "it is where RMF has not let it go")
    if not light.path and not reading.path and not stands(memory) and memory.fresh:
        yield Fault("ROBOT_WITHOUT_PATH", "it drives, and its manager tells no path")


def _of_place(memory: RobotMemory, limits: RobotLimits) -> Iterator[Fault]:
    assert memory.reading is not None
    if on_other_map(memory, limits):
        known = ", ".join(limits.site.graph.levels())
        text = f"it is on the map '{memory.reading.at.map}', but the graph has {known}"
        yield Fault("ROBOT_ON_OTHER_MAP", text)
    elif memory.off_m > limits.t.off_graph_m:
        yield Fault("ROBOT_OFF_GRAPH", f"{memory.off_m:.0f} m from the nearest lane")


def _of_charge(memory: RobotMemory, now: float, limits: RobotLimits) -> Iterator[Fault]:
    assert memory.reading is not None
    meant = memory.charges_at
    at = limits.site.on_rmfs_map(memory.reading.at)
    stands_at = limits.site.graph.nearest(at, NEAR_M, chargers=True)
    if meant and memory.reading.charging and stands_at and stands_at.name != meant:
        text = f"it charges at {stands_at.name}, and was sent to {meant}"
        yield Fault("ROBOT_AT_WRONG_STATION", text)
    for charger, pad in memory.pads.items():
        concerned = charger in (meant, stands_at.name if stands_at else "")
        if concerned and pad.state.error and now < pad.at + SILENT_S:
            yield Fault("CHARGER_REPORTS_ERROR", f"{charger}: {pad.state.error}")


def _of_command(memory: RobotMemory, limits: RobotLimits) -> Iterator[Fault]:
    command, reading = memory.command, memory.reading
    assert reading is not None
    if command is None:
        return
    if memory.unsent:
        yield Fault("ROBOT_NOT_COMMANDED", memory.unsent)
    if reading.refused:
        yield Fault("ROBOT_REFUSES", reading.refused)
    if reading.unanswered and command.doing == "act":
        text = f"nobody knows whether {command.activity} has begun: a reset sends it again"
        yield Fault("ROBOT_ACTION_UNANSWERED", text)
    if reading.failed and command.doing == "act":
        yield Fault("ROBOT_ACTION_FAILED", f"{reading.failed}: a reset sends it again")
    if command.goal and reading.completed == str(command.id):
        off_m = off_goal_m(memory, command.goal, limits)
        if off_m > limits.t.arrived_m:
            far = "on another map than" if off_m == float("inf") else f"{off_m:.0f} m from"
            yield Fault("ROBOT_NOT_THERE", f"it reports arrival, but is {far} its goal")
    if memory.arrived_at is not None and command.goal:
        yield Fault("ROBOT_NOT_CHARGING", f"docked at {command.goal.dock} without a charge")
    halts = command.doing in ("stop", "pause")
    still = halts and stands(memory)
    in_vain = memory.tries > limits.t.attempts and not still
    if halts and memory.tries > 1:
        what = "it stands, but has not taken the" if still else "it drives on after a"
        yield Fault("ROBOT_NOT_STOPPING", f"{what} {command.doing}")
    if in_vain:
        yield Fault("ROBOT_NOT_OBEYING", f"{limits.t.attempts} attempts in vain: {command.doing}")
    elif reading.busy and memory.tries > 1 and not halts:
        yield Fault("ROBOT_NOT_STOPPING", "it keeps an earlier order, although that was cancelled")

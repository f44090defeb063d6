"""A robot's decision core: one pure decision for each event.

The robot's manager is the maker's system through which the daemon reaches the robot.

Rules:
FLEET-1. Only the last order of RMF counts. A command is sent once for each attempt, and a command's
   number never repeats.
FLEET-2. A command is done when the robot is within `arrived_m` of the goal, on the goal's map. If the
   robot reports completed commands, it must also have reported this command. Otherwise the robot must
   stand and face in the goal's direction. If a robot reports a command as completed at another place,
   the command is not done, and the report is a fault.
FLEET-3. If the robot stands for `obeys_s` and the command is not done, the command is sent again. So is
   a command that was refused, even while the robot still drives to an earlier goal. The pauses between
   attempts grow. An action is sent again only if its manager refused it, because an action must not be
   done twice. No command is sent again while the robot is paused, takes no orders or reports a fault,
   because a person may be keeping it there.
FLEET-4. A stop or pause is carried out when the robot or its manager has taken it, and a later reading
   shows that the robot stands. Until then the command is sent again every `stops_s`, also to a robot
   that is not read. A new order replaces a stop. While a robot keeps the order of an earlier command,
   the new command, and with it the cancelling, is also sent again every `stops_s`.
FLEET-5. RMF gets the robot's place only from a fresh reading. After `stale_after_s` without a reading
   the robot is silent.
FLEET-6. If the robot is on a map that the graph lacks, RMF gets no place. If the robot is on the map
   but off the graph, RMF gets its place, and the distance from the graph is reported as a fault.
FLEET-7. After a lift ride RMF gets no place until the robot is on the new floor's map, near the place
   that RMF expects. The command `localize` is then done.
FLEET-8. Docking at a charger is done when the robot, or the charger's own daemon, reports a charge. If
   neither can report a charge, docking is done when the robot has arrived. If no charge comes for
   `docks_s`, the robot is sent to dock again.
FLEET-9. A robot is at the wrong station if it charges at another charger than the one it was last sent
   to.
FLEET-10. A robot gets no new task while it reports a fault, takes no orders, is silent, is on an
   unknown map, or has not carried out a command after `attempts` attempts. When this is over, the robot
   gets tasks again.
FLEET-11. If RMF has given up an activity, the activity is stopped.
FLEET-12. After an operator's reset, the attempts are counted from the beginning, and the command is
   sent again, but not while a person may be keeping the robot standing (FLEET-3). An action is sent
   again only if it was refused, if it has failed, or if nobody knows whether it has begun.
FLEET-13. A command that could not be sent is a fault, and is tried again at each scan. It does not
   concern the robot's place, which RMF still gets.

`light.py` has the rules for a robot that RMF can only pause.
"""

from collections.abc import Iterator

from msgspec.structs import replace

from bridges.kinds.fleet import light
from bridges.kinds.fleet.memory import Pad, RobotLimits, RobotMemory, silent_at
from bridges.kinds.fleet.report import RobotReport, charges, report
from bridges.kinds.fleet.sensing import faces, off_goal_m, stands, take
from bridges.kinds.fleet.signals import (
    Act,
    Event,
    Goal,
    LightAnswer,
    Localize,
    Navigate,
    PadHeard,
    RobotCommand,
    RobotOutputs,
    RobotSample,
    Stop,
)
from bridges.kinds.shared.decision import Decision, IoFailed, OperatorReset, Sampled, WriteFailed
from bridges.kinds.shared.durations import NEVER

MOST_PAUSES = 6
"""The longest pause between two attempts, as a multiple of `obeys_s`."""
RELOCALISED_M = 3.0
"""The greatest distance (m) from the expected place at which a robot counts as located after a lift
ride. It is large, because RMF expects the robot at the lift's waypoint, but the robot may stand
anywhere in the lift car."""

_STAYS = ("stop", "pause", "resume")
"""The commands that send a robot nowhere by themselves."""

FleetDecision = Decision[RobotMemory, RobotOutputs, RobotReport]


def initial(limits: RobotLimits, now: float) -> RobotMemory:
    """Return the memory at start, before any reading. The robot gets no command."""
    return RobotMemory(started_at=now)


def decide(memory: RobotMemory, event: Event, now: float, limits: RobotLimits) -> FleetDecision:
    """Apply one event and decide. `now`: monotonic s, never earlier than in the last call. Never
    raises."""
    memory = _hear(memory, event, now, limits)
    if limits.light:
        memory = light.follow(memory, limits)
    memory = _advance(memory, now, limits)
    if limits.light:
        memory = light.steer(memory, now, limits)
    wakes = (at for at in _wakes(memory, limits) if at > now)
    return Decision(
        memory=memory,
        outputs=RobotOutputs(memory.command),
        report=report(memory, now, limits),
        wake_at=min(wakes, default=NEVER),
    )


def _hear(memory: RobotMemory, event: Event, now: float, limits: RobotLimits) -> RobotMemory:
    match event:
        case Sampled(sample):
            return _sent(take(memory, sample, now, limits))
        case WriteFailed(reason):
            return replace(memory, unsent=reason)
        case IoFailed(reason):
            return replace(memory, fresh=False, unread=reason)
        case PadHeard(charger=charger):
            return replace(memory, pads={**memory.pads, charger: Pad(event, now)})
        case LightAnswer():
            return light.hear(memory, event)
        case OperatorReset():
            paused = limits.light and memory.reading is not None and memory.reading.paused is True
            held = replace(memory.light, held=memory.light.held or paused)
            return _reset(replace(memory, light=held), now)
        case Navigate() | Localize() | Act() | Stop():
            return _order(memory, event, now, limits)
    return memory


def _sent(memory: RobotMemory) -> RobotMemory:
    """Forget why a command was not sent, once the robot or its manager has answered it."""
    command, reading = memory.command, memory.reading
    if not memory.unsent or (command and reading and not _is_answered(reading, command)):
        return memory
    return replace(memory, unsent="")


def _is_answered(reading: RobotSample, command: RobotCommand) -> bool:
    return bool(reading.refused) or reading.taken == (command.id, command.attempt)


def _reset(memory: RobotMemory, now: float) -> RobotMemory:
    """Send the command again at once, after an operator's reset. The reset may be for another robot of
    the file. So an action that may have begun is not sent again, and a robot that a person keeps
    standing is sent nowhere."""
    if memory.command is None:
        return memory
    reading, doing = memory.reading, memory.command.doing
    lost = reading and (reading.refused or reading.unanswered or reading.failed)
    kept = doing not in _STAYS and reading is not None and _is_kept(reading)
    if kept or (doing == "act" and not lost):
        return replace(memory, tries=1)
    return replace(_again(memory, now), tries=1)


def _is_kept(reading: RobotSample) -> bool:
    """Return whether a person or the robot itself keeps the robot standing."""
    return reading.paused is True or bool(reading.taken_out or reading.fault)


def _order(
    memory: RobotMemory, event: Navigate | Localize | Act | Stop, now: float, limits: RobotLimits
) -> RobotMemory:
    match event:
        case Navigate(id, goal):
            doing = "dock" if goal.dock else "navigate"
            memory = replace(memory, charges_at=_charger(goal, limits) or memory.charges_at)
            return _begin(memory, RobotCommand(id, doing, goal=goal), now)  # type: ignore[arg-type]
        case Localize(id, goal):
            return _begin(memory, RobotCommand(id, "localize", goal=goal), now)
        case Act(id, category, description):
            command = RobotCommand(id, "act", activity=category, description=description)
            return _begin(memory, command, now)
        case Stop(id, of):
            if memory.command is None or memory.command.id != of:
                return memory
            return _begin(memory, RobotCommand(id, "stop", of=of), now)


def _begin(memory: RobotMemory, command: RobotCommand, now: float) -> RobotMemory:
    return replace(memory, command=command, asked_at=now, arrived_at=None, tries=1)


def _charger(goal: Goal, limits: RobotLimits) -> str:
    """Return the charger at the goal; "" if there is none."""
    vertex = limits.site.graph.called(goal.name)
    return goal.name if vertex and vertex.charger else ""


def _advance(memory: RobotMemory, now: float, limits: RobotLimits) -> RobotMemory:
    """Clear the command if the robot has carried it out. Otherwise begin the next attempt if its time
    has come."""
    command = memory.command
    if command is None:
        return memory
    if command.doing in ("stop", "pause"):
        if _has_stopped(memory, command):
            return replace(memory, command=None)
        return _again(memory, now) if now >= memory.asked_at + limits.t.stops_s else memory
    if not memory.fresh:
        return memory
    if command.doing == "resume" and light.resumed(memory, now, limits):
        return replace(memory, command=None, light=replace(memory.light, held=False))
    memory = _arrival(memory, command, now, limits)
    if command.doing != "resume" and _is_done(memory, command, now, limits):
        return replace(memory, command=None, finished=command.id, arrived_at=None)
    return _again(memory, now) if now >= _again_at(memory, command, limits) else memory


def _has_stopped(memory: RobotMemory, command: RobotCommand) -> bool:
    """Return whether the robot was seen to stand after it had taken the stop or pause. A robot that
    stands without it may just have taken the command that must be stopped."""
    if not stands(memory):
        return False
    assert memory.reading is not None
    not_paused = command.doing == "pause" and memory.reading.paused is False
    return memory.reading.taken == (command.id, command.attempt) and not not_paused


def _again(memory: RobotMemory, now: float) -> RobotMemory:
    assert memory.command is not None
    command = replace(memory.command, attempt=memory.command.attempt + 1)
    tries = memory.tries + 1
    return replace(memory, command=command, asked_at=now, arrived_at=None, tries=tries)


def _arrival(
    memory: RobotMemory, command: RobotCommand, now: float, limits: RobotLimits
) -> RobotMemory:
    here = command.doing == "dock" and _is_there(memory, command, limits)
    if not here:
        return replace(memory, arrived_at=None)
    return replace(memory, arrived_at=now) if memory.arrived_at is None else memory


def _is_done(memory: RobotMemory, command: RobotCommand, now: float, limits: RobotLimits) -> bool:
    assert memory.reading is not None
    match command.doing:
        case "act":
            return memory.reading.completed == str(command.id)
        case "localize":
            assert command.goal is not None
            return off_goal_m(memory, command.goal, limits) <= RELOCALISED_M
    if not _is_there(memory, command, limits):
        return False
    assert command.goal is not None
    at_charger = command.doing == "dock" and _charger(command.goal, limits)
    return not at_charger or charges(memory, command.goal.name, now) is not False


def _is_there(memory: RobotMemory, command: RobotCommand, limits: RobotLimits) -> bool:
    assert command.goal is not None
    assert memory.reading is not None
    if off_goal_m(memory, command.goal, limits) > limits.t.arrived_m:
        return False
    if memory.reading.completed is not None:
        return memory.reading.completed == str(command.id)
    return stands(memory) and faces(memory, command.goal, limits)


def _again_at(memory: RobotMemory, command: RobotCommand, limits: RobotLimits) -> float:
    """Return the time of the next attempt. Return NEVER while the robot moves by the command, and while
    a person or the robot itself keeps it standing."""
    assert memory.reading is not None
    reading = memory.reading
    if reading.busy:
        return memory.asked_at + limits.t.stops_s
    if _is_kept(reading) and command.doing != "resume":
        return NEVER
    if memory.arrived_at is not None:
        return memory.arrived_at + limits.t.docks_s
    pause_s = limits.t.obeys_s * min(memory.tries, MOST_PAUSES)
    if reading.refused and reading.taken != (command.id, command.attempt):
        return memory.asked_at + pause_s
    waits = command.doing != "act" and stands(memory)
    return max(memory.asked_at, memory.moved_at) + pause_s if waits else NEVER


def _wakes(memory: RobotMemory, limits: RobotLimits) -> Iterator[float]:
    """Yield each time at which the decision may change without a reading."""
    yield silent_at(memory, limits)

"""The inputs and outputs of a robot's core.

All places here are on the robot's own map, in metres and radians counterclockwise. RMF's adapter
transforms its goals to that map too (`reference_coordinates`).
"""

from typing import Literal, Union

import msgspec

from bridges.kinds.shared.decision import (
    Attended,
    IoFailed,
    MemoryKept,
    MemoryNotKept,
    OperatorReset,
    RivalSeen,
    Sampled,
)


class Pose(msgspec.Struct, frozen=True):
    """A place on one map, with the robot's direction."""

    map: str
    x: float
    y: float
    yaw: float = 0.0


class Goal(msgspec.Struct, frozen=True):
    """A destination of RMF. `name`: the name of its waypoint, "" without a name. `dock`: the name of
    the dock, if the lane to the goal ends in docking. `speed_limit`: m/s. `lift`: the name of the
    lift, if the goal is in a lift."""

    at: Pose
    name: str = ""
    dock: str = ""
    speed_limit: float | None = None
    lift: str = ""


class Navigate(msgspec.Struct, frozen=True):
    """RMF's order `navigate`: drive to this goal. `id`: our number of the command, which never
    repeats."""

    id: int
    goal: Goal


class Localize(msgspec.Struct, frozen=True):
    """RMF's order `localize`: the robot has left a lift at another floor, near this goal."""

    id: int
    goal: Goal


class Act(msgspec.Struct, frozen=True):
    """RMF's order `execute_action`. `description`: the action's JSON object, as text."""

    id: int
    category: str
    description: str = "{}"


class Stop(msgspec.Struct, frozen=True):
    """RMF's order `stop`, or the end of an activity that RMF has given up. `of`: the number of the
    command to stop."""

    id: int
    of: int


Says = Literal["continue", "wait", "pause", "resume", "stay", "error"]


class LightAnswer(msgspec.Struct, frozen=True):
    """An answer of RMF's traffic light about this path and checkpoint.

    For a moving robot: `continue`: it may pass its next checkpoint. `wait`: it must wait there.
    `pause`: it must stop at once. For a standing robot: `resume`: it may go on. `stay`: it must stay.
    For any robot: `error`: it is at a place to which RMF has not let it go. Source:
    EasyTrafficLight.hpp of open-rmf/rmf_ros2.
    """

    path: int
    checkpoint: int
    says: Says


class PadHeard(msgspec.Struct, frozen=True):
    """A charger's state that names this robot. `error`: the state's error text; "" without an error."""

    charger: str
    charging: bool
    error: str = ""


class RobotSample(msgspec.Struct, frozen=True):
    """One reading of a robot. A value is None if the maker's interface does not report it.

    `battery`: a fraction of 1, as it was read. `completed`: the command that the robot reports as
    completed; "" for none. `fault`: the robot's own fault. `taken_out`: the reason why the robot takes
    no orders (manual mode, teaching). `said_at`: the robot's own time or counter of this reading.
    `refused`: the manager's refusal of the last command. `unanswered`: the last command was an action,
    and nobody knows whether it has begun. `failed`: the last command was an action, which the robot
    took and reports as failed. It may have done a part of it. `path`: the places to which the robot's
    own manager sends it, in turn. `paused`: the robot is paused and waits for a resume. `taken`: the
    last command, as (id, attempt), that the robot or its manager had received and not refused before
    this reading. It is (0, 0) for none. `busy`: the driver has not sent the last command yet, because
    the robot still has the order of an earlier one. The driver cancels that order, once for each
    attempt.
    """

    at: Pose
    battery: float
    moving: bool | None = None
    charging: bool | None = None
    completed: str | None = None
    fault: str = ""
    taken_out: str = ""
    said_at: float | None = None
    refused: str = ""
    unanswered: bool = False
    path: tuple[Pose, ...] | None = None
    paused: bool | None = None
    taken: tuple[int, int] = (0, 0)
    busy: bool = False
    failed: str = ""


Doing = Literal["navigate", "dock", "localize", "act", "stop", "pause", "resume"]


class RobotCommand(msgspec.Struct, frozen=True):
    """A command to the robot. A driver sends it once for each (`id`, `attempt`).

    `of`: the number of the stopped command, if `doing` is `stop`. `activity`, `description`: the
    action, if `doing` is `act`.
    """

    id: int
    doing: Doing
    attempt: int = 1
    goal: Goal | None = None
    of: int = 0
    activity: str = ""
    description: str = "{}"


class RobotOutputs(msgspec.Struct, frozen=True):
    """The command that the robot must carry out. With None the driver sends nothing."""

    command: RobotCommand | None = None


Order = Navigate | Localize | Act | Stop | LightAnswer

Event = Union[  # noqa: UP007
    Sampled[RobotSample],
    IoFailed,
    RivalSeen,
    OperatorReset,
    Attended,
    MemoryKept,
    MemoryNotKept,
    Order,
    PadHeard,
]

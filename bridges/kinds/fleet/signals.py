"""The inputs and outputs of a robot's core.

All places here are on the robot's own map: metres, and radians counterclockwise. RMF gives its goals
on that map too, after the transform of `reference_coordinates`.
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
    """A destination of RMF. `name`: its waypoint, if that has a name. `dock`: the dock's name of a lane
    that ends in docking. `speed_limit`: m/s. `lift`: the lift in which the goal is."""

    at: Pose
    name: str = ""
    dock: str = ""
    speed_limit: float | None = None
    lift: str = ""


class Navigate(msgspec.Struct, frozen=True):
    """RMF's navigate: drive to this goal. `id`: our number of the command, which never repeats."""

    id: int
    goal: Goal


class Localize(msgspec.Struct, frozen=True):
    """RMF's localize: the robot left a lift at another floor, about here."""

    id: int
    goal: Goal


class Act(msgspec.Struct, frozen=True):
    """RMF's execute_action. `description`: its JSON object, as text."""

    id: int
    category: str
    description: str = "{}"


class Stop(msgspec.Struct, frozen=True):
    """RMF's stop, or the end of an activity that RMF has given up. `of`: the command's number."""

    id: int
    of: int


Says = Literal["continue", "wait", "pause", "resume", "stay", "error"]


class LightAnswer(msgspec.Struct, frozen=True):
    """An answer of RMF's traffic light about this path and checkpoint.

    `continue`, `wait`: the moving robot may pass its next checkpoint, or must wait there. `pause`: it
    must stand at once. `resume`, `stay`: the standing robot may go on, or must stay. `error`: the
    robot is where RMF has not let it go. Source: EasyTrafficLight.hpp of open-rmf/rmf_ros2.
    """

    path: int
    checkpoint: int
    says: Says


class PadHeard(msgspec.Struct, frozen=True):
    """A charger's state names this robot. `error`: its error text; "" without an error."""

    charger: str
    charging: bool
    error: str = ""


class RobotSample(msgspec.Struct, frozen=True):
    """One reading of a robot. None: the maker's interface does not tell.

    `battery`: a fraction of 1, as it was read. `completed`: the command that the robot calls
    completed; "" for none. `fault`: the robot's own fault. `taken_out`: the reason why it takes no
    orders (manual mode, teaching). `said_at`: the robot's own time or counter of this reading.
    `refused`: the manager's refusal of the last command. `unanswered`: the last command was an
    action, and nobody knows whether it has begun. `path`: the places that its own manager sends it to,
    in turn. `paused`: it waits for a resume.
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


Doing = Literal["navigate", "dock", "localize", "act", "stop", "pause", "resume"]


class RobotCommand(msgspec.Struct, frozen=True):
    """A command to the robot. A driver sends it once for each (`id`, `attempt`).

    `of`: for a stop, the number of the stopped command. `activity`, `description`: for an act.
    """

    id: int
    doing: Doing
    attempt: int = 1
    goal: Goal | None = None
    of: int = 0
    activity: str = ""
    description: str = "{}"


class RobotOutputs(msgspec.Struct, frozen=True):
    """The command that the robot shall carry out; None leaves the robot alone."""

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

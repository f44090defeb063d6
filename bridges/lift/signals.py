"""What a lift's driver and its core say to each other in one scan, and the core's events."""

from enum import Enum, StrEnum

import msgspec

from bridges.core.decision import IoFailed, OperatorReset, RivalSeen, Sampled


class Door(Enum):
    """What the door contacts say at one instant.

    With two contacts: OPEN, CLOSED, BETWEEN (neither) or BOTH (a fault). With one that proves open:
    OPEN or NOT_OPEN. With one that proves closed: CLOSED or NOT_CLOSED. Where the door is a number,
    one that means nothing is UNKNOWN (a fault).
    """

    OPEN = "open"
    CLOSED = "closed"
    BETWEEN = "between"
    BOTH = "both"
    NOT_OPEN = "not open"
    NOT_CLOSED = "not closed"
    UNKNOWN = "unknown"


class Motion(Enum):
    """What the motion lines say; CONTRADICTORY is a code that cannot be (up and down at once)."""

    STOPPED = "stopped"
    UP = "up"
    DOWN = "down"
    MOVING = "moving"
    CONTRADICTORY = "contradictory"


class Hazard(StrEnum):
    """Inputs that take the lift away from RMF. The names are the YAML's signal names."""

    FIRE = "fire_alarm"
    CODE_BLUE = "code_blue"
    EARTHQUAKE = "earthquake"
    EMERGENCY = "emergency"
    OUT_OF_SERVICE = "out_of_service"
    MANUAL = "manual_mode"
    OVERLOAD = "overload"


class LiftSample(msgspec.Struct, frozen=True):
    """Every input of one lift, decoded but not debounced.

    `level`: the landing that the floor code names, None for no code (between floors).
    `code_fault`: "" or why the code cannot be (illegal, two of one-hot, parity). `floor_valid`: the
    code means something now; while it does not, the car may go anywhere unseen.
    `motion`, `agv`, `rear_door`: None where not wired; `agv` None also while its line means nothing.
    """

    level: str | None
    door: Door
    code_fault: str = ""
    rear_door: Door | None = None
    motion: Motion | None = None
    agv: bool | None = None
    hazards: frozenset[Hazard] = frozenset()
    floor_valid: bool = True


class Side(Enum):
    """Which of the car's doors."""

    FRONT = "front"
    REAR = "rear"


class Stop(msgspec.Struct, frozen=True):
    """One of RMF's floors of this lift: the landing that the floor code names, and the car's door."""

    level: str
    side: Side = Side.FRONT


class LiftOutputs(msgspec.Struct, frozen=True):
    """Every output of one lift. The default is all off.

    `call`: the level (landing) whose call is asserted. `hold_door`: the door whose open command is.
    """

    agv_request: bool = False
    call: str | None = None
    hold_door: Side | None = None


class Requested(msgspec.Struct, frozen=True):
    """A LiftRequest for AGV or HUMAN mode that is ours, well formed and for a floor we serve."""

    session_id: str
    agv: bool
    destination: str


class Ended(msgspec.Struct, frozen=True):
    """A LiftRequest for END_SESSION, whatever its other fields say."""

    session_id: str


Event = Sampled[LiftSample] | IoFailed | RivalSeen | OperatorReset | Requested | Ended

"""A lift's readings (samples), outputs and events, which are the interface of its decision core."""

from enum import Enum, StrEnum

import msgspec

from bridges.kinds.shared.decision import (
    IoFailed,
    MemoryKept,
    MemoryNotKept,
    OperatorReset,
    RivalSeen,
    Sampled,
)


class DoorReading(Enum):
    """The reading of the door contacts at one instant.

    With two contacts: OPEN, CLOSED, BETWEEN or BOTH (a fault). With only the contact for open: OPEN or
    NOT_OPEN. With only the contact for closed: CLOSED or NOT_CLOSED. Some doors are read as a number in
    place of contacts. UNKNOWN (a fault) means that the YAML does not list the number.
    """

    OPEN = "open"
    CLOSED = "closed"
    BETWEEN = "between"
    BOTH = "both"
    NOT_OPEN = "not open"
    NOT_CLOSED = "not closed"
    UNKNOWN = "unknown"


class Motion(Enum):
    """The reading of the motion lines. CONTRADICTORY: the lines cannot all be true, such as up and down
    at once."""

    STOPPED = "stopped"
    UP = "up"
    DOWN = "down"
    MOVING = "moving"
    CONTRADICTORY = "contradictory"


class Hazard(StrEnum):
    """The hazard inputs of a lift. Their values are the YAML's signal names."""

    FIRE = "fire_alarm"
    CODE_BLUE = "code_blue"
    EARTHQUAKE = "earthquake"
    EMERGENCY = "emergency"
    OUT_OF_SERVICE = "out_of_service"
    MANUAL = "manual_mode"
    OVERLOAD = "overload"


class LiftSample(msgspec.Struct, frozen=True):
    """Every input of one lift, decoded but not debounced.

    `level`: the landing that the floor code names; None if there is no code (between floors).
    `code_fault`: the reason why the code is illegal; "" if it is legal. A code is illegal if it is not
    listed, if its parity is wrong, or if two lines of a one-hot code are on. `floor_valid`: False while
    the lift marks the code as invalid; the car may then move to any floor without being seen. `motion`,
    `agv`, `rear_door`: None if not wired. `agv` is also None while the lift marks its line as invalid.
    """

    level: str | None
    door: DoorReading
    code_fault: str = ""
    rear_door: DoorReading | None = None
    motion: Motion | None = None
    agv: bool | None = None
    hazards: frozenset[Hazard] = frozenset()
    floor_valid: bool = True


class Side(Enum):
    """The car's front or rear door."""

    FRONT = "front"
    REAR = "rear"


class Stop(msgspec.Struct, frozen=True):
    """One of this lift's floors. `level`: the name of its landing in the floor code. `side`: the side
    of the door that serves it."""

    level: str
    side: Side = Side.FRONT


class LiftOutputs(msgspec.Struct, frozen=True):
    """Every output of one lift. By default all outputs are off.

    `call`: the landing whose call is energised. `hold_door`: the door whose open command is energised.
    """

    agv_request: bool = False
    call: str | None = None
    hold_door: Side | None = None


class LiftRequested(msgspec.Struct, frozen=True):
    """A well-formed LiftRequest for AGV or HUMAN mode, for this lift and one of its floors.

    `destination`: RMF's name of the floor; in HUMAN mode it may be "". `stamp`: the request_time (ns)
    by the sender's clock; 0 without a time.
    """

    session_id: str
    agv: bool
    destination: str
    stamp: int = 0


class EndRequested(msgspec.Struct, frozen=True):
    """A LiftRequest for END_SESSION, with any floor.

    `by_person`: a person sent this END with `rmf-bridge send` or `release`.
    """

    session_id: str
    stamp: int = 0
    by_person: bool = False


class FromAdapter(msgspec.Struct, frozen=True):
    """A robot's own request, which its fleet adapter has sent to RMF's supervisor."""

    asked: LiftRequested | EndRequested


Asked = LiftRequested | EndRequested | FromAdapter
"""The events that are made from requests."""

Event = (
    Sampled[LiftSample] | IoFailed | RivalSeen | OperatorReset | MemoryKept | MemoryNotKept | Asked
)

"""A door's readings (samples), outputs and events, which are the interface of its decision core."""

import msgspec

from bridges.kinds.shared.decision import Attended, IoFailed, OperatorReset, RivalSeen, Sampled


class DoorSample(msgspec.Struct, frozen=True):
    """Every input of one door, not debounced. True: the input is active, however it is wired. None: the
    input is not wired.

    `opened`, `closed`: the limit contacts of the fully open and the fully closed door. `obstruction`:
    somebody or something is in the doorway. `fire`: the fire alarm's contact. `lost`: the reason why
    the controller gave no position; "" if it gave one. `errors`: the faults that the controller itself
    reports.
    """

    opened: bool | None = None
    closed: bool | None = None
    obstruction: bool | None = None
    fire: bool | None = None
    lost: str = ""
    errors: tuple[str, ...] = ()


class DoorOutputs(msgspec.Struct, frozen=True):
    """Every output of one door. No output closes the door: the door operator closes it by itself.

    `hold_open`: the relay is on. `between_pulses`: the door is held, and the relay is off until the
    next pulse.
    """

    hold_open: bool = False
    between_pulses: bool = False


class OpenRequested(msgspec.Struct, frozen=True):
    """A requester wants the door open. `requester_id` is for the log only."""

    requester_id: str


class CloseRequested(msgspec.Struct, frozen=True):
    """A requester no longer wants the door open."""

    requester_id: str


Event = (
    Sampled[DoorSample]
    | IoFailed
    | RivalSeen
    | OperatorReset
    | Attended
    | OpenRequested
    | CloseRequested
)

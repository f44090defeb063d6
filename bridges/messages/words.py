"""RMF's messages as one line of text, for `watch`, `send` and the demo.

A word is the name of RMF's constant without its prefix, in lower case. For example, DOOR_OPEN is
`open`. Only the modes of a lift are in upper case, such as `AGV` for MODE_AGV. A number without a
constant is shown with a question mark, such as `7?`. Control characters are escaped, because names come
from the network.
"""

from collections.abc import Mapping
from enum import IntEnum
from typing import Final, Literal

from bridges.messages import definitions as d
from bridges.messages.stamps import in_seconds

WorkcellStated = d.DispenserState | d.IngestorState
WorkcellRequested = d.DispenserRequest | d.IngestorRequest
WorkcellResulted = d.DispenserResult | d.IngestorResult
Stated = d.LiftState | d.DoorState | d.ChargerState | WorkcellStated
Requested = d.LiftRequest | d.DoorRequest | d.ChargerRequest | d.ChargerCancel | WorkcellRequested
Named = Stated | Requested | WorkcellResulted
LONGEST_NAME: Final = 256
"""The maximum length (characters) of a name that we keep in memory or show. The limit is needed because
anybody can send a name of 1 MB."""
Kind = Literal["lift", "door", "charger", "dispenser", "ingestor"]
KINDS: Final[tuple[Kind, ...]] = ("lift", "door", "charger", "dispenser", "ingestor")
_NAMED: Final[Mapping[type, tuple[Kind, str]]] = {
    d.LiftState: ("lift", "lift_name"),
    d.LiftRequest: ("lift", "lift_name"),
    d.DoorState: ("door", "door_name"),
    d.DoorRequest: ("door", "door_name"),
    d.ChargerState: ("charger", "charger_name"),
    d.ChargerRequest: ("charger", "charger_name"),
    d.ChargerCancel: ("charger", "charger_name"),
    d.DispenserState: ("dispenser", "guid"),
    d.DispenserRequest: ("dispenser", "target_guid"),
    d.DispenserResult: ("dispenser", "source_guid"),
    d.IngestorState: ("ingestor", "guid"),
    d.IngestorRequest: ("ingestor", "target_guid"),
    d.IngestorResult: ("ingestor", "source_guid"),
}
"""The kind of the device that each type of message names, and the field that has the device's name."""


def printable(text: str) -> str:
    """Return the text on one line. Escape control characters, because a name from the network must not
    move the cursor."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def word(enum: type[IntEnum], value: int) -> str:
    """Return the constant's name without its prefix, such as `OPEN` for `DOOR_OPEN`. Return `7?` for a
    number without a constant."""
    try:
        return enum(value).name.split("_", 1)[-1]
    except ValueError:
        return f"{value}?"


def device(message: Named) -> str:
    """Return the device that a state, request or result names."""
    return str(getattr(message, _NAMED[type(message)][1]))


def kind(message: Named) -> Kind:
    """Return the kind of the device that a state, request or result names."""
    return _NAMED[type(message)][0]


def stamped_at(state: Stated) -> float:
    """Return the time of the hardware's reading, in seconds since the epoch. 0 means never."""
    match state:
        case d.LiftState():
            return in_seconds(state.lift_time)
        case d.DoorState():
            return in_seconds(state.door_time)
        case d.ChargerState():
            return in_seconds(state.charger_time)
        case d.DispenserState() | d.IngestorState():
            return in_seconds(state.time)


def condition(state: Stated) -> str:
    """Describe the state, such as `car at L1, door open, mode AGV` or `error: too hot`. Leave out the
    device's holder, which is the requester that has the device."""
    match state:
        case d.LiftState():
            return _lift_condition(state)
        case d.DoorState():
            return plain(d.DoorModeValue, state.current_mode.value)
        case d.ChargerState():
            return _charger_condition(state)
        case d.DispenserState() | d.IngestorState():
            return plain(d.WorkcellMode, state.mode)


def plain(enum: type[IntEnum], value: int) -> str:
    """Return the constant's name in lower case without its prefix, such as `open` for `DOOR_OPEN`.
    Return `7?` for a number without a constant."""
    return word(enum, value).lower()


def _lift_condition(state: d.LiftState) -> str:
    car = f"car at {state.current_floor}" if state.current_floor else "car at no known floor"
    if state.motion_state not in (d.LiftMotion.MOTION_STOPPED, d.LiftMotion.MOTION_UNKNOWN):
        car += f", going {plain(d.LiftMotion, state.motion_state)}"
    parts = [
        car,
        f"door {plain(d.LiftDoor, state.door_state)}",
        f"mode {word(d.LiftMode, state.current_mode)}",
    ]
    if state.destination_floor:
        parts.append(f"destination {state.destination_floor}")
    return printable(", ".join(parts))


def _charger_condition(state: d.ChargerState) -> str:
    said = plain(d.ChargerStateValue, state.state)
    if state.error_message:
        said += f": {state.error_message}"
    left_s = in_seconds(state.time_to_fully_charged)
    if left_s > 0:
        said += f", full in {left_s / 60:.0f} min"
    return printable(said)


def holder(state: Stated) -> str:
    """Return the device's holder. This is a lift's session, a charger's robot and request, or a
    workcell's queue. Return "" if the device has no holder."""
    match state:
        case d.LiftState():
            return printable(state.session_id)
        case d.DoorState():
            return ""
        case d.ChargerState():
            robot = f"{state.robot_fleet}/{state.robot_name}" if state.robot_name else ""
            request = f"request {state.request_id}" if state.request_id else ""
            both = f"{robot} ({request})" if robot and request else robot or request
            return printable(both)
        case d.DispenserState() | d.IngestorState():
            return printable(", ".join(state.request_guid_queue))


def described(state: Stated) -> str:
    """Describe a state with the device's holder, such as `car at L1, door open, mode AGV, held by
    fleet/robot`."""
    who = holder(state)
    has = {"charger": "for", "lift": "held by"}.get(kind(state), "queue")
    return condition(state) + (f", {has} {who}" if who else "")


def request(message: Requested) -> str:
    """Describe a request, such as `mode AGV, car to L3, door open, for fleet/robot`."""
    match message:
        case d.LiftRequest():
            return _lift_request(message)
        case d.DoorRequest():
            mode = plain(d.DoorModeValue, message.requested_mode.value)
            return printable(f"door {mode}, for {message.requester_id}")
        case d.ChargerRequest():
            robot = f"{message.fleet_name}/{message.robot_name}"
            return printable(f"charge {robot} (request {message.request_id})")
        case d.ChargerCancel():
            return printable(f"cancel request {message.request_id}")
        case d.DispenserRequest() | d.IngestorRequest():
            verb = "dispense" if isinstance(message, d.DispenserRequest) else "ingest"
            return printable(f"{verb} {items(message)} (request {message.request_guid})")


def items(message: WorkcellRequested) -> str:
    """Describe the items of a request, such as `2 sheets in tray_a`, where `tray_a` is a
    compartment."""
    places = [(one, f" in {one.compartment_name}") for one in message.items]
    each = (
        f"{one.quantity} {one.type_guid}{where if one.compartment_name else ''}"
        for one, where in places
    )
    return printable(", ".join(each)) or "no items"


def result(message: WorkcellResulted) -> str:
    """Return RMF's word for a result, which is `acknowledged`, `success` or `failed`."""
    return plain(d.WorkcellStatus, message.status)


def _lift_request(message: d.LiftRequest) -> str:
    if message.request_type == d.LiftRequestType.REQUEST_END_SESSION:
        return printable(f"end the session of {message.session_id}")
    mode = word(d.LiftRequestType, message.request_type).removesuffix("_MODE")
    door = plain(d.LiftRequestDoor, message.door_state)
    where = f"car to {message.destination_floor}, door {door}"
    return printable(f"mode {mode}, {where}, for {message.session_id}")

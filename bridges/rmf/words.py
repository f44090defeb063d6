"""RMF's messages in one line of words each: what `watch`, `send` and the demo print.

The words are RMF's constants without their prefix (DOOR_OPEN is `OPEN`); a number that RMF does not
define is shown as the number. Names come from the network: nothing unprintable gets through.
"""

from enum import IntEnum

from bridges.rmf import definitions as d
from bridges.rmf.stamps import in_seconds

Stated = d.LiftState | d.DoorState | d.ChargerState
Requested = d.LiftRequest | d.DoorRequest | d.ChargerRequest | d.ChargerCancel


def printable(text: str) -> str:
    """The text with every control character spelt out, so that no name can move the cursor."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def word(enum: type[IntEnum], value: int) -> str:
    """`DOOR_OPEN` as `OPEN`; a number without a constant as `7?`."""
    try:
        return enum(value).name.split("_", 1)[1]
    except ValueError:
        return f"{value}?"


def device(message: Stated | Requested) -> str:
    """The device that a state or request is about, as RMF names it."""
    match message:
        case d.LiftState() | d.LiftRequest():
            return message.lift_name
        case d.DoorState() | d.DoorRequest():
            return message.door_name
        case _:
            return message.charger_name


def stamped_at(state: Stated) -> float:
    """When the hardware was read, in seconds since the epoch; 0 for never."""
    match state:
        case d.LiftState():
            return in_seconds(state.lift_time)
        case d.DoorState():
            return in_seconds(state.door_time)
        case d.ChargerState():
            return in_seconds(state.charger_time)


def condition(state: Stated) -> str:
    """What the device says of itself: `L1 OPEN AGV`, `MOVING`, `ERROR over temperature`."""
    match state:
        case d.LiftState():
            return _lift_condition(state)
        case d.DoorState():
            return word(d.DoorModeValue, state.current_mode.value)
        case d.ChargerState():
            return _charger_condition(state)


def _lift_condition(state: d.LiftState) -> str:
    words = [
        state.current_floor or "no-floor",
        word(d.LiftDoor, state.door_state),
        word(d.LiftMode, state.current_mode),
    ]
    if state.motion_state not in (d.LiftMotion.MOTION_STOPPED, d.LiftMotion.MOTION_UNKNOWN):
        words.append(f"going {word(d.LiftMotion, state.motion_state)}")
    if state.destination_floor:
        words.append(f"to {state.destination_floor}")
    return printable(" ".join(words))


def _charger_condition(state: d.ChargerState) -> str:
    words = [word(d.ChargerStateValue, state.state)]
    if state.error_message:
        words.append(state.error_message)
    left_s = in_seconds(state.time_to_fully_charged)
    if left_s > 0:
        words.append(f"full in {left_s / 60:.0f} min")
    return printable(" ".join(words))


def holder(state: Stated) -> str:
    """Whose the device is: a lift's session, a charger's request and robot; "" for nobody's."""
    match state:
        case d.LiftState():
            return printable(state.session_id)
        case d.DoorState():
            return ""
        case d.ChargerState():
            robot = f"{state.robot_fleet}/{state.robot_name}" if state.robot_name else ""
            return printable(" ".join(word for word in (state.request_id, robot) if word))


def request(message: Requested) -> str:
    """What is asked: `AGV_MODE to L3 door OPEN for fleet/robot`."""
    match message:
        case d.LiftRequest():
            return _lift_request(message)
        case d.DoorRequest():
            mode = word(d.DoorModeValue, message.requested_mode.value)
            return printable(f"{mode} for {message.requester_id}")
        case d.ChargerRequest():
            robot = f"{message.fleet_name}/{message.robot_name}"
            return printable(f"charge {robot} as {message.request_id}")
        case d.ChargerCancel():
            return printable(f"cancel {message.request_id}")


def _lift_request(message: d.LiftRequest) -> str:
    kind = word(d.LiftRequestType, message.request_type)
    if message.request_type == d.LiftRequestType.REQUEST_END_SESSION:
        return printable(f"{kind} of {message.session_id}")
    door = word(d.LiftRequestDoor, message.door_state)
    return printable(f"{kind} to {message.destination_floor} door {door} for {message.session_id}")

"""The tone of each value of RMF's states; that of a number which RMF does not define is `unknown`."""

from bridges.messages import definitions as d
from workbench.explain.timeline import Tone


def door(mode: int) -> Tone:
    """Of DoorState."""
    found: dict[int, Tone] = {
        d.DoorModeValue.MODE_CLOSED: "calm",
        d.DoorModeValue.MODE_MOVING: "works",
        d.DoorModeValue.MODE_OPEN: "open",
        d.DoorModeValue.MODE_OFFLINE: "wrong",
    }
    return found.get(mode, "unknown")


def lift_door(state: int) -> Tone:
    """Of LiftState's door."""
    found: dict[int, Tone] = {
        d.LiftDoor.DOOR_CLOSED: "calm",
        d.LiftDoor.DOOR_MOVING: "works",
        d.LiftDoor.DOOR_OPEN: "open",
    }
    return found.get(state, "unknown")


def motion(state: int) -> Tone:
    """Of LiftState's motion."""
    found: dict[int, Tone] = {
        d.LiftMotion.MOTION_STOPPED: "calm",
        d.LiftMotion.MOTION_UP: "works",
        d.LiftMotion.MOTION_DOWN: "works",
    }
    return found.get(state, "unknown")


def lift_mode(mode: int) -> Tone:
    """Of LiftState's mode."""
    found: dict[int, Tone] = {
        d.LiftMode.MODE_HUMAN: "calm",
        d.LiftMode.MODE_AGV: "works",
        d.LiftMode.MODE_FIRE: "wrong",
        d.LiftMode.MODE_OFFLINE: "wrong",
        d.LiftMode.MODE_EMERGENCY: "wrong",
    }
    return found.get(mode, "unknown")


def charger(state: int) -> Tone:
    """Of ChargerState."""
    found: dict[int, Tone] = {
        d.ChargerStateValue.CHARGER_IDLE: "calm",
        d.ChargerStateValue.CHARGER_ASSIGNED: "asks",
        d.ChargerStateValue.CHARGER_CHARGING: "works",
        d.ChargerStateValue.CHARGER_RELEASED: "calm",
        d.ChargerStateValue.CHARGER_ERROR: "wrong",
    }
    return found.get(state, "unknown")

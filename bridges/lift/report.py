"""What RMF is told about a lift: LiftState's content, from what is believed and who holds it."""

from typing import Any

import msgspec

from bridges.core.decision import Fault
from bridges.lift.drive import Session
from bridges.lift.limits import LiftLimits
from bridges.lift.sensing import View
from bridges.lift.signals import Hazard, Motion
from bridges.rmf.definitions import LiftDoor, LiftMode, LiftMotion

OFFLINE = frozenset({"INPUTS_NOT_FRESH", "OUTPUTS_NOT_WRITTEN", "TWO_NODES_FOR_ONE_DEVICE"})
"""Faults with which we can no longer speak for the lift."""


class LiftReport(msgspec.Struct, frozen=True):
    """LiftState without its name, floors and stamp, and what the status file says beside it.

    `floor`: RMF's name, "" when unknown. `read_at`: monotonic seconds, None before the first reading.
    """

    read_at: float | None
    floor: str
    destination: str
    door: LiftDoor
    motion: LiftMotion
    mode: LiftMode
    session: str
    faults: tuple[Fault, ...] = ()
    estimated: bool = False

    @property
    def open_at(self) -> str:
        """The floor at which the door is shown open, "" when it is not."""
        return self.floor if self.door is LiftDoor.DOOR_OPEN else ""

    def news(self) -> Any:
        """All but the age and the details of faults, which may differ with each reading."""
        shown = (self.floor, self.destination, self.door, self.motion, self.mode, self.session)
        return *shown, self.estimated, tuple(fault.code for fault in self.faults)


def report(
    session: Session | None,
    view: View,
    read_at: float | None,
    faults: tuple[Fault, ...],
    agv_requested: bool,
    hold_awaited: bool,
    limits: LiftLimits,
) -> LiftReport:
    """The state as it is shown now. `agv_requested` stands in where no AGV status is wired.

    `hold_awaited`: the door is to be held, and the relay for it still rests. It may stand open for
    its own dwell time, and would then close on the robot that was told that it is open.
    """
    destination = session.destination if session else ""
    floor = limits.floor_name(view.level, destination) if view.fresh and view.level else ""
    mode = _mode(view, faults, agv_requested)
    sound = mode is LiftMode.MODE_AGV and not faults
    door, estimated = _door(session, view, floor, sound, hold_awaited, limits)
    return LiftReport(
        read_at=read_at,
        floor=floor,
        destination=destination,
        door=door,
        motion=_motion(view, door),
        mode=mode,
        session=session.id if session else "",
        faults=faults,
        estimated=estimated,
    )


def _mode(view: View, faults: tuple[Fault, ...], agv_requested: bool) -> LiftMode:
    codes = {fault.code for fault in faults}
    if codes & {"FIRE", "FIRE_LATCHED"}:
        return LiftMode.MODE_FIRE
    if codes & OFFLINE:
        return LiftMode.MODE_OFFLINE
    if view.hazards & {Hazard.CODE_BLUE, Hazard.EARTHQUAKE, Hazard.EMERGENCY}:
        return LiftMode.MODE_EMERGENCY
    if view.hazards & {Hazard.OUT_OF_SERVICE, Hazard.MANUAL}:
        return LiftMode.MODE_OFFLINE
    agv = agv_requested if view.agv is None else view.agv
    return LiftMode.MODE_AGV if agv else LiftMode.MODE_HUMAN


def _door(
    session: Session | None,
    view: View,
    floor: str,
    sound: bool,
    hold_awaited: bool,
    limits: LiftLimits,
) -> tuple[LiftDoor, bool]:
    """The door to show, and whether it rests on an estimate."""
    if not view.fresh:
        return LiftDoor.DOOR_MOVING, False
    seen = [side for side in (view.front, view.rear) if side]
    if session and floor:
        seen = [view.door(limits.side(floor))]
    opened = [side for side in seen if side.open]
    if not opened:
        closed = all(side.closed for side in seen)
        estimated = closed and any(side.estimated for side in seen)
        return (LiftDoor.DOOR_CLOSED if closed else LiftDoor.DOOR_MOVING), estimated
    boarding = session is not None and not session.boarded
    ready = not hold_awaited and (not boarding or sound)
    if view.stopped and floor and ready:
        return LiftDoor.DOOR_OPEN, all(side.estimated for side in opened)
    return LiftDoor.DOOR_MOVING, False


def _motion(view: View, door: LiftDoor) -> LiftMotion:
    """From the motion lines; without them a car with an open door at a floor stands."""
    if not view.fresh:
        return LiftMotion.MOTION_UNKNOWN
    if view.motion is None:
        open_there = door is LiftDoor.DOOR_OPEN
        return LiftMotion.MOTION_STOPPED if open_there else LiftMotion.MOTION_UNKNOWN
    return {
        Motion.STOPPED: LiftMotion.MOTION_STOPPED,
        Motion.UP: LiftMotion.MOTION_UP,
        Motion.DOWN: LiftMotion.MOTION_DOWN,
    }.get(view.motion, LiftMotion.MOTION_UNKNOWN)

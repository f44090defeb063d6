"""A door's report to RMF, the log and the status file."""

from collections.abc import Iterator

import msgspec

from bridges.kinds.door.memory import (
    DoorLimits,
    DoorMemory,
    lost_at,
    opening_ends_at,
    rivalled,
    too_long_at,
    travel_ends_at,
    unwritten_at,
)
from bridges.kinds.door.sensing import BelievedDoor, released_by_fire
from bridges.kinds.shared.debounce import unsteady
from bridges.kinds.shared.decision import AlarmInputs, Fault
from bridges.messages.definitions import DoorModeValue


class DoorReport(msgspec.Struct, frozen=True):
    """The door's state for RMF and the status file.

    `hold`: we hold the door open. With a pulsed relay, `hold` is True between two pulses too.
    `estimated`: no contact proves `mode`. `waits`: the reason why the door is not open although RMF
    wants the door open; otherwise "". `alarm`: the fire input, for the fleets.
    """

    mode: DoorModeValue
    read_at: float | None = None
    faults: tuple[Fault, ...] = ()
    hold: bool = False
    estimated: bool = False
    waits: str = ""
    alarm: AlarmInputs = AlarmInputs()

    def news(self) -> object:
        """Return the report without its age, and without `waits` and `alarm`. DoorState has no field
        for these two."""
        return self.mode, self.faults, self.hold, self.estimated


def report(memory: DoorMemory, view: BelievedDoor, now: float, limits: DoorLimits) -> DoorReport:
    """Report the present state of the door."""
    mode = _mode(memory, view, now, limits)
    return DoorReport(
        mode=mode,
        read_at=memory.senses.read_at,
        faults=tuple(_faults(memory, view, now, limits)),
        hold=memory.held,
        estimated=bool(view.estimated & _PROOFS.get(mode, frozenset())),
        waits=_waits(memory, view, mode, now, limits),
        alarm=AlarmInputs(frozenset({"fire"} if view.fire else ()), view.seen),
    )


def _waits(
    memory: DoorMemory, view: BelievedDoor, mode: DoorModeValue, now: float, limits: DoorLimits
) -> str:
    if memory.latched_at is None or mode is DoorModeValue.MODE_OPEN:
        return ""
    if rivalled(memory, now):
        return "until no other node publishes its states"
    if not view.fresh:
        return "for a reading"
    if now >= unwritten_at(memory, limits):
        return "for its outputs to be written"
    return "for the door to open" if view.seen else "for its contacts to be steady"


_PROOFS = {
    DoorModeValue.MODE_OPEN: frozenset({"opened"}),
    DoorModeValue.MODE_CLOSED: frozenset({"closed"}),
    DoorModeValue.MODE_MOVING: frozenset({"opened", "closed"}),
}
"""For each mode, the limit contacts without which the mode is only an estimate."""


def _mode(memory: DoorMemory, view: BelievedDoor, now: float, limits: DoorLimits) -> DoorModeValue:
    if rivalled(memory, now) or not view.fresh or now >= unwritten_at(memory, limits):
        return DoorModeValue.MODE_OFFLINE
    if not view.seen or released_by_fire(view, limits):
        return DoorModeValue.MODE_UNKNOWN
    if view.lost or (view.opened and view.closed):
        return DoorModeValue.MODE_UNKNOWN
    if view.opened:
        return DoorModeValue.MODE_OPEN
    if view.closed:
        return DoorModeValue.MODE_CLOSED
    if now >= travel_ends_at(memory, limits):
        return DoorModeValue.MODE_UNKNOWN
    return DoorModeValue.MODE_MOVING


def _faults(
    memory: DoorMemory, view: BelievedDoor, now: float, limits: DoorLimits
) -> Iterator[Fault]:
    """Yield all present faults, most serious first. No text contains a running number, because every
    change of a text is published."""
    if rivalled(memory, now):
        yield Fault("TWO_NODES_FOR_ONE_DEVICE", "another node publishes states of this door")
    if not view.fresh:
        yield from _silence(memory, limits)
    else:
        if now >= unwritten_at(memory, limits):
            yield Fault("OUTPUTS_NOT_WRITTEN", memory.io_failure)
        yield from _hazards(memory, view, limits)
        yield from _contradictions(memory, view, now, limits)
    if now >= too_long_at(memory, limits):
        yield Fault(
            "DOOR_OPEN_TOO_LONG", f"RMF has held the door for more than {limits.t.max_hold_s} s"
        )
    if now >= lost_at(memory, limits):
        lost_s = limits.t.supervisor_lost_s
        yield Fault(
            "SUPERVISOR_LOST",
            f"no node has published door_requests for {lost_s} s, so the hold has ended",
        )


def _silence(memory: DoorMemory, limits: DoorLimits) -> Iterator[Fault]:
    if memory.io_failure:
        yield Fault("COMMUNICATION_LOST", memory.io_failure)
    elif memory.senses.read_at is not None:
        yield Fault("COMMUNICATION_LOST", f"no reading for {limits.t.stale_after_s} s")


def _hazards(memory: DoorMemory, view: BelievedDoor, limits: DoorLimits) -> Iterator[Fault]:
    if view.fire:
        done = "held open" if limits.on_fire == "open" else "released"
        is_so = "is" if memory.unwritten_since is None else "must be"
        yield Fault("FIRE_ALARM", f"the door {is_so} {done}")
    if view.chattering:
        yield Fault("HAZARD_INPUTS_UNSTEADY", unsteady(view.chattering))
    if memory.closing and memory.held and memory.latched_at is None and view.obstructed:
        yield Fault("DOOR_OBSTRUCTED", "held open after CLOSE while the doorway is not clear")
    if view.errors:
        yield Fault("DOOR_CONTROLLER_FAULT", "; ".join(view.errors))


def _contradictions(
    memory: DoorMemory, view: BelievedDoor, now: float, limits: DoorLimits
) -> Iterator[Fault]:
    if view.seen and view.opened and view.closed:
        yield Fault("DOOR_CONTACTS_CONTRADICT", "the door reads open and closed")
    if view.restless:
        yield Fault("DOOR_CONTACTS_UNSTEADY", unsteady(view.restless))
    if view.lost:
        yield Fault("DOOR_POSITION_UNKNOWN", view.lost)
    if now >= travel_ends_at(memory, limits):
        yield Fault("DOOR_TRAVEL_TIMEOUT", f"between its end positions for {limits.t.travel_s} s")
    if now >= opening_ends_at(memory, limits):
        yield Fault("DOOR_OPENING_FAULT", f"held, but not open after {limits.t.open_timeout_s} s")

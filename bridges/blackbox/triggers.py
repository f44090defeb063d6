"""When a recording is to be made of a daemon, from its entries. Pure.

- a fault appears (a hazard is one: it keeps the device from RMF);
- a request is refused, other than what every handover and start refuse;
- somebody has waited longer than `waiting_s` for what was requested;
- the daemon says that a defect ends it.
The same cause at the same subject counts once in AGAIN_S.
"""

from collections.abc import Iterator
from typing import Final

from bridges.blackbox.entries import AnyEntry, Died, Forgotten, Known, Spoken, Step
from bridges.blackbox.incident import Note
from bridges.blackbox.trees import Tree
from bridges.kinds.shared.decision import EXPECTED
from bridges.kinds.shared.durations import AGES_AGO
from bridges.messages import cdr
from bridges.messages.definitions import (
    ChargerState,
    ChargerStateValue,
    DoorModeValue,
    DoorRequest,
    DoorState,
    LiftDoor,
    LiftRequest,
    LiftRequestType,
    LiftState,
    Message,
)
from bridges.messages.releases import RELEASES
from bridges.messages.rihs01 import MESSAGES

AGAIN_S: Final = 600.0
GONE_S: Final = 10.0
"""A request is repeated at 1 Hz; after this long without a repeat it has been given up."""
MOST_WAITING: Final = 1000

FAULT, REFUSED, WAITING, DIED = "FAULT", "REFUSED", "WAITING", "DIED"


class Triggers:
    """Why to record one run of a daemon. `waiting_s`: a wait this long (s) is a reason."""

    def __init__(self, waiting_s: float) -> None:
        self._faults: dict[str, set[str]] = {}
        self._noted: dict[tuple[str, str, str], float] = {}
        self._waits = Waits(waiting_s)

    def take(self, entry: AnyEntry) -> list[Note]:
        """Why a recording is to be made now; empty if nothing is new."""
        return [note for note in self._all(entry) if self._is_new(note)]

    def _all(self, entry: AnyEntry) -> Iterator[Note]:
        if isinstance(entry, Step):
            yield from self._step(entry)
        elif isinstance(entry, Known):
            report = entry.report if isinstance(entry.report, dict) else {}
            self._faults[entry.subject] = set(_codes(report.get("faults")))
        elif isinstance(entry, Forgotten):
            self._faults.pop(entry.subject, None)
        elif isinstance(entry, Died):
            yield Note(entry.at, DIED, entry.reason)
        elif isinstance(entry, Spoken):
            yield from self._waits.take(entry)

    def _step(self, step: Step) -> Iterator[Note]:
        for faults in step.faults:
            codes, before = _codes(faults), self._faults.get(step.subject, set())
            for code, detail in codes.items():
                if code not in before:
                    yield Note(
                        step.at, FAULT, f"{code}: {detail}" if detail else code, step.subject
                    )
            self._faults[step.subject] = set(codes)
        if step.refused and step.refused.partition(": ")[0] not in EXPECTED:
            yield Note(step.at, REFUSED, step.refused, step.subject)

    def _is_new(self, note: Note) -> bool:
        key = (note.code, note.subject, note.text.partition(":")[0])
        last = self._noted.get(key, AGES_AGO)
        if note.at < last + AGAIN_S:
            return False
        if len(self._noted) > MOST_WAITING:
            self._noted.clear()
        self._noted[key] = note.at
        return True


def _codes(faults: Tree) -> dict[str, str]:
    """Code -> detail of the faults in a report."""
    listed = faults if isinstance(faults, list) else []
    found = [fault for fault in listed if isinstance(fault, dict)]
    return {str(fault.get("code")): str(fault.get("detail", "")) for fault in found}


class Waits:
    """Who waits for what, by the messages alone.

    A request waits until a state shows what was requested. One that is no longer repeated has been
    given up.
    """

    def __init__(self, waiting_s: float) -> None:
        self._waiting_s = waiting_s
        self._since: dict[tuple[str, ...], tuple[float, float]] = {}

    def take(self, spoken: Spoken) -> Iterator[Note]:
        """Take one message; gives who has just waited for too long."""
        kind, release = MESSAGES.get(spoken.type), RELEASES.get(spoken.release)
        if kind is None or release is None:
            return
        try:
            message = cdr.decode(kind, spoken.cdr, release)
        except cdr.CdrError:
            return
        if wanted := _wanted(message):
            yield from self._want(wanted, spoken.at)
        for met in _met(message, list(self._since)):
            self._since.pop(met, None)

    def _want(self, wanted: tuple[str, ...], now: float) -> Iterator[Note]:
        since, heard_at = self._since.pop(wanted, (now, now))
        since = since if now < heard_at + GONE_S else now
        if len(self._since) >= MOST_WAITING:
            self._since.pop(next(iter(self._since)))
        if now >= since + self._waiting_s:
            device, who, what = wanted[0], wanted[1], wanted[-1]
            yield Note(now, WAITING, f"{who} has waited for {what} for {now - since:.0f} s", device)
            return
        self._since[wanted] = (since, now)


def _wanted(message: Message) -> tuple[str, ...] | None:
    """(device, who, what) of a request that wants something."""
    match message:
        case LiftRequest():
            if message.request_type == LiftRequestType.REQUEST_END_SESSION:
                return None
            return (message.lift_name, message.session_id, message.destination_floor)
        case DoorRequest():
            if message.requested_mode.value != DoorModeValue.MODE_OPEN:
                return None
            return (message.door_name, message.requester_id, "OPEN")
        case ChargerState(state=ChargerStateValue.CHARGER_ASSIGNED):  # its request comes once
            return (message.charger_name, message.request_id, "CHARGING")
    return None


def _met(message: Message, waiting: list[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """Those waits that are over."""
    match message:
        case LiftState():
            return [w for w in waiting if w[0] == message.lift_name and _rides(message, w)]
        case LiftRequest(request_type=LiftRequestType.REQUEST_END_SESSION):
            return [w for w in waiting if w[:2] == (message.lift_name, message.session_id)]
        case LiftRequest():
            own = (message.lift_name, message.session_id)
            return [w for w in waiting if w[:2] == own and w[2] != message.destination_floor]
        case DoorState():
            opened = message.current_mode.value == DoorModeValue.MODE_OPEN
            return [w for w in waiting if w == (message.door_name, w[1], "OPEN") and opened]
        case DoorRequest():
            closes = message.requested_mode.value == DoorModeValue.MODE_CLOSED
            own = (message.door_name, message.requester_id)
            return [w for w in waiting if w[:2] == own and closes]
        case ChargerState():
            waits = message.state == ChargerStateValue.CHARGER_ASSIGNED
            own = (message.charger_name, message.request_id)
            return [w for w in waiting if w[0] == own[0] and not (waits and w[:2] == own)]
    return []


def _rides(state: LiftState, wanted: tuple[str, ...]) -> bool:
    """Does the state show what was requested? (RMF looks at session, floor and door.)"""
    there = (state.session_id, state.current_floor) == wanted[1:]
    return there and state.door_state == LiftDoor.DOOR_OPEN

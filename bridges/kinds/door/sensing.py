"""The core's belief about a door's inputs: debounce, age, and estimates for contacts that are not
wired.

Rules:
DOOR-SENSING-1. A change of an input counts when it has lasted for the signal's debounce. The end of a
   fire alarm or of an obstruction counts when it has lasted for `hazard_clear_s`. Before the input of a
   hazard has settled once, a single reading of the hazard counts.
DOOR-SENSING-2. After `stale_after_s` without a reading all inputs are unknown again, because the door
   may have moved. After a shorter gap the values stay, and a running debounce starts again. Only the
   debounce of a hazard's begin goes on, so that a bus that fails again and again hides no hazard. If a
   limit contact does not settle within its debounce and `RESTLESS_S`, the door's position is unknown.
   If the input of a hazard does not settle within that time, the hazard is present, because a contact
   that chatters may show a fire or a person.
DOOR-SENSING-3. If the YAML sets `feedback: estimated`, a missing limit contact is estimated from the
   time for which the relay has been on or off. A failed read or write restarts that time. With pulses
   DOOR-PULSES-3 holds too.
DOOR-SENSING-4. If a controller reports that it does not know the door's position (`lost`), the report
   counts at once, without debounce.
"""

from collections.abc import Iterator

import msgspec
from msgspec.structs import replace

from bridges.kinds.door.memory import Contact, DoorLimits, DoorSenses
from bridges.kinds.door.signals import DoorSample
from bridges.kinds.shared.debounce import fear, forget, settle
from bridges.kinds.shared.durations import NEVER

SIGNALS = ("opened", "closed", "obstruction", "fire")
LIMITS = ("opened", "closed")
HAZARDS = ("obstruction", "fire")


class BelievedDoor(msgspec.Struct, frozen=True):
    """The inputs as the core believes them at one instant.

    `fresh`: the last reading is younger than `stale_after_s`. `seen`: the reading is fresh and each
    input has settled, so the door's position is known. `restless`: the limit contacts that have kept
    changing for too long. `chattering`: the same for the inputs of hazards. `estimated`: the end
    positions that have no contact. `changes_at`: the next time (s) when these values may change without
    a reading, or when a reading may change them. `lost`, `errors`: see DoorSample.
    """

    fresh: bool
    seen: bool
    opened: bool
    closed: bool
    obstructed: bool
    fire: bool
    estimated: frozenset[str]
    changes_at: float
    restless: tuple[str, ...] = ()
    chattering: tuple[str, ...] = ()
    lost: str = ""
    errors: tuple[str, ...] = ()


def take(senses: DoorSenses, sample: DoorSample, now: float, limits: DoorLimits) -> DoorSenses:
    """Add one reading to the senses."""
    if not is_fresh(senses, now, limits):
        senses = DoorSenses()
    contacts: dict[str, Contact] = {}
    for signal in SIGNALS:
        before: Contact | None = getattr(senses, signal)
        seen: bool | None = getattr(sample, signal)
        contact = settle(before, seen, now, _hold_s(before, seen, signal, limits))
        if signal in HAZARDS:
            contact = fear(contact, now, limits.debounce.get(signal, 0.0))
        contacts[signal] = contact
    linked_since = now if senses.linked_since is None else senses.linked_since
    return DoorSenses(
        **contacts,
        read_at=now,
        linked_since=linked_since,
        lost=sample.lost,
        errors=sample.errors,
    )


def miss(senses: DoorSenses) -> DoorSenses:
    """Restart the debounce after a failed read, and the time from which the end positions are
    estimated."""
    return replace(
        senses,
        opened=forget(senses.opened),
        closed=forget(senses.closed),
        obstruction=forget(senses.obstruction, hazard=True),
        fire=forget(senses.fire, hazard=True),
        linked_since=None,
    )


def is_fresh(senses: DoorSenses, now: float, limits: DoorLimits) -> bool:
    """Return whether the last reading is younger than `stale_after_s`."""
    return senses.read_at is not None and now < senses.read_at + limits.t.stale_after_s


def look(
    senses: DoorSenses, held: bool, held_since: float, now: float, limits: DoorLimits
) -> BelievedDoor:
    """Decide which inputs to believe now. The relay has been on or in pulses (if `held`), or off, since
    `held_since`; NEVER if no pulse was written yet."""
    opened, closed = _believed(senses.opened), _believed(senses.closed)
    opened_at, closed_at = _estimates(senses, held, held_since, limits)
    guessed = frozenset(s for s in LIMITS if _unwired(getattr(senses, s)))
    fresh = is_fresh(senses, now, limits)
    restless = tuple(s for s in LIMITS if now >= _restless_at(senses, s, limits))
    return BelievedDoor(
        fresh=fresh,
        seen=fresh and not restless and all(_settled(getattr(senses, s)) for s in SIGNALS),
        opened=opened or ("opened" in guessed and now >= opened_at and not closed),
        closed=closed or ("closed" in guessed and now >= closed_at and not opened),
        obstructed=_feared(senses.obstruction),
        fire=_feared(senses.fire),
        estimated=guessed,
        changes_at=min(_changes(senses, limits, now, opened_at, closed_at), default=NEVER),
        restless=restless,
        chattering=tuple(s for s in HAZARDS if now >= _chatters_at(senses, s, limits)),
        lost=senses.lost,
        errors=senses.errors,
    )


def released_by_fire(view: BelievedDoor, limits: DoorLimits) -> bool:
    """Return whether a fire alarm has released the hold."""
    return view.fresh and view.fire and limits.on_fire == "release"


def _hold_s(before: Contact | None, seen: bool | None, signal: str, limits: DoorLimits) -> float:
    """Return the debounce (s) for the value `seen`. The end of a hazard has a longer debounce than its
    start."""
    hold_s = limits.debounce.get(signal, 0.0)
    clearing = signal in HAZARDS and seen is False and before is not None and before.value
    return max(hold_s, limits.t.hazard_clear_s) if clearing else hold_s


def _unwired(contact: Contact | None) -> bool:
    return contact is not None and contact.candidate is None


def _settled(contact: Contact | None) -> bool:
    return contact is not None and contact.steady_at is not None


def _restless_at(senses: DoorSenses, signal: str, limits: DoorLimits) -> float:
    contact: Contact | None = getattr(senses, signal)
    return NEVER if contact is None else contact.restless_at(limits.debounce.get(signal, 0.0))


def _chatters_at(senses: DoorSenses, signal: str, limits: DoorLimits) -> float:
    """Return the time when the input of a hazard has kept changing for so long that even the hazard's
    end would have settled."""
    contact: Contact | None = getattr(senses, signal)
    hold_s = max(limits.debounce.get(signal, 0.0), limits.t.hazard_clear_s)
    return NEVER if contact is None else contact.restless_at(hold_s)


def _believed(contact: Contact | None) -> bool:
    return contact is not None and contact.value is True


def _feared(contact: Contact | None) -> bool:
    """Return whether the hazard is present. If the hazard's input has never settled, a single reading
    counts."""
    if contact is None:
        return False
    return bool(contact.value if _settled(contact) else contact.candidate)


def _estimates(
    senses: DoorSenses, held: bool, held_since: float, limits: DoorLimits
) -> tuple[float, float]:
    """Return two times: the time from which a door without contacts counts as open, and the time from
    which it counts as closed. A held door never counts as closed, and a released door never counts
    as open (NEVER)."""
    if not limits.estimated or senses.linked_since is None:
        return NEVER, NEVER
    since = max(held_since, senses.linked_since)
    delay_s = NEVER if limits.t.open_delay_s is None else limits.t.open_delay_s
    return (since + delay_s, NEVER) if held else (NEVER, since + limits.t.travel_s)


def _changes(
    senses: DoorSenses, limits: DoorLimits, now: float, *estimates: float
) -> Iterator[float]:
    """Yield the times (s) when the reading goes stale, when an estimate is due, and when a contact
    settles or counts as restless."""
    stale_at = NEVER if senses.read_at is None else senses.read_at + limits.t.stale_after_s
    due = [stale_at, *estimates, *(_restless_at(senses, s, limits) for s in SIGNALS)]
    due += [_chatters_at(senses, s, limits) for s in HAZARDS]
    for signal in SIGNALS:
        contact: Contact | None = getattr(senses, signal)
        if contact is not None:
            due.append(contact.due_at(_hold_s(contact, contact.candidate, signal, limits)))
    yield from (at for at in due if at > now)

"""The core's belief about a lift's inputs: debounce, age, and contradictions.

Rules:
LIFT-SENSING-1. A change of an input counts when it has lasted for the signal's debounce. The end of a
   hazard counts when it has lasted for `hazard_clear_s`. All inputs are unknown until every input has
   settled once. At the start this is no fault. Later, an input may keep changing and not settle within
   its debounce and `RESTLESS_S`. All inputs are then unknown again. While the motion lines say that the
   car moves, a floor code that keeps changing makes only the floor unknown, because slow readings of a
   fast car show another floor each time.
LIFT-SENSING-2. After `stale_after_s` without a reading all inputs are unknown, because the car may be
   anywhere. After a shorter gap the values stay, and a running debounce starts again. Only the debounce
   of a hazard's begin goes on, so that a bus that fails again and again hides no hazard.
LIFT-SENSING-3. A floor code is believed only if the car can have reached that floor. The code is
   rejected if it skips floors faster than a car travels. That time runs from the last reading of the
   trusted floor to the first reading of the new floor, without any debounce. With motion lines the code
   is also rejected if it changes while the car stands. After a rejection the position is unknown until
   the code shows the last trusted floor or another reachable floor, or until an operator resets the
   lift.
LIFT-SENSING-4. If the floor code is invalid (`valid_when`) for longer than its debounce, the car may
   move to any floor without being seen. Therefore the next valid floor code is believed.
LIFT-SENSING-5. A door is open when its contact for the open door says so. If a door has only one
   contact, its other end position is estimated from the door's travel time, and marked as an estimate.
   The travel begins when the door leaves its contact. A change of the contact that is shorter than its
   debounce interrupts the estimate, and does not begin the travel anew.
LIFT-SENSING-6. A car stands when the motion lines say so. Without motion lines the car always counts as
   standing.
"""

from collections.abc import Iterator, Sequence

import msgspec
from msgspec.structs import replace

from bridges.kinds.lift.memory import CarPosition, LiftLimits, LiftSenses
from bridges.kinds.lift.signals import DoorReading, Hazard, LiftSample, Motion, Side
from bridges.kinds.shared.debounce import RESTLESS_S, Settled, forget, settle
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import AGES_AGO, NEVER

HAZARDS = tuple(Hazard)

MOTION_MEMORY_S = 2.0
"""The time (s) after the car's last motion during which a new floor code is believed."""


class DoorSeen(msgspec.Struct, frozen=True):
    """One door's state as the core believes it. If neither `open` nor `closed` is True, the door counts
    as moving.

    `estimated`: no contact proves the state. `settles_at`: the time (s) from which the door counts as
    arrived at the end position that has no contact.
    """

    open: bool
    closed: bool
    estimated: bool = False
    settles_at: float = NEVER


class BelievedLift(msgspec.Struct, frozen=True):
    """The inputs as the core believes them at one instant.

    `blind`: the reason why no input is believed, "" if all inputs are believed. `settling`: some inputs
    have not settled since the start, and no input is restless. `restless`: an input keeps changing, so
    no input is believed. `level`: the landing, None when unknown. `level_settles`: the floor code is
    changing. `agv`: None if not wired. `changes_at`: the next time (s) when these values may change
    without a reading.
    """

    blind: str
    settling: bool
    restless: bool
    level: str | None
    level_settles: bool
    stopped: bool
    motion: Motion | None
    agv: bool | None
    front: DoorSeen
    rear: DoorSeen | None
    hazards: frozenset[Hazard]
    faults: tuple[Fault, ...]
    changes_at: float

    @property
    def fresh(self) -> bool:
        """Return whether the inputs can be believed."""
        return not self.blind

    def door(self, side: Side) -> DoorSeen:
        """Return the door on that side. A side without wires is never open."""
        if side is Side.FRONT:
            return self.front
        return self.rear or DoorSeen(open=False, closed=False)


def take(senses: LiftSenses, sample: LiftSample, now: float, limits: LiftLimits) -> LiftSenses:
    """Add one reading to the senses."""
    if now >= stale_at(senses, limits):
        senses = unsure(senses, now)
    hold = limits.debounce_s
    code = settle(senses.code, (sample.level, sample.code_fault), now, hold("floor"))
    return LiftSenses(
        read_at=now,
        code=code,
        doors=(
            settle(senses.doors[0], sample.door, now, hold("door")),
            settle(senses.doors[1], sample.rear_door, now, hold("rear_door")),
        ),
        motion=settle(senses.motion, sample.motion, now, hold("motion")),
        agv=settle(senses.agv, sample.agv, now, hold("agv_mode")),
        hazards={
            h: _settle_hazard(senses.hazards.get(h), h, h in sample.hazards, now, limits)
            for h in HAZARDS
        },
        position=_locate(senses.position, code, sample, now, limits),
    )


def read_again(senses: LiftSenses, now: float) -> LiftSenses:
    """Set the times of the last reading to `now`, because the same reading came again."""
    at, position = senses.read_at, senses.position
    seen_at = now if position.seen_at == at else position.seen_at
    moved_at = now if position.moved_at == at else position.moved_at
    position = replace(position, seen_at=seen_at, moved_at=moved_at)
    return replace(senses, read_at=now, position=position)


def gap(senses: LiftSenses, now: float) -> LiftSenses:
    """Restart the debounce after a failed read, because the car may have moved."""
    return LiftSenses(
        senses.read_at,
        forget(senses.code),
        (forget(senses.doors[0]), forget(senses.doors[1])),
        forget(senses.motion),
        forget(senses.agv),
        {h: forget(old, hazard=True) for h, old in senses.hazards.items()},
        replace(senses.position, moved_at=now),
    )


def unsure(senses: LiftSenses, now: float) -> LiftSenses:
    """Forget everything except the last landing, after a long time without a reading."""
    return LiftSenses(position=replace(senses.position, moved_at=now))


def trust(senses: LiftSenses) -> LiftSenses:
    """Trust the suspected floor, because an operator has reset the lift."""
    position = senses.position
    if position.suspect is None:
        return senses
    position = replace(position, trusted=position.suspect, suspect=None)
    return replace(senses, position=position)


def look(senses: LiftSenses, now: float, limits: LiftLimits) -> BelievedLift:
    """Decide which inputs to believe now."""
    stale = now >= stale_at(senses, limits)
    motion = senses.motion.value if senses.motion else None
    front = _door(senses.doors[0], now, limits)
    rear = _door(senses.doors[1], now, limits) if _wired(senses.doors[1]) else None
    hazards = frozenset(h for h, s in senses.hazards.items() if s.value)
    unsettled = tuple(_unsettled(senses, limits))
    torn = any(now >= wait.torn_at for wait in unsettled)
    due = [stale_at(senses, limits), front.settles_at, rear.settles_at if rear else NEVER]
    due.append(_code_torn_at(senses, limits))
    for wait in unsettled:
        due += [wait.due_at, wait.torn_at]
    return BelievedLift(
        blind=_blind(senses, unsettled, now, limits),
        settling=any(wait.new for wait in unsettled) and not torn,
        restless=torn and not stale,
        level=_level(senses, now, limits),
        level_settles=senses.code is not None and senses.code.candidate != senses.code.value,
        stopped=_stands(senses.motion),
        motion=motion,
        agv=senses.agv.value if senses.agv else None,
        front=front,
        rear=rear,
        hazards=frozenset() if stale else hazards,
        faults=() if stale else _faults(senses),
        changes_at=min((at for at in due if at > now), default=NEVER),
    )


def stale_at(senses: LiftSenses, limits: LiftLimits) -> float:
    """Return the time when the last reading becomes stale (s); -inf before the first reading."""
    return AGES_AGO if senses.read_at is None else senses.read_at + limits.t.stale_after_s


def _settle_hazard(
    before: Settled[bool] | None, hazard: Hazard, seen: bool, now: float, limits: LiftLimits
) -> Settled[bool]:
    return settle(before, seen, now, _hazard_hold_s(before, hazard, seen, limits))


def _hazard_hold_s(
    before: Settled[bool] | None, hazard: Hazard, seen: bool, limits: LiftLimits
) -> float:
    """Return the debounce (s) of a hazard input for the value `seen`. The end of a hazard has a longer
    debounce than its start."""
    hold_s = limits.debounce_s(hazard)
    clearing = before is not None and bool(before.value) and not seen
    return max(hold_s, limits.t.hazard_clear_s) if clearing else hold_s


def _locate(
    before: CarPosition,
    code: Settled[tuple[str | None, str]],
    sample: LiftSample,
    now: float,
    limits: LiftLimits,
) -> CarPosition:
    """Follow the car from floor to floor. A floor that the car cannot have reached is only
    suspected."""
    if sample.motion is not Motion.STOPPED:
        before = replace(before, moved_at=now)
    level = code.value[0] if code.value else None
    if level is None and not sample.floor_valid:
        return CarPosition(moved_at=before.moved_at)
    if level is None or level == before.suspect:
        return before
    if level == before.trusted:
        here = sample.level == level
        return replace(before, seen_at=now if here else before.seen_at, suspect=None)
    if _can_have_come(before, level, code.since, now, limits):
        return replace(before, trusted=level, seen_at=now, suspect=None)
    return replace(before, suspect=level)


def _can_have_come(
    before: CarPosition, level: str, since: float, now: float, limits: LiftLimits
) -> bool:
    """Return whether the car can have reached this landing, which the floor code has shown since
    `since`."""
    if before.trusted is None:
        return True
    memory_s = MOTION_MEMORY_S + limits.debounce_s("floor")
    if before.moved_at is None or now - before.moved_at > memory_s:
        return False
    skipped = limits.floors_between(level, before.trusted)
    return since - before.seen_at >= skipped * limits.t.floor_travel_min_s


def _level(senses: LiftSenses, now: float, limits: LiftLimits) -> str | None:
    """Return the landing, as far as the floor code is believed; None if it is not."""
    code = senses.code.value if senses.code else None
    if code is None or code[0] != senses.position.trusted or now >= _code_torn_at(senses, limits):
        return None
    return code[0]


def _code_torn_at(senses: LiftSenses, limits: LiftLimits) -> float:
    """Return the time (s) when the floor code counts as restless."""
    return NEVER if senses.code is None else senses.code.restless_at(limits.debounce_s("floor"))


def _stands(motion: Settled[Motion | None] | None) -> bool:
    """Return whether the car stands. If the motion lines have not settled yet, the first reading
    decides."""
    if motion is None:
        return False
    return (motion.candidate if motion.value is None else motion.value) in (None, Motion.STOPPED)


def _stands_since(motion: Settled[Motion | None] | None) -> float:
    """Return the time since which the motion lines do not say that the car moves; NEVER while it
    moves."""
    if motion is None or motion.value_since is None:
        return AGES_AGO
    return NEVER if motion.value in (Motion.UP, Motion.DOWN, Motion.MOVING) else motion.value_since


def _wired(seen: Settled[DoorReading | None] | None) -> bool:
    return seen is not None and seen.candidate is not None


def _door(seen: Settled[DoorReading | None] | None, now: float, limits: LiftLimits) -> DoorSeen:
    value = seen.value if seen else None
    if value in (DoorReading.OPEN, DoorReading.CLOSED):
        return DoorSeen(open=value is DoorReading.OPEN, closed=value is DoorReading.CLOSED)
    if seen is None or value not in (DoorReading.NOT_OPEN, DoorReading.NOT_CLOSED):
        return DoorSeen(open=False, closed=False)
    since = seen.since
    if seen.candidate == value and seen.value_since is not None:
        since = seen.value_since
    there_at = since + limits.t.door_travel_s
    if now < there_at:
        return DoorSeen(open=False, closed=False, settles_at=there_at)
    return DoorSeen(
        open=value is DoorReading.NOT_CLOSED, closed=value is DoorReading.NOT_OPEN, estimated=True
    )


class Unsettled(msgspec.Struct, frozen=True):
    """An input that is changing, or has never settled (`new`).

    `due_at`: the time (s) when the input settles if it does not change again. `torn_at`: the time (s)
    when the input counts as restless, because it has kept changing.
    """

    name: str
    due_at: float
    torn_at: float
    new: bool = False


def _unsettled(senses: LiftSenses, limits: LiftLimits) -> Iterator[Unsettled]:
    hold = limits.debounce_s
    plain: list[tuple[str, Settled[object] | None]] = [
        ("floor", senses.code),
        ("door", senses.doors[0]),
        ("rear_door", senses.doors[1]),
        ("motion", senses.motion),
        ("agv_mode", senses.agv),
    ]
    for name, seen in plain:
        if seen is None or seen.torn_since is not None:
            wait = _wait(name, seen, hold(name), hold(name))
            if name == "floor" and not wait.new:
                torn_at = _stands_since(senses.motion) + hold(name) + RESTLESS_S
                wait = replace(wait, torn_at=max(wait.torn_at, torn_at))
            yield wait
    for h in HAZARDS:
        fear = senses.hazards.get(h)
        if fear is None or fear.torn_since is not None:
            hold_s = _hazard_hold_s(fear, h, bool(fear and fear.candidate), limits)
            yield _wait(h, fear, hold_s, max(hold_s, limits.t.hazard_clear_s))


def _wait(name: str, seen: Settled[object] | None, hold_s: float, most_s: float) -> Unsettled:
    if seen is None or seen.torn_since is None:
        return Unsettled(name, AGES_AGO, AGES_AGO)
    return Unsettled(
        name, seen.due_at(hold_s), seen.restless_at(most_s), new=seen.steady_at is None
    )


def _blind(
    senses: LiftSenses, unsettled: Sequence[Unsettled], now: float, limits: LiftLimits
) -> str:
    if senses.read_at is None:
        return "not read yet"
    if now >= stale_at(senses, limits):
        return f"no reading for {limits.t.stale_after_s:g} s"
    torn = [wait.name for wait in unsettled if wait.new or now >= wait.torn_at]
    return f"not steady: {', '.join(torn)}" if torn else ""


def _faults(senses: LiftSenses) -> tuple[Fault, ...]:
    found = []
    code = senses.code.value if senses.code else None
    if code and code[1]:
        found.append(Fault("FLOOR_CODE_ILLEGAL", code[1]))
    if code and code[0] is not None and code[0] == senses.position.suspect:
        found.append(
            Fault(
                "POSITION_LOST",
                f"the floor code shows {code[0]}, but no ride there from"
                f" {senses.position.trusted} was seen",
            )
        )
    for name, seen in zip(("door", "rear door"), senses.doors, strict=True):
        if seen and seen.value is DoorReading.BOTH:
            found.append(Fault("DOOR_CONTACTS_CONTRADICT", f"{name} reads open and closed"))
        if seen and seen.value is DoorReading.UNKNOWN:
            found.append(
                Fault(
                    "DOOR_CODE_ILLEGAL",
                    f"the YAML does not list the number of the {name}'s position",
                )
            )
    if senses.motion and senses.motion.value is Motion.CONTRADICTORY:
        found.append(Fault("MOTION_CONTRADICTORY", "the motion lines cannot all be true"))
    return tuple(found)

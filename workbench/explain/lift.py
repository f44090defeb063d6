"""Explain why a robot waits for a lift, in sentences from the lift's messages.

RMF's RequestLift checks only four fields of LiftState: the lift's name, session, floor and door
(rmf_ros2, RequestLift.cpp:322-326). The answer names the fields that do not match, the reason, and the
party that has to act next.
"""

from typing import Final

from bridges.observe.lift import NO_FLOOR, NOBODY
from bridges.observe.limits import FLAPS
from bridges.observe.requesters import DeviceRequester, Moment
from workbench.explain import answer as common
from workbench.explain import first_causes, lift_holder
from workbench.explain.answer import Answer
from workbench.explain.explanation import CheckedField
from workbench.explain.lift_facts import LiftFacts
from workbench.explain.lift_ungranted import (
    SETTLES_S,
    is_recorded,
    not_granted,
    not_passed_on,
    not_served,
)
from workbench.explain.phrases import TimePhrases, listed
from workbench.explain.rows import label

STANDS_S: Final = 5.0
"""Maximum time (s) that a fleet adapter needs to request the recall floor. The time begins when the
lift opens its door at the recall floor.

Only a fleet adapter that knows the recall floor sends this request.
"""
FLOOR_S: Final = 20.0
"""Maximum normal time (s) that a car needs from one floor to the next."""
ABANDONED_S: Final = 600.0
"""Time (s) for which a robot that has stopped asking without END is told of an idle lift."""
LATCHED: Final = "FIRE_LATCHED"
AWAY: Final = ("MANUAL", "OUT_OF_SERVICE")
"""Faults of a lift in OFFLINE mode that can be read."""
UNTIL: Final = "for the end of "
"""The beginning of the daemon's reason to wait if faults keep it from serving a session. Their codes
follow."""
EMERGENCIES: Final = {"CODE_BLUE": "code blue", "EARTHQUAKE": "earthquake alarm"}
"""Faults of a lift in EMERGENCY mode that have a contact of their own."""
ALARMS: Final = {"FIRE": "fire alarm", "EMERGENCY": "emergency (stop, code blue, earthquake)"}


def answer(
    lift: LiftFacts, clock: TimePhrases, around: common.OthersHeard, focus: str = ""
) -> Answer:
    """Explain the lift's state at the time of the last message. `focus` is the session to explain. With
    "", explain a session that waits."""
    if lift.last_state is None:
        return _with_askers(common.unheard(lift, around), lift, clock)
    stopped = common.stopped(lift, around, clock)
    if stopped is not None:
        _hold(stopped, lift, clock, then=True)
        if lift.session.value != NOBODY:
            stopped.say(lift.in_car(lift.session.value, clock.now))
        return _with_askers(stopped, lift, clock)
    claim = _in_question(lift, clock, focus)
    found = Answer(since=_begins(lift, claim))
    if focus and claim is None:
        told = "its last ride is shown below" if lift.kept else "no request from it was heard"
        found.say(f"{label(focus)} does not have {lift.name} and does not request it now: {told}.")
    if claim is not None and claim.ended is None and not lift.is_served(claim):
        where = claim.wants or "no floor"
        found.say(f"{claim.who} has waited {clock.since(claim.since)} for {lift.name} at {where}.")
    _hold(found, lift, clock)
    if len(lift.flaps(clock.now)) < FLAPS and (old := common.old_reading(lift, clock)):
        found.say(old)
    if claim is not None and claim.ended is None and not claim.human:
        found.asks, found.fields = claim.who, _fields(lift, claim, clock)
        found.notes += common.clock_of(claim, "lift")
    _why(found, lift, claim, clock, around)
    _others_wait(found, lift, claim, clock)
    return found


def _why(
    found: Answer,
    lift: LiftFacts,
    claim: DeviceRequester | None,
    clock: TimePhrases,
    around: common.OthersHeard,
) -> None:
    """Find the cause. Look first for a fault of the lift itself. Then look whether requests reach the
    lift. Then look at the holder of the lift."""
    silent = lift.not_passed_on(clock.now)
    recorded = is_recorded(lift, around)
    if silent is not None and not recorded and (silent.ended or lift.matches(silent)):
        silent = None
    if first_causes.two_nodes(found, lift, clock, around, "lift_states"):
        return
    if lift.mode.value in ALARMS:
        _alarm(found, lift, clock)
    elif first_causes.comes_and_goes(found, lift, clock) or first_causes.own_fault(
        found, lift, clock, around
    ):
        return
    elif lift.mode.value == "OFFLINE":
        kept = lift.session.value != NOBODY
        found.say(
            f"The lift has been in OFFLINE mode {clock.since(lift.mode.since)}: it is out of service or"
            f" cannot be read, and takes no robot.{f' {lift.keeps(clock.now)}' if kept else ''}"
        )
        _lets_in(found, lift, clock)
        if not first_causes.own_fault(found, lift, clock, around, codes=AWAY):
            found.acts("a person", "find out why it is out of service, or cannot be read")
    elif (unseen := lift.unseen(clock.now)) is not None:
        _states_do_not_arrive(found, lift, unseen, clock)
    elif silent is not None and (silent.ended or lift.serves(silent)):
        not_passed_on(found, lift, silent, clock, around)
    elif lift.session.value != NOBODY:
        if claim is not None and claim.ended is None and claim.who != lift.session.value:
            not_served(found, lift, claim)
        _held(found, lift, clock, around)
    elif claim is not None and claim.ended is None:
        not_granted(found, lift, claim, clock)
    else:
        _idle(found, lift, clock, around)


def _idle(found: Answer, lift: LiftFacts, clock: TimePhrases, around: common.OthersHeard) -> None:
    """Explain a lift that nobody has or requests. A fault may need a person nevertheless, or the last
    requester may wait unheard."""
    found.say("Nobody requests the lift.")
    if first_causes.needs_a_person(found, lift, clock, around):
        return
    one = lift.unended
    last = one.last.at if one else float("-inf")
    unended = one and any(label(w) == one.who and m.at == last for w, m in around.spoke.items())
    if one is None or not unended or clock.now.at - last > ABANDONED_S:
        found.acts("nobody", "there is nothing to do")
        return
    found.say(
        f"{one.who} asked for it at {one.wants or 'no floor'} until {clock.time(one.last.wall)}, and"
        " has sent no END: its fleet adapter is gone or cut off, or has dropped the robot, or does not"
        " hear the lift's states.",
        "a person",
        f"see whether {one.who} still waits; if so, look at its fleet adapter, and at the network of"
        " the lift's daemon",
    )


def _states_do_not_arrive(
    found: Answer, lift: LiftFacts, since: Moment, clock: TimePhrases
) -> None:
    """Explain that we hear the lift's states, but our supervisor does not hear them. Fleet adapters
    that repeat their requests hear them too."""
    found.because = ()
    misses = f"The supervisor of {lift.name} has missed the lift's states {clock.since(since)}"
    if lift.answered(clock.now):
        found.say(
            f"{misses}, though fleet adapters answer them: the supervisor is cut off.",
            "a person",
            "look at the network of the lift supervisor: `rmf-bridge doctor FILE` on its machine",
        )
    else:
        found.say(
            f"{misses}, though they are heard here: they do not reach the supervisor, and perhaps no"
            " fleet adapter. A fleet adapter repeats a request only after a state, so a robot may wait"
            " without a word.",
            "a person",
            f"look at the network between the daemon of {lift.name}, the lift supervisor and the fleet"
            " adapters: `rmf-bridge doctor FILE` on their machines",
        )
    if lift.session.value != NOBODY:
        found.say(lift.in_car(lift.session.value, clock.now))


def _in_question(lift: LiftFacts, clock: TimePhrases, focus: str) -> DeviceRequester | None:
    """Return the requester to explain, or None.

    With `focus`, this is the requester of that name. Without `focus`, it is the requester who waits
    longest. If nobody waits, it is the holder.
    """
    if focus:
        return lift.requesters.get(focus)
    waiting = [one for one in lift.asking(clock.now) if not lift.is_served(one)]
    if waiting:
        return min(waiting, key=lambda one: one.since.at)
    return lift.requesters.get(lift.session.value)


def _begins(lift: LiftFacts, claim: DeviceRequester | None) -> float:
    """Return the time (s) at which the story begins. The story begins at the waiting requester's
    request or at the holder's first request, whichever came first."""
    holder = lift.requesters.get(lift.session.value)
    starts = [claim.first.at] if claim else []
    if holder is not None:
        starts.append(holder.first.at)
    elif lift.session.value == NOBODY and claim is None:
        starts.append(lift.rides.last_from)
    elif lift.session.value != NOBODY:
        starts.append(lift.session.since.at)
    return min(starts, default=float("-inf"))


def _with_askers(found: Answer, lift: LiftFacts, clock: TimePhrases) -> Answer:
    for claim in [one for one in lift.asking(clock.now) if one.met is None][:3]:
        since = clock.since(claim.since)
        found.say(f"{claim.who} has waited {since} for the lift at {claim.wants or 'no floor'}.")
        if lift.state is None:
            found.say(lift.in_car(claim.who, clock.now))
        found.since = min(found.since, claim.first.at)
    return found


def _hold(found: Answer, lift: LiftFacts, clock: TimePhrases, *, then: bool = False) -> None:
    """Name the holder, and tell where the car is. With `then`, use the past tense, because the last
    state came before a silence."""
    holder = "nobody" if lift.session.value == NOBODY else lift.session.value
    motion = "" if lift.motion.value == "unknown" else f", {_motion(lift.motion.value)}"
    car = f"at {lift.floor.value}, door {lift.door.value}{motion}, mode {lift.mode.value}"
    if then:
        found.say(f"At that time {holder} had the lift, and the car was {car}.")
        return
    has = f"{holder[:1].upper()}{holder[1:]}" if holder == "nobody" else holder
    found.say(f"{has} has had the lift {clock.since(lift.session.since)}. The car is {car}.")


def _motion(motion: str) -> str:
    return f"going {motion}" if motion in ("up", "down") else motion


def _fields(
    lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases
) -> tuple[CheckedField, ...]:
    """Return the fields that RequestLift checks, with the values that this requester's fleet adapter
    sees. The lift's name always counts as a match."""
    since = (lift.session.since, lift.floor.since, lift.door.since)
    return tuple(
        CheckedField(*check, clock.since(moment))
        for check, moment in zip(lift.checks(claim), since, strict=True)
    )


def _others_wait(
    found: Answer, lift: LiftFacts, claim: DeviceRequester | None, clock: TimePhrases
) -> None:
    others = [
        one
        for one in lift.asking(clock.now)
        if one is not claim and one.who != lift.session.value and not lift.is_served(one)
    ]
    texts = [f"{one.who} at {one.wants} {clock.since(one.since)}" for one in others[:4]]
    for one in others:
        if not_served(found, lift, one):
            break
    if texts:
        more = f", and {len(others) - len(texts)} more" if len(others) > len(texts) else ""
        found.say(
            f"{'Other requesters wait' if claim else 'Requesters wait'}: {'; '.join(texts)}{more}."
        )


# ---- why the requester waits


def _alarm(found: Answer, lift: LiftFacts, clock: TimePhrases) -> None:
    mode, holder, floor = lift.mode.value, lift.session.value, lift.floor.value
    found.because = (mode, *EMERGENCIES)
    found.say(
        f"The lift has been in {mode} mode {clock.since(lift.mode.since)}: the lift takes no robot"
        " until this mode ends. RMF ignores the mode, and only sees that the lift does not come."
    )
    if LATCHED in lift.faults(clock.now):
        found.because = (LATCHED,)
        if holder != NOBODY:
            found.say(lift.keeps(clock.now))
        found.acts("a person", "when the lift is safe, reset it: the daemon sees no fire now")
        return
    ends = f"{_hazard(lift, clock)} has to end, with a reset if the lift's settings require one"
    if holder == NOBODY:
        found.acts("the controller", ends)
        return
    found.say(lift.keeps(clock.now))
    if _lets_in(found, lift, clock):
        return
    theirs = lift.requesters.get(holder)
    stands = lift.door.value == "open" and clock.now.at - lift.door.since.at > STANDS_S
    wants = theirs.wants if stands and theirs and theirs.asks(clock.now) else ""
    if wants == floor:
        found.say(f"The door is open at {floor}.", "the robot", f"{holder} has to drive out")
    elif mode != "FIRE":
        found.acts("the controller", ends)
    elif not wants:
        found.acts(
            "the controller",
            f"bring the car to the recall floor and open its door there; then {ends}",
        )
    else:
        found.say(
            f"The car stands at {floor} with its door open, as after a recall, and {holder} still asks"
            f" for {wants}: its fleet adapter does not know the recall floor, or has not heard"
            " the alarm.",
            "a person",
            f"leave the lift alone until the alarm is over; then name {floor} as the recall floor in"
            " the fleet's YAML (`lift_emergency_levels`)",
        )


def _hazard(lift: LiftFacts, clock: TimePhrases) -> str:
    """Name the hazard of a lift in FIRE or EMERGENCY mode."""
    mode = lift.mode.value
    known = [EMERGENCIES[code] for code in lift.faults(clock.now) if code in EMERGENCIES]
    return f"the {listed(known) if known and mode == 'EMERGENCY' else ALARMS[mode]}"


def _lets_in(found: Answer, lift: LiftFacts, clock: TimePhrases) -> bool:
    """Return whether RMF lets the holder drive in during the hazard, and say so. RMF ignores the mode,
    so a robot outside the car drives in as soon as session, floor and door match."""
    who, floor, mode = lift.session.value, lift.floor.value, lift.mode.value
    theirs, hazard = lift.requesters.get(who), lift.hazard
    if theirs is None or hazard is None or theirs.ended or not lift.matches(theirs):
        return False
    boarded = theirs.boarded is not None and theirs.boarded.at < hazard.at
    if boarded or lift.told("boarded", clock.now) == "yes":
        return False
    if theirs.first.seen and hazard.seen:
        found.say(
            f"But the door is open at {floor}, so RMF lets {who} drive in now. {who} was not let in"
            f" before the lift went into {mode} mode: it is outside, or has driven in since.",
            "a person",
            f"keep {who} out of the car, and look whether it has driven in",
        )
        return True
    found.say(
        f"But the door is open at {floor}. If {who} is outside the car, RMF lets {who} drive in now;"
        f" whether {who} was in the car before {mode} mode is not known.",
        "a person",
        f"look where {who} is: keep it out of the car, or let it drive out",
    )
    return True


def _held(found: Answer, lift: LiftFacts, clock: TimePhrases, around: common.OthersHeard) -> None:
    """Explain a lift that somebody holds. Tell why the holder waits, or why the holder does not release
    the lift."""
    holder = lift.session.value
    theirs = lift.requesters.get(holder)
    if theirs is not None and theirs.ended is not None:
        lift_holder.end_not_obeyed(found, lift, theirs, clock)
    elif theirs and theirs.human and (lift.mode.value == "HUMAN" or not lift.matches(theirs)):
        lift_holder.has_human_mode(found, lift, theirs, clock)
    elif theirs is None or not theirs.asks(clock.now):
        lift_holder.without_word(found, lift, clock, around)
    elif lift.matches(theirs):
        lift_holder.drives(found, theirs, clock)
    else:
        if found.asks != holder:
            where = theirs.wants or "no floor"
            found.say(
                f"{holder} itself has waited {clock.since(theirs.since)} for the lift at {where}."
            )
        _missing(found, lift, theirs, clock, around)
    lift_holder.forgotten(found, lift, holder, clock)


def _missing(
    found: Answer,
    lift: LiftFacts,
    claim: DeviceRequester,
    clock: TimePhrases,
    around: common.OthersHeard,
) -> None:
    """Explain which condition is not yet met for the robot that has the session. The conditions are
    mode, floor and door. But if the lift's daemon waits for the end of a fault, that fault is the
    cause."""
    if not_served(found, lift, claim):
        found.say(lift.keeps(clock.now))
        return
    on, comes = common.relays(lift, clock), clock.now.at - lift.floor.since.at < SETTLES_S
    _, _, ends = lift.waits_said(clock.now).get("lift", "").partition(UNTIL)
    if first_causes.own_fault(found, lift, clock, around, codes=ends.split(", ")):
        return
    if lift.floor.value == NO_FLOOR and lift.door.value == "open":
        found.say(
            f"The door has been open {clock.since(lift.door.since)}, but the car is at no known floor,"
            f" so RMF does not let the robot drive{on}.",
            "the controller",
            f"show the car's floor ({claim.wants}): check the floor code's wires",
        )
    elif lift.mode.value == "HUMAN":
        _human(found, lift, clock, on)
    elif lift.floor.value == NO_FLOOR and lift.motion.value == "stopped":
        found.say(
            f"The car has stood at no known floor {clock.since(lift.floor.since)}{on}.",
            "a person",
            "check whether the car stands between floors; if it does not, check the floor code's wires",
        )
    elif lift.floor.value != claim.wants and _rides(lift, claim, clock):
        found.say(
            f"{claim.who} rides: the car is on its way to {claim.wants}, and has been at"
            f" {lift.floor.value} {clock.since(lift.floor.since)}{on}.",
            "the robot",
            f"{claim.who} rides on, and drives out when the door is open at {claim.wants}",
        )
    elif lift.floor.value != claim.wants:
        found.say(
            f"The car has not come to {claim.wants}: it has been at {lift.floor.value}"
            f" {clock.since(lift.floor.since)}{on}.",
            "the controller",
            f"bring the car to {claim.wants}; if it does not, a person has to check the call's relay"
            " and its wire",
        )
    elif "hold_door" not in on and lift.motion.value != "stopped" and comes:
        found.say(
            f"The car has just come to {claim.wants}.",
            "the controller",
            f"stop the car and open the door at {claim.wants}",
        )
    elif on and "hold_door" not in on and lift.motion.value != "stopped":
        found.say(
            f"The floor code shows {claim.wants}, but the daemon does not see the car stand (motion"
            f" {lift.motion.value}), so it does not open the door{on}.",
            "a person",
            "check the contacts that show whether the car stands; if they are right, the car has not"
            " stopped",
        )
    else:
        found.say(
            f"The car is there, but its door has been {lift.door.value}"
            f" {clock.since(lift.door.since)}{on}.",
            "the controller",
            f"open the door at {claim.wants}",
        )


def _rides(lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases) -> bool:
    """Return whether the robot is in a car that has just moved."""
    inside = claim.boarded is not None or lift.told("boarded", clock.now) == "yes"
    return inside and lift.floor.since.seen and clock.now.at - lift.floor.since.at < FLOOR_S


def _human(found: Answer, lift: LiftFacts, clock: TimePhrases, on: str) -> None:
    """Explain why a lift with a session is still in HUMAN mode. Tell whether the daemon has asked the
    controller for AGV mode."""
    human = (
        f"{lift.session.value} has the session, but the lift has been in HUMAN mode"
        f" {clock.since(lift.mode.since)}"
    )
    refused = {"AGV_MODE_NOT_GRANTED", "AGV_MODE_LOST"} & lift.faults(clock.now).keys()
    settled = clock.now.at - lift.session.since.at > SETTLES_S
    if on and "agv_request" not in on and not refused and settled:
        found.because = ()
        found.say(
            f"{human}{on}, so the controller is not asked for AGV mode.",
            "a person",
            "see in `rmf-bridge log` why the daemon does not ask; an input may flicker",
        )
        return
    unknown = "" if on else ". Whether its node asks the controller for AGV mode is not known"
    found.say(
        f"{human}{on}{unknown}.",
        "the controller",
        "confirm AGV mode; a key switch, earlier calls by people, or the AGV contact may prevent this",
    )

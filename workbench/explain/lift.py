"""Explain why a robot waits for a lift, in sentences from its messages.

RMF's RequestLift looks at four fields of LiftState and at nothing else: the lift's name, its session,
its floor and its door (rmf_ros2, RequestLift.cpp:322-326). The answer names the missing ones,
the reason, and the party that has to act next.
"""

from shlex import quote
from typing import Final

from bridges.observe.lift import NO_FLOOR, NOBODY
from bridges.observe.requesters import DeviceRequester
from workbench.explain import answer as common
from workbench.explain.answer import Answer
from workbench.explain.explanation import CheckedField, NextStep, Who
from workbench.explain.lift_facts import DIRECT, LiftFacts
from workbench.explain.lift_ungranted import SETTLES_S, not_granted
from workbench.explain.phrases import TimePhrases, lasted
from workbench.explain.rows import label

LONG_S: Final = 60.0
"""A robot drives within this time (s) of getting all it waits for."""
HAZARDS: Final = {
    "FIRE": "the fire alarm has to end, and be reset where its settings ask for that",
    "EMERGENCY": "the emergency (stop, code blue, earthquake) has to end",
    "OFFLINE": "find out why it is out of service, or cannot be read",
}


def answer(
    lift: LiftFacts, clock: TimePhrases, around: common.OthersHeard, focus: str = ""
) -> Answer:
    """Explain the lift at the last message. `focus`: the session in question; "" for a waiting one."""
    if lift.last_state is None:
        return _with_askers(common.unheard(lift, around, clock), lift, clock)
    stopped = common.silent(lift, clock)
    if stopped is not None:
        _hold(stopped, lift, clock, then=True)
        return _with_askers(stopped, lift, clock)
    claim = _in_question(lift, clock, focus)
    found = Answer(since=_begins(lift, claim))
    if focus and claim is None:
        told = "its last ride is shown below" if lift.kept else "it was never heard asking"
        found.say(f"{label(focus)} neither has {lift.name} nor asks for it now: {told}.")
    if claim is not None and claim.ended is None and not lift.matches(claim):
        where = claim.wants or "no floor"
        found.say(f"{claim.who} has waited for {lift.name} at {where} {clock.since(claim.since)}.")
    _hold(found, lift, clock)
    if old := common.old_reading(lift, clock):
        found.say(old)
    if claim is None:
        _nobody_asks(found, lift, clock)
    elif claim.ended is not None:
        _end_not_obeyed(found, lift, claim, clock)
    else:
        found.asks, found.fields = claim.who, _fields(lift, claim, clock)
        found.notes += common.clock_of(claim)
        _why(found, lift, claim, clock)
    _others_wait(found, lift, claim, clock)
    return found


def _in_question(lift: LiftFacts, clock: TimePhrases, focus: str) -> DeviceRequester | None:
    """Return the claim in question: that of `focus`, else the longest waiting, else the holder's."""
    if focus:
        return lift.requesters.get(focus)
    waiting = [one for one in lift.asking(clock.now) if not lift.matches(one)]
    if waiting:
        return min(waiting, key=lambda one: one.since.at)
    return lift.requesters.get(lift.session.value)


def _begins(lift: LiftFacts, claim: DeviceRequester | None) -> float:
    """Return the story's beginning (s): the waiting one's request, or the holder's grant."""
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
        found.say(f"{claim.who} has waited for it at {claim.wants or 'no floor'} {since}.")
        found.since = min(found.since, claim.first.at)
    return found


def _hold(found: Answer, lift: LiftFacts, clock: TimePhrases, *, then: bool = False) -> None:
    """Name the holder and the car's place. `then`: in the past tense, as of the last state."""
    holder = "nobody" if lift.session.value == NOBODY else lift.session.value
    motion = "" if lift.motion.value == "unknown" else f", {_motion(lift.motion.value)}"
    car = f"at {lift.floor.value}, door {lift.door.value}{motion}, mode {lift.mode.value}"
    if then:
        found.say(f"Then {holder} had it, and the car was {car}.")
        return
    has = f"{holder[:1].upper()}{holder[1:]}" if holder == "nobody" else holder
    found.say(f"{has} has had it {clock.since(lift.session.since)}. The car is {car}.")


def _motion(motion: str) -> str:
    return f"going {motion}" if motion in ("up", "down") else motion


def _fields(
    lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases
) -> tuple[CheckedField, ...]:
    """Return RequestLift's fields, as this requester's fleet adapter sees them; the name as heard."""
    since = (lift.session.since, lift.floor.since, lift.door.since)
    return tuple(
        CheckedField(*check, clock.since(moment))
        for check, moment in zip(lift.checks(claim), since, strict=True)
    )


def _nobody_asks(found: Answer, lift: LiftFacts, clock: TimePhrases) -> None:
    holder = lift.session.value
    if holder == NOBODY:
        found.say("Nobody asks for it.", NextStep("nobody", "there is nothing to do"))
    else:
        _without_word(found, lift, holder, clock)


def _others_wait(
    found: Answer, lift: LiftFacts, claim: DeviceRequester | None, clock: TimePhrases
) -> None:
    others = [
        one
        for one in lift.asking(clock.now)
        if one is not claim and one.who != lift.session.value and not lift.matches(one)
    ]
    texts = [f"{one.who} at {one.wants} {clock.since(one.since)}" for one in others[:4]]
    if texts:
        more = f", and {len(others) - len(texts)} more" if len(others) > len(texts) else ""
        found.say(f"{'Others wait' if claim else 'These wait'}: {'; '.join(texts)}{more}.")


# ---- why it waits


def _why(found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases) -> None:
    """Explain why this claim is not met; if it is, name the party to act next."""
    holder = lift.session.value
    if lift.matches(claim) and claim.asks(clock.now):
        _drives(found, lift, claim, clock)
    elif lift.matches(claim):
        _without_word(found, lift, holder, clock)
    elif lift.mode.value in HAZARDS:
        _hazard(found, lift, clock)
    elif holder == claim.who:
        _missing(found, lift, claim, clock)
    elif holder == NOBODY:
        not_granted(found, lift, claim, clock)
    else:
        _held(found, lift, claim, holder, clock)


def _hazard(found: Answer, lift: LiftFacts, clock: TimePhrases) -> None:
    mode = lift.mode.value
    who: Who = "a person" if mode == "OFFLINE" else "the controller"
    found.say(
        f"The lift has been in {mode} mode {clock.since(lift.mode.since)}: it takes no robot until that"
        " ends. RMF does not look at the mode, and only sees that the lift does not come.",
        NextStep(who, HAZARDS[mode]),
    )
    holder = lift.session.value
    if holder == NOBODY:
        return
    own = lift.own(clock.now)
    inside = own.values.get("boarded") if own else None
    door = {
        "yes": " Its robot may be in the car, so it is shown the true door and can leave.",
        "no": " Its robot was not let into the car, so it is shown no open door.",
    }.get(inside or "", "")
    found.say(f"{holder} keeps the session meanwhile: only its END ends one.{door}")


def _held(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, holder: str, clock: TimePhrases
) -> None:
    """Explain a lift held by another session."""
    theirs = lift.requesters.get(holder)
    if theirs is not None and theirs.ended is not None:
        _end_not_obeyed(found, lift, theirs, clock)
    elif theirs is None or not theirs.asks(clock.now):
        _without_word(found, lift, holder, clock)
    elif lift.matches(theirs):
        _drives(found, lift, theirs, clock)
    else:
        where = theirs.wants or "no floor"
        found.say(f"{holder} itself has waited for it at {where} {clock.since(theirs.since)}.")
        _missing(found, lift, theirs, clock)
    _forgotten(found, lift, holder, clock)


def _forgotten(found: Answer, lift: LiftFacts, holder: str, clock: TimePhrases) -> None:
    """Explain that the supervisor requests for another session than the holder's."""
    asks = lift.supervisor
    if asks is None or asks.value in ("", holder, NOBODY):
        return
    if clock.now.at - asks.since.at < SETTLES_S and asks.since.seen:
        return
    sender = lift.sender(asks.value)
    it = "a supervisor that does so" if sender == DIRECT else "it"
    found.say(
        f"{sender.capitalize()} has asked for {asks.value} {clock.since(asks.since)}, though {holder}"
        f" has the lift: {it} has forgotten {holder}, by a restart or a lost END, and passes none of"
        " its requests on. Our node then hears that robot's own requests and its END; other nodes do"
        " not."
    )


def _without_word(found: Answer, lift: LiftFacts, holder: str, clock: TimePhrases) -> None:
    """Explain a silent holder of the lift."""
    theirs = lift.requesters.get(holder)
    heard_s = clock.now.at - max(lift.began.at, lift.session.since.at)
    if theirs is None and heard_s < common.LISTENS_S:
        found.say(
            f"{holder} has not been heard yet; that takes a few seconds.",
            NextStep("nobody", "listen for longer"),
        )
        return
    since = f" since {clock.time(theirs.last.wall)}" if theirs else f" for {lasted(heard_s)}"
    once = " It asked once only, as a person at a dashboard does." if _once(theirs) else ""
    found.say(
        f"{holder} has said nothing{since}, and has not sent END. A robot that waits or rides asks at"
        f" each state: its fleet adapter is gone.{once}",
        NextStep(
            "a person",
            f"check the car; if it is empty, {_release(lift)} ends the session",
        ),
    )
    own = lift.own(clock.now)
    if own is not None and own.values.get("boarded") in ("yes", "no"):
        inside = own.values["boarded"] == "yes"
        found.say("A robot may be in the car." if inside else "No robot has been let into the car.")


def _release(lift: LiftFacts) -> str:
    return f"`rmf-bridge release {quote(lift.name)}`"


def _once(claim: DeviceRequester | None) -> bool:
    return claim is not None and claim.times == 1


def _end_not_obeyed(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases
) -> None:
    assert claim.ended is not None
    if clock.now.at - claim.ended.at < SETTLES_S:
        found.say(
            f"{claim.who} has just sent END.",
            NextStep("the device's node", "show no session in its next state"),
        )
        return
    if claim.own and not claim.end_passed_on and lift.supervisor_last is not None:
        found.say(
            f"{claim.who} sent END at {clock.time(claim.ended.wall)}, and the supervisor has not passed"
            " it on.",
            NextStep(
                "the supervisor",
                f"pass on END; until then: {_release(lift)}",
            ),
        )
        return
    found.say(
        f"{claim.who} sent END at {clock.time(claim.ended.wall)}, and the lift still shows its"
        " session.",
        NextStep(
            "the device's node",
            f"end the session; until then: {_release(lift)}",
        ),
    )


def _drives(found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases) -> None:
    """Explain a robot that has all it waited for."""
    met = claim.met or claim.since
    found.say(
        f"{claim.who} has seen its lift at {claim.wants} with the door open {clock.since(met)}.",
        NextStep(
            "the robot",
            f"{claim.who} has to drive in or out; then its fleet adapter asks for the next floor, or"
            " sends END",
        ),
    )
    if clock.now.at - met.at > LONG_S:
        found.say("That is long: the robot may be blocked or lost, or its adapter hangs.")


def _missing(found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases) -> None:
    """Explain a granted session whose mode, floor or door is still missing."""
    on = common.relays(lift, clock)
    if lift.mode.value in HAZARDS:
        _hazard(found, lift, clock)
    elif lift.floor.value == NO_FLOOR and lift.door.value == "open":
        found.say(
            f"The door has been open {clock.since(lift.door.since)}, but the car is at no known floor,"
            f" so RMF does not let the robot drive{on}.",
            NextStep(
                "the controller", f"show its floor ({claim.wants}): check the floor code's wires"
            ),
        )
    elif lift.mode.value == "HUMAN":
        found.say(
            "It has the session, but the lift has been in HUMAN mode"
            f" {clock.since(lift.mode.since)}{on}.",
            NextStep(
                "the controller",
                "confirm AGV mode: a key switch, people's calls that it serves first, or the contact",
            ),
        )
    elif lift.floor.value == NO_FLOOR and lift.motion.value == "stopped":
        found.say(
            f"The car has stood at no known floor {clock.since(lift.floor.since)}{on}.",
            NextStep(
                "the controller", "show its floor: a wire of the floor code, or a stop on the way"
            ),
        )
    elif lift.floor.value != claim.wants:
        found.say(
            f"The car has not come to {claim.wants}: it has been at {lift.floor.value}"
            f" {clock.since(lift.floor.since)}{on}.",
            NextStep("the controller", f"bring the car to {claim.wants}"),
        )
    else:
        found.say(
            f"The car is there, but its door has been {lift.door.value}"
            f" {clock.since(lift.door.since)}{on}.",
            NextStep("the controller", f"open the door at {claim.wants}"),
        )

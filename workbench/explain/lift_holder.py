"""Explain why a lift's holder does not release the lift. The holder may be silent, or may have sent
END. RMF's conditions for its robot may also be met, so that the robot has to drive."""

from shlex import quote
from typing import Final

from bridges.observe.lift import NOBODY
from bridges.observe.limits import REQUESTER_SILENT_S
from bridges.observe.requesters import DeviceRequester
from workbench.explain import answer as common
from workbench.explain.answer import Answer, OthersHeard
from workbench.explain.lift_facts import DIRECT, LiftFacts
from workbench.explain.lift_ungranted import SETTLES_S
from workbench.explain.phrases import TimePhrases, lasted, listed
from workbench.explain.rows import label

SILENT: Final = "HOLDER_SILENT"
"""The fault of our supervisor that hears no request of the holder."""
LONG_S: Final = 60.0
"""Maximum normal time (s) from the moment at which all conditions are met until the robot drives
off."""


def release(lift: LiftFacts) -> str:
    """Return the command that ends the lift's session."""
    return f"`rmf-bridge release {quote(lift.name)}`"


def without_word(found: Answer, lift: LiftFacts, clock: TimePhrases, around: OthersHeard) -> None:
    """Explain a holder that sends neither requests nor END."""
    holder, theirs = lift.session.value, lift.requesters.get(lift.session.value)
    heard_s = clock.now.at - max(lift.began.at, lift.session.since.at)
    if theirs is None and heard_s < common.LISTENS_S:
        found.say(
            f"No request from {holder} has been heard yet; this may take a few seconds.",
            "nobody",
            "listen for longer",
        )
        return
    if not lift.adapters_heard and not around.live and SILENT not in lift.faults(clock.now):
        nor = " or `lift_requests`" if lift.supervisor_last is None else ""
        found.say(
            f"No request for {lift.name} was heard on `adapter_lift_requests`{nor}, but the recording"
            f" may leave them out. So it is not known whether {holder} still requests the lift."
            f" {lift.in_car(holder, clock.now)}",
            "a person",
            f"look where {holder} is, and record `/adapter_lift_requests` and `/lift_requests` too",
        )
        return
    since = f"since {clock.time(theirs.last.wall)}" if theirs else f"for at least {lasted(heard_s)}"
    found.because = ()
    found.say(
        f"{holder} has sent no request and no END {since}, though a robot that waits or rides sends a"
        " request after each state."
    )
    fleet = holder.rpartition("/")[0]
    speaks, together = _of_fleet(fleet, holder, theirs, clock, around)
    look = f"look into the car; only when the car is empty: {release(lift)}"
    if not fleet:
        found.say(
            f"{holder} is no robot's name (FLEET/ROBOT), so a dashboard may have taken the lift."
        )
    elif speaks:
        here = [one for one in lift.asking(clock.now) if one.who in speaks and one.times > 1]
        deaf = "" if here else ", or does not hear the lift's states"
        found.say(
            f"The fleet adapter is running, because it sends messages for {listed(speaks)}. Therefore"
            f" {holder} is dead, or the adapter has dropped this robot{deaf}."
        )
    elif together or around.senders is not None:
        silent = f"Nothing from any robot of {fleet} was heard either"
        if together:
            silent = f"{listed([holder, *together])} fell silent together"
        found.say(
            f"{silent}: the fleet adapter of {fleet} is gone or cut off, or does not hear the lift's"
            " states."
        )
        look = (
            f"look into the car, then restart the fleet adapter of {fleet}. It then sends END for"
            f" {holder}: if {holder} stands in the car, give the robot a task within a minute, or take"
            " the robot out"
        )
    else:
        found.say(
            "Its fleet adapter is gone or cut off, or has dropped the robot, or does not hear the"
            " lift's states. The messages do not tell which."
        )
    found.say(lift.in_car(holder, clock.now), "a person", look)


def _of_fleet(
    fleet: str,
    holder: str,
    theirs: DeviceRequester | None,
    clock: TimePhrases,
    around: OthersHeard,
) -> tuple[list[str], list[str]]:
    """Return two lists of robots of the holder's fleet. For the robots in the first list, the fleet
    adapter has sent messages lately. The robots in the second list fell silent together with the
    holder."""
    ended = theirs.last.at if theirs else float("-inf")
    speaks: list[str] = []
    together: list[str] = []
    for raw, at in around.spoke.items():
        who = label(raw)
        if who == holder or not f"{who}/".startswith(f"{fleet}/"):
            continue
        if clock.now.at - at.at <= REQUESTER_SILENT_S:
            speaks.append(who)
        elif who != fleet and abs(at.at - ended) <= REQUESTER_SILENT_S:
            together.append(who)
    return _robots(speaks, fleet), _robots(together, fleet)


def _robots(found: list[str], fleet: str) -> list[str]:
    """Name the robots. If the adapter spoke only for the whole fleet, name the fleet."""
    robots = sorted(who for who in found if who not in (fleet, f"{fleet}/"))
    return robots[:4] or ([f"the rest of {fleet}"] if found else [])


def has_human_mode(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases
) -> None:
    """Explain a session in HUMAN mode. It keeps the lift for people, and waits for nothing. A fleet
    adapter never asks for this mode."""
    number = " Its fleet adapter may mean AGV_MODE, which is 1 in a request and 2 in a state."
    found.say(
        f"{claim.who} has asked for HUMAN mode: people call the lift, and no robot gets it until"
        f" {claim.who} sends END.{number if '/' in claim.who else ''}"
        f" {lift.in_car(claim.who, clock.now)}",
        "a person",
        f"let {claim.who} send END; if it cannot, and the car is empty: {release(lift)}",
    )


def end_not_obeyed(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases
) -> None:
    """Explain why the lift still shows a session after the holder's END."""
    assert claim.ended is not None
    at = clock.time(claim.ended.wall)
    if clock.now.at - claim.ended.at < SETTLES_S:
        found.say(
            f"{claim.who} has just sent END.",
            "the device's node",
            "show no session in its next state",
        )
    elif claim.own and not claim.end_passed_on and lift.supervisor_last is not None:
        found.say(
            f"{claim.who} sent END at {at}, and the supervisor has not passed it on.",
            "the supervisor",
            f"pass on END of {claim.who}; the supervisor's log says why it does not",
        )
    elif claim.own and not claim.end_passed_on:
        found.say(
            f"{claim.who} sent END at {at}, and the lift still shows its session. Nothing was heard on"
            " `lift_requests`, so it is not known whether the supervisor passed the END on.",
            "a person",
            f"see in the log of the lift's node whether it has the END of {claim.who}; until the"
            f" session ends, when the car is empty: {release(lift)}",
        )
    else:
        found.say(
            f"{claim.who} sent END at {at}, and the lift still shows its session.",
            "the device's node",
            f"end the session; until then, when the car is empty: {release(lift)}",
        )


def drives(found: Answer, claim: DeviceRequester, clock: TimePhrases) -> None:
    """Explain a robot for which RMF's conditions are all met: session, floor and open door."""
    met = claim.met or claim.since
    found.say(
        f"All conditions of {claim.who} have been met {clock.since(met)}: {claim.who} has the lift, at"
        f" {claim.wants}, with the door open."
    )
    if clock.now.at - met.at > LONG_S:
        found.say(
            "That is too long, and the lift has done its part: the robot is dead or blocked, or its"
            " fleet adapter hangs.",
            "a person",
            f"look at {claim.who}, and at its fleet adapter's log",
        )
        return
    found.acts(
        "the robot",
        f"{claim.who} has to drive in or out; then its fleet adapter asks for the next floor, or"
        " sends END. If the robot stays for more than a minute, a person has to look at the robot",
    )


def forgotten(found: Answer, lift: LiftFacts, holder: str, clock: TimePhrases) -> None:
    """Explain that the supervisor sends requests for a session other than the holder's session."""
    asks = lift.supervisor
    if asks is None or asks.value in ("", holder, NOBODY):
        return
    if clock.now.at - asks.since.at < SETTLES_S and asks.since.seen:
        return
    sender = lift.sender(asks.value)
    it = "a supervisor that does this" if sender == DIRECT else "the supervisor"
    found.say(
        f"{sender.capitalize()} has requested the lift for {asks.value} {clock.since(asks.since)},"
        f" though {holder} has the lift: {it} has forgotten {holder} after a restart or a lost END, and"
        f" does not pass on the requests of {holder}. A node of rmf-bridges also hears the robot's own"
        " requests and END; other nodes do not."
    )

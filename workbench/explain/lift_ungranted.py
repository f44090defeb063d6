"""Explain why a robot's request does not reach a lift, or why a free lift does not grant the
request."""

from typing import Final

from bridges.observe.limits import CLOCKS_DIFFER_S
from bridges.observe.requesters import DeviceRequester
from workbench.explain import answer as common
from workbench.explain.answer import Answer, OthersHeard
from workbench.explain.lift_facts import LiftFacts
from workbench.explain.phrases import TimePhrases, lasted

SETTLES_S: Final = 2.0
"""Normal time (s) from a request to the lift's grant. The supervisor needs the same time to change the
holder."""


def not_granted(found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases) -> None:
    """Explain why the lift gives the requester no session, although the lift is free."""
    if lift.floors and claim.wants not in lift.floors:
        found.say(
            f"{lift.name} serves {', '.join(lift.floors[:12])}, not {claim.wants or 'an empty name'}:"
            " the request is refused.",
            "a person",
            "give the floor one name, on RMF's map and in the lift's settings",
        )
        return
    if clock.now.at - claim.since.at < SETTLES_S and claim.since.seen:
        found.say("The request came a moment ago.", "the device's node", "grant the session")
        return
    if _asks_for_another(found, lift, claim, clock):
        return
    reasons = lift.refusals(clock.now, max(claim.since.at, clock.now.at - 10.0))
    if reasons:
        found.say(
            f"Its daemon refuses the request: {', '.join(reasons)}.",
            "the device's node",
            "grant the session once that is over; its log has the details",
        )
    else:
        found.say(
            "The request is passed on to the lift's node, which does not grant it and gives no reason"
            " on the graph.",
            "the device's node",
            "grant the session; its log says why it does not",
        )


def _asks_for_another(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases
) -> bool:
    """Explain that the supervisor does not forward this request. Return whether this is the cause."""
    passed = claim.passed_on
    if not claim.own or (passed is not None and clock.now.at - passed.at < 5.0):
        return False
    other = lift.supervisor.value if lift.supervisor else ""
    instead = ""
    if other not in ("", claim.who):
        instead = f" {lift.sender(other).capitalize()} asks for {other}."
    found.say(
        f"The supervisor does not pass the request on.{instead}",
        "the supervisor",
        f"pass on the request of {claim.who}; its log says why it does not",
    )
    return True


def not_passed_on(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases, around: OthersHeard
) -> None:
    """Explain that nothing comes on `lift_requests`, although this robot sends requests or repeats
    END."""
    if common.clock_off(claim) and claim.ended is None:
        _clock(found, lift, claim)
        return
    what = "repeats its END" if claim.ended else f"asks for {claim.wants or 'no floor'}"
    last, nodes = lift.supervisor_last, around.publishers("lift_requests")
    since = f" since {clock.time(last.wall)}" if last else ""
    says = f"{claim.who} {what} at each state, and nothing has come on `lift_requests`{since}:"
    restart = "restart the lift supervisor (rmf_lift_supervisor, or that of rmf-bridges)"
    if any(one.kind == "lift_supervisor" for one in lift.heard_from(clock.now)):
        reasons = ", ".join(lift.refusals(clock.now, clock.now.at - 30.0))
        found.say(
            f"{says} its supervisor is running, and does not pass that on"
            + (f": it refuses the request, {reasons}." if reasons else "."),
            "a person",
            "end what the supervisor waits for; `rmf-bridge status` on its machine says how",
        )
        return
    found.because = ()
    if around.nobody_publishes("lift_requests"):
        found.say(f"{says} no node publishes there, so the lift supervisor is not running.")
    elif nodes:
        found.say(f"{says} {nodes} publishes there, but hangs, is passive or is cut off.")
        restart = f"look at the log of {nodes}, then {restart}"
    else:
        found.say(f"{says} the lift supervisor is not running, hangs, or is cut off.")
    found.acts("a person", restart)
    if claim.ended:
        found.say(
            "END does not prove an empty car, because a fleet adapter also sends END at its start."
        )
    elif lift.session.value == claim.who:
        found.say(lift.in_car(claim.who, clock.now))


def _clock(found: Answer, lift: LiftFacts, claim: DeviceRequester) -> None:
    """Explain that the supervisor drops requests because of wrong stamps."""
    whose = f"the machine with the fleet adapter of {claim.who.rpartition('/')[0] or claim.who}"
    if abs(lift.stamp_age_s) >= CLOCKS_DIFFER_S:
        whose += ", or of this machine (the states' stamps do not fit either)"
    side = "behind" if claim.stamp_age_s > 0 else "ahead"
    found.because, found.notes = (), ()
    found.say(
        f"Nothing comes on `lift_requests` for {claim.who}, whose requests are stamped by a clock"
        f" {lasted(abs(claim.stamp_age_s))} {side}: a supervisor that compares stamps takes them for"
        " replays and drops them.",
        "a person",
        f"set the clock of {whose} (NTP); if that does not help, look at the supervisor's log",
    )

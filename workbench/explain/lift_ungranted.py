"""Explain why a robot's request does not reach a lift, or why a free lift does not grant the
request."""

from typing import Final

from bridges.kinds.shared.graph_kind import LISTENS
from bridges.observe.requesters import DeviceRequester
from workbench.explain import answer as common
from workbench.explain.answer import Answer, OthersHeard
from workbench.explain.lift_facts import LiftFacts
from workbench.explain.phrases import TimePhrases, lasted

SETTLES_S: Final = 2.0
"""Normal time (s) from a request until the lift grants the session. After a session has ended, the
supervisor needs the same time to turn to the next session."""
SENDS: Final = ("for the lift to ", "for END of ")
"""The beginnings of our supervisor's reason to wait while it sends requests to the lift's node."""
UNRECORDED: Final = (
    "The lift was given to a robot, but nothing was heard on `lift_requests`: this topic is missing"
)


def not_granted(found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases) -> None:
    """Explain why the lift gives the requester no session, although the lift is free."""
    if not_served(found, lift, claim):
        return
    if clock.now.at - claim.since.at < SETTLES_S and claim.since.seen:
        found.say("The request came a moment ago.", "the device's node", "grant the session")
        return
    if not lift.unrecorded and _asks_for_another(found, lift, claim, clock):
        return
    reasons = lift.refusals(clock.now, max(claim.since.at, clock.now.at - 10.0))
    if reasons:
        found.say(
            f"The lift's daemon refuses the request: {', '.join(reasons)}.",
            "the device's node",
            "grant the session when this reason is gone; the node's log has the details",
        )
    elif lift.unrecorded:
        found.say(
            f"{UNRECORDED}. So it is not known whether the supervisor passes the request on, or the"
            " lift's node does not grant it.",
            "a person",
            "see whether the log of the lift's node has the request, and record `/lift_requests` too",
        )
    else:
        found.say(
            "The request is passed on to the lift's node, which does not grant it and gives no reason"
            " in its messages.",
            "the device's node",
            "grant the session; the node's log says why it does not",
        )


def not_served(found: Answer, lift: LiftFacts, claim: DeviceRequester) -> bool:
    """Check whether the requester asks for a floor that the lift does not serve. If so, explain this
    and return True."""
    if lift.serves(claim):
        return False
    found.say(
        f"{lift.name} serves {', '.join(lift.floors[:12])}, not {claim.wants or 'an empty name'}, so it"
        f" never fulfils the request of {claim.who}.",
        "a person",
        f"give the floor that {claim.who} asks for the same name on RMF's map and in the lift's"
        " settings",
    )
    return True


def is_recorded(lift: LiftFacts, around: OthersHeard) -> bool:
    """Return whether a message on `lift_requests` would have been heard."""
    return lift.supervisor_last is not None or around.live


def only_listens(found: Answer, lift: LiftFacts, clock: TimePhrases) -> bool:
    """Check whether our supervisor has just started. If so, explain this and return True."""
    if _reason(lift, clock) != LISTENS:
        return False
    found.say(
        "The lift supervisor has just started, and only listens for some seconds.",
        "nobody",
        "wait a moment",
    )
    return True


def _reason(lift: LiftFacts, clock: TimePhrases) -> str:
    """Return our supervisor's reason why the requesters wait; "" if it gives none."""
    return lift.waits_said(clock.now).get("lift_supervisor", "")


def _asks_for_another(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases
) -> bool:
    """Check whether the supervisor fails to forward this request. If so, explain this and return
    True."""
    passed = claim.passed_on
    if not claim.own or (passed is not None and clock.now.at - passed.at < 5.0):
        return False
    if only_listens(found, lift, clock):
        return True
    other = lift.supervisor.value if lift.supervisor else ""
    instead = ""
    if other not in ("", claim.who):
        instead = f" {lift.sender(other).capitalize()} asks for {other}."
    why = "" if _reason(lift, clock) else "; the supervisor's log says why it does not"
    found.say(
        f"The supervisor does not pass the request on.{instead}",
        "the supervisor",
        f"pass on the request of {claim.who}{why}",
    )
    return True


def not_passed_on(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases, around: OthersHeard
) -> None:
    """Explain that nothing comes on `lift_requests`, although this robot sends requests or repeats
    END."""
    what = "repeats its END" if claim.ended else f"asks for {claim.wants or 'no floor'}"
    last, nodes = lift.supervisor_last, around.publishers("lift_requests")
    since = f" since {clock.time(last.wall)}" if last else ""
    says = f"{claim.who} {what} after each state, and nothing has come on `lift_requests`{since}:"
    restart = "restart the lift supervisor (rmf_lift_supervisor, or the one of rmf-bridges)"
    if only_listens(found, lift, clock):
        return
    recorded = is_recorded(lift, around)
    reason = _reason(lift, clock)
    if any(one.kind == "lift_supervisor" for one in lift.heard_from(clock.now)):
        reasons = ", ".join(lift.refusals(clock.now, clock.now.at - 5.0))
        if reason.startswith(SENDS) or not (reason or reasons or recorded):
            found.say(
                f"{says} the lift supervisor is running, and gives no reason not to pass it on, so its"
                " messages may be lost, or missing in the recording.",
                "a person",
                "see whether the log of the lift's node has the request; if not, look at the network"
                " of the lift supervisor",
            )
            return
        found.say(
            f"{says} the lift supervisor is running, but does not pass it on"
            + (f": it refuses the request, {reasons}." if reasons else "."),
            "a person",
            f"the supervisor waits {reason}: remove this cause"
            if reason
            else "see in the supervisor's log (`rmf-bridge log`) why it does not pass the request on",
        )
        return
    found.because = ()
    if around.nobody_publishes("lift_requests"):
        found.say(f"{says} no node publishes this topic, so the lift supervisor is not running.")
    elif common.clock_off(claim) and claim.ended is None:
        where = (
            f"{nodes} publishes this topic, but" if nodes else "the lift supervisor is not running,"
        )
        _perhaps_the_clock(found, claim, f"{says} {where}", restart)
        return
    elif nodes:
        found.say(f"{says} {nodes} publishes this topic, but hangs, is passive or is cut off.")
        restart = f"look at the log of {nodes}, then {restart}"
    else:
        unheard = "" if recorded else ", or this topic was not recorded"
        found.say(f"{says} the lift supervisor is not running, hangs, or is cut off{unheard}.")
        restart = (
            restart if recorded else f"see whether the lift supervisor runs; if not, {restart}"
        )
    found.acts("a person", restart)
    if claim.ended:
        found.say(
            "END does not prove an empty car, because a fleet adapter also sends END at its start."
        )
    elif lift.session.value == claim.who:
        found.say(lift.in_car(claim.who, clock.now))


def _perhaps_the_clock(found: Answer, claim: DeviceRequester, says: str, restart: str) -> None:
    """Explain that the supervisor is silent, and that the requester's clock may be the reason. Neither
    RMF's supervisor nor ours drops repeated requests for their stamps, but another one may."""
    found.because = ()
    side = "behind" if claim.stamp_age_s > 0 else "ahead"
    found.say(
        f"{says} hangs, is passive or is cut off, or drops the requests, because they are stamped by a"
        f" clock {lasted(abs(claim.stamp_age_s))} {side} (RMF's supervisor and ours do not).",
        "a person",
        f"set the clock of the machine with the fleet adapter of {claim.who} (NTP); if that does not"
        f" help, look at the supervisor's log, then {restart}",
    )

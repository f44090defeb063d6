"""Explain why a robot's request does not reach a lift, or is not granted by a free lift."""

from typing import Final

from bridges.observe.requesters import DeviceRequester
from workbench.explain import answer as common
from workbench.explain.answer import Answer, OthersHeard
from workbench.explain.explanation import NextStep
from workbench.explain.lift_facts import LiftFacts
from workbench.explain.phrases import TimePhrases, lasted

SETTLES_S: Final = 2.0
"""Normal time (s) from a request to its grant, or to a supervisor's change of holder."""


def not_granted(found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases) -> None:
    """Explain why the free lift is not given to the requester."""
    if lift.floors and claim.wants not in lift.floors:
        found.say(
            f"{lift.name} serves {', '.join(lift.floors[:12])}, not {claim.wants or 'an empty name'}:"
            " the request is refused.",
            NextStep(
                "a person", "give the floor one name, on RMF's map and in the lift's settings"
            ),
        )
        return
    if clock.now.at - claim.since.at < SETTLES_S and claim.since.seen:
        found.say(
            "It was asked for a moment ago.", NextStep("the device's node", "grant the session")
        )
        return
    if _asks_for_another(found, lift, claim, clock):
        return
    reasons = lift.refusals(clock.now, max(claim.since.at, clock.now.at - 10.0))
    if reasons:
        found.say(
            f"Its daemon refuses the request: {', '.join(reasons)}.",
            NextStep(
                "the device's node", "grant the session once that is over; its log has the details"
            ),
        )
    else:
        found.say(
            "The request is passed on to the lift's node, which does not grant it and gives no reason"
            " on the graph.",
            NextStep("the device's node", "grant the session; its log says why it does not"),
        )


def _asks_for_another(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases
) -> bool:
    """Does the supervisor pass on other requests than this one?"""
    passed = claim.passed_on
    if not claim.own or (passed is not None and clock.now.at - passed.at < 5.0):
        return False
    other = lift.supervisor.value if lift.supervisor else ""
    instead = ""
    if other not in ("", claim.who):
        instead = f" {lift.sender(other).capitalize()} asks for {other}."
    found.say(
        f"The supervisor does not pass the request on.{instead}",
        NextStep(
            "the supervisor",
            f"pass on the request of {claim.who}; its log says why it does not",
        ),
    )
    return True


def not_passed_on(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases, around: OthersHeard
) -> None:
    """Explain that nothing comes on `lift_requests` while this robot asks or repeats END."""
    found.because = ()
    if common.clock_off(claim) and claim.ended is None:
        _clock(found, lift, claim)
        return
    ends = claim.ended is not None
    what = "repeats its END" if ends else f"asks for {claim.wants or 'no floor'}"
    last = lift.supervisor_last
    since = f" since {clock.time(last.wall)}" if last else ""
    says = f"{claim.who} {what} at each state, and nothing has come on `lift_requests`{since}:"
    topic = "lift_requests"
    publishers = around.publishers(topic)
    if "lift_supervisor" in lift.waits_said(clock.now):
        found.say(
            f"{says} its supervisor does not pass that on.",
            NextStep(
                "a person", "end what it waits for; `rmf-bridge status` on its machine says how"
            ),
        )
        return
    restart = "restart the lift supervisor (rmf_lift_supervisor, or that of rmf-bridges)"
    if around.nobody_publishes(topic):
        found.say(f"{says} no node publishes there, so the lift supervisor is not running.")
    elif publishers:
        found.say(
            f"{says} {publishers} publishes there and passes nothing on, because it hangs, is passive or"
            " is cut off."
        )
        restart = f"look at the log of {publishers}, then {restart}"
    else:
        found.say(f"{says} the lift supervisor is not running, hangs, or is cut off.")
    found.next.append(NextStep("a person", restart))
    if ends:
        found.say(
            "Its END does not prove that the car is empty: a fleet adapter that has started anew sends"
            " END too."
        )
    elif lift.session.value == claim.who:
        found.say(lift.in_car(claim.who, clock.now))


def _clock(found: Answer, lift: LiftFacts, claim: DeviceRequester) -> None:
    """Explain requests that are dropped, as their stamps are of another clock."""
    fleet = claim.who.rpartition("/")[0] or claim.who
    off, side = lasted(abs(claim.stamp_age_s)), "behind" if claim.stamp_age_s > 0 else "ahead"
    whose = f"the machine of the fleet adapter of {fleet}"
    if abs(lift.stamp_age_s) >= common.CLOCKS_DIFFER_S:
        whose = f"{whose}, or of this machine: the states' stamps do not fit either"
    found.say(
        f"The requests of {claim.who} are not passed on, and the clock that stamps them is {off} {side}:"
        " a supervisor that compares stamps takes such requests for replays and drops them.",
        NextStep(
            "a person",
            f"set the clock of {whose} (NTP); if nothing changes then, look at the supervisor's log",
        ),
    )

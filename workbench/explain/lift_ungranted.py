"""Explain why a free lift is not given to the requesting robot."""

from typing import Final

from bridges.observe.requesters import DeviceRequester
from workbench.explain.answer import Answer
from workbench.explain.explanation import NextStep
from workbench.explain.lift_facts import LiftFacts
from workbench.explain.phrases import TimePhrases

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
    if _not_passed_on(found, lift, claim, clock):
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


def _not_passed_on(
    found: Answer, lift: LiftFacts, claim: DeviceRequester, clock: TimePhrases
) -> bool:
    """Does the supervisor keep the request to itself?"""
    passed = claim.passed_on
    if not claim.own or (passed is not None and clock.now.at - passed.at < 5.0):
        return False
    if "lift_supervisor" in lift.waits_said(clock.now):
        found.say(
            "Its supervisor does not pass the request on.",
            NextStep(
                "a person", "end what it waits for; `rmf-bridge status` on its machine says how"
            ),
        )
    elif lift.supervisor_last is None:
        found.say(
            "Nobody passes the request on: no supervisor was heard on `lift_requests`.",
            NextStep("a person", "start rmf_lift_supervisor, or a lift supervisor of rmf-bridges"),
        )
    else:
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

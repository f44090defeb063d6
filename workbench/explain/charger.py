"""Explain a charger in sentences. The sentences tell which robot has the charger, and why a robot is
not charged.

RMF itself sends no requests to chargers. A request comes from the charger coordinator, from another
node, or from an operator. A daemon publishes each refusal on `charger_refusals`
(`bridges/kinds/charger/refusals.py`).
"""

import re
from collections.abc import Iterator
from typing import Final

from bridges.kinds.charger.pad import misplaced_in
from bridges.kinds.charger.report import LOST, STATION_NEXT, UNREQUESTED, FaultCause, diagnosis
from bridges.kinds.charger_coordinator import reasons
from bridges.observe.charger import NOBODY
from bridges.observe.diagnosis import Diagnosis
from bridges.observe.limits import REQUESTER_SILENT_S
from bridges.observe.requesters import DeviceRequester
from workbench.explain import answer as common
from workbench.explain import first_causes
from workbench.explain.answer import Answer
from workbench.explain.charger_facts import ChargerFacts
from workbench.explain.explanation import NextStep
from workbench.explain.phrases import TimePhrases, lasted
from workbench.explain.rows import label

LONG_S: Final = 120.0
"""Time (s) that a robot normally needs to come to its charger. After this time, a person should look
for the cause."""
REFUSED_LATELY_S: Final = 60.0
SAYS_MORE: Final = (*LOST, "UNKNOWN_VENDOR_STATE")
"""Faults of a charger in error whose detail says more than the error's text."""


def answer(
    charger: ChargerFacts,
    clock: TimePhrases,
    around: common.OthersHeard,
    coordinator: Diagnosis | None,
) -> Answer:
    """Explain the charger's state at the time of the last message.

    `coordinator` has the coordinator's present diagnostics. Its values are the chargers' names, and
    also `queue`, `schedule` and `assigns`.
    """
    if charger.last_state is None:
        lists = coordinator is not None and charger.id in coordinator.values
        found = common.unheard(charger, around, "the coordinator" if lists else "")
        _refusal(found, charger, clock)
        return found
    stopped = common.stopped(charger, around, clock)
    if stopped is not None:
        return stopped
    found = Answer(since=min([one.first.at for one in charger.requesters], default=float("-inf")))
    _state(found, charger, clock)
    if old := common.old_reading(charger, clock):
        found.say(old)
    if not (
        first_causes.two_nodes(found, charger, clock, around, "charger_states")
        or first_causes.own_fault(found, charger, clock, around)
    ):
        _next(found, charger, clock, around)
    _refusal(found, charger, clock)
    if coordinator is not None:
        _coordinated(found, charger, coordinator, around)
    return found


def _state(found: Answer, charger: ChargerFacts, clock: TimePhrases) -> None:
    who, request = charger.robot.value, charger.request.value
    assigned = charger.condition.value == "assigned"
    whose = "" if who == NOBODY else f" {'to' if assigned else 'for'} {who}"
    asked = f" (request {request})" if request and not request.startswith(UNREQUESTED) else ""
    state = {"error": "in error"}.get(charger.condition.value, charger.condition.value)
    found.say(
        f"{charger.name} has been {state}{whose}{asked} {clock.since(charger.condition.since)}."
    )


def _next(
    found: Answer, charger: ChargerFacts, clock: TimePhrases, around: common.OthersHeard
) -> None:
    who = charger.robot.value
    match charger.condition.value:
        case "idle":
            _idle(found, charger, clock, around)
        case "assigned":
            waits = charger.waits_said(clock.now).get("charger", "")
            if STATION_NEXT in waits and charger.told("in_range", clock.now) == "yes":
                found.acts("the controller", f"begin to charge {who}, who stands there in range")
                return
            found.say(f"{who} has not come to the pad of {charger.name}, or cannot be charged yet.")
            long = clock.now.at - charger.condition.since.at > LONG_S
            comes = NextStep("the robot", f"{who} has to come to {charger.name} and park exactly")
            look = (
                f"find {who}: see what task its fleet adapter has for it, and why it does not come"
            )
            found.next.append(NextStep("a person", look) if long else comes)
        case "charging":
            left = f"in {lasted(charger.full_in_s)}" if charger.full_in_s > 0 else "when it is full"
            robot = "A robot that nobody has named" if who == NOBODY else who
            cancelled = ", or when it is cancelled" if charger.request.value else ""
            found.say(
                f"{robot} is being charged.",
                "the controller",
                f"end the charge {left}{cancelled}",
            )
        case "released":
            found.say(
                "The charge is over, and the pad is not clear yet.",
                "the robot",
                f"{who if who != NOBODY else 'the robot'} has to leave the pad",
            )
        case "error":
            if not first_causes.own_fault(found, charger, clock, around, codes=SAYS_MORE):
                _error(found, charger)
        case other:
            found.say(
                f"RMF defines no charger state {other}.",
                "the device's node",
                "publish RMF's states",
            )


def _idle(
    found: Answer, charger: ChargerFacts, clock: TimePhrases, around: common.OthersHeard
) -> None:
    asking = [
        one
        for one in charger.requesters
        if one.ended is None and one.granted is None and one.asks(clock.now)
        if not _is_refused(charger, one, clock)
    ]
    if not asking:
        found.say("Nobody requests the charger.")
        if not first_causes.needs_a_person(found, charger, clock, around):
            found.acts("nobody", "there is nothing to do")
        return
    first = asking[0]
    found.say(
        f"A request to charge {first.wants} (request {first.who}) has waited"
        f" {clock.since(first.first)}. {charger.name} has not taken the request.",
        "the device's node",
        "take the request; if the node refuses the request, the reason is below or in the node's log",
    )


def _is_refused(charger: ChargerFacts, one: DeviceRequester, clock: TimePhrases) -> bool:
    """Return whether the charger's daemon has refused this request, so that nobody waits for it."""
    told = charger.refusal
    by_name = told is not None and told.request == one.who and told.at.at >= one.last.at
    later = clock.now.at - one.last.at > REQUESTER_SILENT_S
    return later and (by_name or bool(charger.refusals(clock.now, one.last.at)))


def _error(found: Answer, charger: ChargerFacts) -> None:
    """Blame the robot or the station, if the error's text tells which side is at fault."""
    text = charger.error.value
    misplaced = misplaced_in(text)
    if misplaced is not None and misplaced.robot is not None:
        who = label(str(misplaced.robot))
        wanted = misplaced.expected
        instead = (
            f"; the station expects {label(str(wanted))}"
            if wanted
            else "; nobody has requested the station"
        )
        found.say(
            f"Wrong station: {who} stands at {charger.name}{instead}.",
            "the robot",
            f"{who} has to leave the pad; then the error ends by itself",
        )
        return
    says = {
        FaultCause.ROBOT: ("The robot is at fault", "check the robot's receiver"),
        FaultCause.STATION: ("The station is at fault", "repair it, then `rmf-bridge reset FILE`"),
        FaultCause.PAD: (
            "Something stands on the pad that should not be there",
            "clear the pad; add a new receiver to `receivers:`",
        ),
        FaultCause.LOST: (
            "The station cannot be reached or commanded",
            "check its power and network",
        ),
    }
    side, do = says.get(
        diagnosis(text),
        ("The error's text does not say whether robot or station is at fault", "check both"),
    )
    found.say(f"{side}: {text or 'no text was given'}.", "a person", do)


def _refusal(found: Answer, charger: ChargerFacts, clock: TimePhrases) -> None:
    refusal = charger.refusal
    if refusal is None or clock.now.at - refusal.at.at > REFUSED_LATELY_S:
        return
    at, request = clock.time(refusal.at.wall), f"(request {refusal.request})"
    if charger.last_state is None:  # a coordinator refuses a request for a charger that it lacks
        text = f"At {at} a request of {refusal.who} for {charger.name} {request} was refused"
    else:
        text = f"At {at} {charger.name} refused {refusal.who} {request}"
    found.say(f"{text}: {refusal.text}.")


def _coordinated(
    found: Answer, charger: ChargerFacts, coordinator: Diagnosis, around: common.OthersHeard
) -> None:
    """Add the coordinator's texts about this charger, about the queue, and about the schedule. Add the
    coordinator's faults that name this charger, each with its next step."""
    of_it = coordinator.values.get(charger.id, "")
    if of_it:
        found.say(f"The coordinator lists {charger.name} as {label(of_it)}.")
    for key, text in (("queue", "The queue: "), ("schedule", "The schedule: ")):
        told = coordinator.value(key)
        if told:
            found.say(text + label(told, 300) + ".")
    steps = [*_of_faults(found, charger, coordinator, around)]
    gone = reasons.MAY_BE_GONE.format(station=charger.id)
    if gone in coordinator.value("queue"):
        steps.append("look whether that robot is gone; if so, reset the coordinator")
    if steps:
        found.next = [step for step in found.next if step.who != "nobody"]
        found.next += [NextStep("a person", step) for step in steps]


def _of_faults(
    found: Answer, charger: ChargerFacts, coordinator: Diagnosis, around: common.OthersHeard
) -> Iterator[str]:
    named = re.compile(rf"(?<!\w){re.escape(charger.id)}(?!\w)")
    for code, detail in coordinator.every_fault:
        if named.search(detail):
            found.say(f"The coordinator has the fault {code}: {label(detail, 300)}.")
            _, do = around.remedies.get(code, ("", f"mend {code}"))
            yield do

"""The parts of an answer, and the common part of all kinds' answers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Final

from bridges.messages.words import Kind
from bridges.observe.limits import CLOCKS_DIFFER_S
from bridges.observe.requesters import DeviceRequester
from workbench.explain.device import Device
from workbench.explain.explanation import CheckedField, FaultTold, NextStep
from workbench.explain.phrases import TimePhrases, lasted, listed

Remedies = Mapping[str, tuple[str, str]]
"""A fault's code -> its likely cause, and what to do."""
MOST_NAMES: Final = 8
LISTENS_S: Final = 2.5
"""Least listening time (s) for calling something missing."""


@dataclass(slots=True)
class Answer:
    """Sentences, RMF's view, and the next step."""

    now: list[str] = field(default_factory=list)
    next: list[NextStep] = field(default_factory=list)
    asks: str = ""
    fields: tuple[CheckedField, ...] = ()
    notes: tuple[str, ...] = ()
    since: float = float("-inf")

    def say(self, text: str, *steps: NextStep) -> "Answer":
        """Add a sentence, and the next step that follows from it."""
        self.now.append(text)
        self.next += steps
        return self


@dataclass(frozen=True, slots=True)
class OthersHeard:
    """Other things heard: the names of each kind, and the number of messages."""

    names: Mapping[Kind, tuple[str, ...]]
    messages: int


def unheard(device: Device, around: OthersHeard, clock: TimePhrases) -> Answer:
    """Answer for a device without any state."""
    answer = Answer(since=device.began.at)
    others = around.names.get(device.kind, ())
    if not around.messages:
        answer.say(
            "Nothing at all was heard.",
            NextStep(
                "a person",
                "look at the domain, the network and the transport: `rmf-bridge doctor FILE`",
            ),
        )
        return answer
    answer.say(f"Nobody publishes a state of {device.name}; {_others(around)}.")
    near = get_close_matches(device.name.lower(), {n.lower(): n for n in others}, 1)
    mean = next((f" (did you mean {name}?)" for name in others if [name.lower()] == near), "")
    what = f"start the daemon of {device.name}, or correct the spelling of its name{mean}"
    return answer.say(
        "RMF waits for ever for a device that is silent: its fleet adapters ask again only when a"
        " state comes.",
        NextStep("a person", what),
    )


def _others(around: OthersHeard) -> str:
    """`these were heard: lifts Lift2; doors ward`."""
    parts = [
        f"{kind}s {', '.join(names[:MOST_NAMES])}" for kind, names in around.names.items() if names
    ]
    return f"these were heard: {'; '.join(parts)}" if parts else "no state of any device was heard"


def silent(device: Device, clock: TimePhrases) -> Answer | None:
    """Answer for a device whose states have stopped."""
    last = device.last_state
    if last is None or not device.is_silent(clock.now):
        return None
    for_s = lasted(clock.now.at - last.at)
    answer = Answer(since=last.at - 60.0)
    answer.say(
        f"The last state of {device.name} came at {clock.time(last.wall)}: for {for_s} nobody has"
        " said what it does."
    )
    return answer.say(
        "RMF is stuck too: fleet adapters and supervisor repeat their requests only when a state"
        " comes.",
        NextStep(
            "a person",
            f"look at the daemon of {device.name} and its network: `rmf-bridge status` and"
            " `rmf-bridge doctor FILE` on its machine",
        ),
    )


def old_reading(device: Device, clock: TimePhrases) -> str:
    """Return the fault in its readings' age; "" if sound."""
    match device.reading.value:
        case "was never read":
            return f"States of {device.name} come, but its inputs were never read."
        case "is old":
            return (
                f"States of {device.name} come, but by their stamps the inputs were read"
                f" {lasted(device.stamp_age_s)} earlier: the device cannot be read, or the clocks"
                " differ."
            )
    return ""


def say_waits(found: Answer, device: Device, clock: TimePhrases) -> None:
    """Add our daemons' reasons why a request waits."""
    for kind, text in device.waits_said(clock.now).items():
        whose = "daemon" if kind == device.kind else "supervisor"
        found.say(f"Its {whose} says that the request waits {text}.")


def notes(device: Device, clock: TimePhrases) -> tuple[str, ...]:
    """Add notes on things that may mislead the reader."""
    found = []
    if device.reading.value == "is from the future":
        ahead = lasted(-device.stamp_age_s)
        found.append(
            f"The states' stamps are {ahead} ahead of this clock: the two machines' clocks differ."
        )
    if device.two_nodes(clock.now):
        found.append(
            f"The stamps of {device.name}'s states go back and forth: two nodes seem to publish them."
        )
    listened = clock.now.at - device.began.at > LISTENS_S
    speaks = device.last_state is not None and not device.is_silent(clock.now)
    if speaks and device.own(clock.now) is None and listened:
        found.append(
            f"No daemon of rmf-bridges reports on {device.name} (`/diagnostics`), so its faults, relays"
            " and refusals are not known."
        )
    return tuple(found)


def clock_of(claim: DeviceRequester) -> tuple[str, ...]:
    """Note that a requester's clock differs, which makes its requests look old or new."""
    age_s = claim.stamp_age_s
    if abs(age_s) < CLOCKS_DIFFER_S or not claim.stamped:
        return ()
    side = "behind" if age_s > 0 else "ahead of"
    return (
        f"The requests of {claim.who} are stamped {lasted(abs(age_s))} {side} this clock. One that"
        " looks old is taken for a replay until it has been repeated for a while.",
    )


def faults(device: Device, clock: TimePhrases, remedies: Remedies) -> tuple[FaultTold, ...]:
    """Add the present faults, with their remedies."""
    return tuple(
        FaultTold(code, detail, clock.since(moment), *remedies.get(code, ()))
        for code, (detail, moment) in device.faults(clock.now).items()
    )


def relays(device: Device, clock: TimePhrases) -> str:
    """`; its daemon has these on: agv_request, call L3`, or "" if that is not known."""
    own = device.own(clock.now)
    told = own.values.get("outputs") if own else None
    if told is None:
        return ""
    if told == "-":
        return "; its daemon has every relay off"
    shown = [part.removesuffix(" yes") for part in told.split(", ") if not part.endswith(" 0")]
    return (
        f"; its daemon has these on: {listed(shown)}"
        if shown
        else "; its daemon has every relay off"
    )

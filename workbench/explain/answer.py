"""The parts of an answer, and sentences for all kinds of device."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Final

from bridges.blackbox.triggers import DIED, FAULT, REFUSED, WAITING
from bridges.messages.words import Kind
from bridges.observe.limits import CLOCKS_DIFFER_S
from bridges.observe.requesters import DeviceRequester, Moment
from workbench.explain.device import Device
from workbench.explain.explanation import CheckedField, Explained, FaultTold, NextStep, Who
from workbench.explain.phrases import TimePhrases, lasted, listed
from workbench.explain.rows import label

Remedies = Mapping[str, tuple[str, str]]
"""Fault code -> the likely cause and the remedy."""
SILENCES: Final = ("LIFT_SILENT", "DOOR_SILENT", "STATION_SILENT")
MOST_NAMES: Final = 8
RELAYS_OFF: Final = "; its daemon has every relay off"
LISTENS_S: Final = 2.5
"""Minimum time (s) of listening. Before that time, no sentence may call a node missing."""


@dataclass(slots=True)
class Answer:
    """Sentences, the fields that RMF checks, and the next step.

    `because` lists the codes of the faults that caused the device's condition. Only these faults keep
    their remedies, because other remedies may contradict the answer. If `because` is None, all faults
    keep their remedies.
    """

    now: list[str] = field(default_factory=list)
    next: list[NextStep] = field(default_factory=list)
    asks: str = ""
    fields: tuple[CheckedField, ...] = ()
    notes: tuple[str, ...] = ()
    since: float = float("-inf")
    because: tuple[str, ...] | None = None

    def say(self, text: str, who: Who | None = None, do: str = "") -> "Answer":
        """Add a sentence, and the next step that follows from the sentence."""
        self.now.append(text)
        return self.acts(who, do) if who else self

    def acts(self, who: Who, do: str) -> "Answer":
        """Add a next step."""
        self.next.append(NextStep(who, do))
        return self


@dataclass(frozen=True, slots=True)
class FileReason:
    """Our recorder's reason to keep a file. The reason has a fixed name, a text, and the time. `wrote`:
    the text of a person who kept the file of a dead daemon."""

    code: str
    text: str
    at: Moment
    wrote: str = ""

    @property
    def fault(self) -> str:
        """The code of the fault that made the recorder keep the file. "" stands for any other
        reason."""
        return self.text.partition(":")[0] if self.code == FAULT else ""

    def told(self, clock: TimePhrases) -> str:
        """Say why the recorder kept the file, and which time the next sentences describe."""
        why = {
            FAULT: f"for the fault {self.text}",
            REFUSED: f"because a request was refused: {self.text}",
            WAITING: f"because {self.text}",
            DIED: f"because the daemon died: {self.text}",
        }.get(self.code, "by a person" + (f', who wrote "{self.text}"' if self.text else ""))
        if self.wrote:
            why += f'. A person wrote "{self.wrote}"'
        return (
            f"This file was kept {why}. The next sentences are about {clock.time(clock.now.wall)}."
        )


@dataclass(frozen=True, slots=True)
class OthersHeard:
    """Knowledge that does not come from the device's own messages.

    - `names`: the names of the devices heard, by kind.
    - `messages`: the number of messages heard.
    - `spoke`: the time of each fleet adapter's last message (`ObservedGraph.spoke`).
    - `remedies`: the faults' remedies.
    - `reason`: the recorder's reason to keep the file.
    - `senders`: the nodes that publish each topic on a live graph; None if the nodes are unknown, as in
      a recording.
    - `reported`: the daemons, panels and coordinators that only report on `/diagnostics`.
    - `live`: whether a live graph is heard, with every topic. A recording may lack topics.
    """

    names: Mapping[Explained, tuple[str, ...]]
    messages: int
    spoke: Mapping[str, Moment] = field(default_factory=dict)
    remedies: Remedies = field(default_factory=dict)
    reason: FileReason | None = None
    senders: Mapping[str, Sequence[str]] | None = None
    reported: tuple[str, ...] = ()
    live: bool = False

    def nobody_publishes(self, topic: str) -> bool:
        """Return whether it is certain that no node publishes this topic."""
        return self.senders is not None and not self.senders.get(topic)

    def publishers(self, topic: str) -> str:
        """Name the nodes that publish this topic. Return "" if no such node is known."""
        nodes = [label(node) for node in (self.senders or {}).get(topic, ())]
        return listed(nodes[:MOST_NAMES]) if nodes else ""


def unheard(device: Device, around: OthersHeard, lists: str = "") -> Answer:
    """Answer for a device whose states were never heard. `lists`: the node that lists the device, so
    its name is not misspelt; "" if none does."""
    answer = Answer(since=device.began.at, because=SILENCES)
    others = (
        *around.names.get(device.kind, ()),
        *around.names.get("robot", ()),
        *around.reported,
    )
    if not around.messages:
        nodes = sorted(
            {label(one) for senders in (around.senders or {}).values() for one in senders}
        )
        seen = f", but these nodes are on the graph: {', '.join(nodes[:MOST_NAMES])}"
        return answer.say(
            f"Nothing at all was heard{seen if nodes else ''}.",
            "a person",
            "look at the domain, the network and the transport: `rmf-bridge doctor FILE`",
        )
    if lists:
        return answer.say(
            f"Nobody publishes a state of {device.name}, which {lists} lists: its daemon is not running"
            " or is cut off.",
            "a person",
            f"start the daemon of {device.name}",
        )
    near = get_close_matches(device.name.lower(), {n.lower(): n for n in others}, 1)
    mean = next((f" (did you mean {name}?)" for name in others if [name.lower()] == near), "")
    if "/" in device.name:
        return answer.say(
            f"Nothing was heard of a robot {device.name}: no request, no state of its fleet with"
            f" this robot, no lift or charger that it has, and no place in a queue; {_others(around)}.",
            "a person",
            f"look at its fleet adapter, or correct the spelling of its name{mean}",
        )
    return answer.say(
        f"Nobody publishes a state of {device.name}: its daemon is not running or is cut off, or the"
        f" name is misspelt; {_others(around)}.",
        "a person",
        f"start the daemon of {device.name}, or correct the spelling of its name{mean}",
    )


def _others(around: OthersHeard) -> str:
    """Return a clause that names the devices heard, such as `these were heard: lifts Lift2; doors
    ward`."""
    parts = [
        f"{kind}s {', '.join(names[:MOST_NAMES])}" for kind, names in around.names.items() if names
    ]
    return f"these were heard: {'; '.join(parts)}" if parts else "no state of any device was heard"


def stopped(device: Device, around: OthersHeard, clock: TimePhrases) -> Answer | None:
    """Answer for a device whose states have stopped, or for a file that was kept because its daemon
    died. This daemon may be the device's supervisor. Return None for any other device."""
    last = device.last_state
    if last is not None and around.reason is not None and around.reason.code == DIED:
        return Answer(since=last.at - 60.0, because=()).say(
            "The daemon that wrote this file died then. The file ends at its death, so what came after"
            " is unknown.",
            "a person",
            "see whether that daemon runs again, and whether its relays, if it has any, are off"
            " (`rmf-bridge status`); then why it died (`rmf-bridge log`, the journal)",
        )
    if last is None or not device.is_silent(clock.now):
        return None
    for_s = lasted(clock.now.at - last.at)
    return Answer(since=last.at - 60.0, because=SILENCES).say(
        f"The last state of {device.name} came at {clock.time(last.wall)}, {for_s} ago: its daemon is"
        " not running, or is cut off.",
        "a person",
        f"look at the daemon of {device.name} and its network: `rmf-bridge status` and"
        " `rmf-bridge doctor FILE` on its machine",
    )


def old_reading(device: Device, clock: TimePhrases) -> str:
    """Return a sentence that the device's readings are old or missing. Return "" if the readings are
    fresh."""
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
    """Add the reasons that our daemons give for a waiting request."""
    for kind, text in device.waits_said(clock.now).items():
        whose = "daemon" if kind == device.kind else "supervisor"
        found.say(f"The {whose} of {device.name} says that the request waits {text}.")


def notes(device: Device, clock: TimePhrases) -> tuple[str, ...]:
    """Return notes about conditions that may mislead the reader of the answer."""
    found = []
    if device.reading.value == "is from the future":
        ahead = lasted(-device.stamp_age_s)
        found.append(
            f"The states' stamps are {ahead} ahead of this clock: the two machines' clocks differ."
        )
    listened = clock.now.at - device.began.at > LISTENS_S
    speaks = device.last_state is not None and not device.is_silent(clock.now)
    if speaks and device.own(clock.now) is None and listened:
        found.append(
            f"No daemon of rmf-bridges reports on {device.name} (`/diagnostics`), so its faults, relays"
            " and refusals are not known."
        )
    return tuple(found)


def clock_off(claim: DeviceRequester) -> bool:
    """Return whether the clock that stamps this requester's requests differs from our clock."""
    return claim.stamped and abs(claim.stamp_age_s) >= CLOCKS_DIFFER_S


def clock_of(claim: DeviceRequester, kind: Kind = "door") -> tuple[str, ...]:
    """Note that a requester's clock differs from our clock, and what the supervisors of this kind of
    device do with its requests (`bridges/kinds/shared/freshness.py`, workbench/rmf_model)."""
    if not clock_off(claim):
        return ()
    behind, off = claim.stamp_age_s > 0, lasted(abs(claim.stamp_age_s))
    effect = (
        "The supervisors take such requests. But if the requester's clock is set back after an OPEN,"
        " RMF's door supervisor drops a CLOSE that is older than the OPEN, and our door supervisor"
        " takes this CLOSE only after 10 s of repeats."
    )
    if kind == "lift":
        ours = "may take the first request only when it has been repeated for a second"
        effect = (
            "RMF's lift supervisor does not compare stamps; our lift supervisor"
            f" {ours if behind else 'takes such requests at once'}."
        )
    side = "behind" if behind else "ahead of"
    return (f"The requests of {claim.who} are stamped {off} {side} this clock. {effect}",)


def faults(
    device: Device, clock: TimePhrases, remedies: Remedies, because: tuple[str, ...] | None
) -> tuple[FaultTold, ...]:
    """Return the present faults with their remedies. `because` has the same meaning as in `Answer`."""
    kept = {code: one for code, one in remedies.items() if because is None or code in because}
    return tuple(
        FaultTold(code, detail, clock.since(moment), *kept.get(code, ()))
        for code, (detail, moment) in device.faults(clock.now).items()
    )


def relays(device: Device, clock: TimePhrases) -> str:
    """Return a clause that lists the relays that are on. Return "" if the relays' state is unknown. It
    is unknown if the device's state or a request has changed since the daemon's last report.

    An example is `; its daemon has these relays on: agv_request, call L3`.
    """
    said = device.teller("outputs", clock.now)
    changes = [one.since.at for one in device.requesters]
    if device.state is not None:
        changes += [getattr(device, name).since.at for name in device.facts(device.state)]
    if said is None or (said is not device.noted and said.last.at <= max(changes, default=0.0)):
        return ""
    told = said.values["outputs"].replace("between_pulses", "hold_open in pulses")
    shown = [part.removesuffix(" yes") for part in told.split(", ") if not part.endswith(" 0")]
    return (
        f"; its daemon has these relays on: {listed(shown)}"
        if shown != ["-"] and shown
        else RELAYS_OFF
    )

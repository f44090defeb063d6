"""Explain a name that publishes no state, and that is known from the reports of our daemons: a daemon,
an alarm panel, or the site of a coordinator."""

from collections.abc import Collection
from typing import Final

from bridges.observe.diagnosis import COORDINATOR, PANEL, Diagnosis
from workbench.explain.answer import Answer, Remedies
from workbench.explain.explanation import Explanation
from workbench.explain.first_causes import HARMLESS, named
from workbench.explain.phrases import TimePhrases, lasted, listed
from workbench.explain.rows import label

KINDS: Final = {"daemon": "a daemon", PANEL: "an alarm panel", COORDINATOR: "a charger coordinator"}


def explanation(
    name: str, reports: Collection[Diagnosis], heard: str, clock: TimePhrases, remedies: Remedies
) -> Explanation:
    """Say what the name is, whether its daemon is heard, and which of its faults need a person.
    `heard`: the span of time of the messages."""
    found, now = Answer(), clock.now.at
    kinds = dict.fromkeys(KINDS.get(one.subject[0], "a device") for one in reports)
    found.say(f"{name} is {listed([*kinds])} of rmf-bridges, and no device with a state.")
    last = max(reports, key=lambda one: one.last.at)
    if not last.is_current(now):
        found.say(
            f"The last report came at {clock.time(last.last.wall)}, {lasted(now - last.last.at)} ago:"
            " its daemon is not running, or is cut off.",
            "a person",
            "look at the daemon: `rmf-bridge status` on its machine",
        )
    for code, detail in dict.fromkeys(fault for one in reports for fault in one.every_fault):
        cause, do = remedies.get(code, (f"its daemon reports {code}", f"mend {code}"))
        found.say(f"It has a fault, {named(code, detail)}. The likely cause: {cause}.")
        if not do.startswith(HARMLESS):
            found.acts("a person", do)
    if not found.next:
        found.acts("nobody", "there is nothing to do")
    return Explanation("device", label(name), heard, tuple(found.now), tuple(found.next))

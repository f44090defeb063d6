"""Causes that come before all others, at every kind of device: two nodes under one name, readings that
come and go, and the device's own faults. While one of them lasts, nobody else is to blame."""

from collections.abc import Mapping
from typing import Final

from bridges.observe.limits import FLAPS, FLAPS_WITHIN_S
from workbench.explain import answer as common
from workbench.explain.answer import Answer, OthersHeard
from workbench.explain.device import Device
from workbench.explain.explanation import NextStep
from workbench.explain.phrases import TimePhrases, lasted, listed

TWO_NODES: Final = "TWO_NODES_FOR_ONE_DEVICE"
BUS: Final = (
    "check the bus: the module at its end, its supply and its cable, and whether a second master is on"
    " the line; `rmf-bridge log` shows each lost reply"
)
FLICKERS: Final = (
    "find what kept changing: an input that flickers (check its wire and contact), or a relay module that"
    " restarts; `rmf-bridge log` shows which"
)
CONTACT: Final = (
    "Either the leaf has stopped on its way, or its {contact} contact or the wire of that contact is"
    " bad: the messages are the same.",
    "look whether the door really stands {end}; if it does, check its {contact} contact and the wire; if"
    " not, check what stops the leaf, and the relay that drives it",
)
OWN: Final[Mapping[str, tuple[str, str]]] = {
    "INPUTS_NOT_FRESH": ("", BUS),
    "COMMUNICATION_LOST": ("", BUS),
    "OUTPUTS_NOT_WRITTEN": (
        "What it asks for does not reach the controller, so the controller is not to blame.",
        "check the relay module that the fault names: its supply, its line, and whether a second master"
        " writes to it",
    ),
    "RELAY_RESTS": (
        "A relay was switched too often and now has to rest: meanwhile the daemon asks the controller for"
        " nothing.",
        FLICKERS,
    ),
    "DOOR_CONTACTS_CONTRADICT": ("", ""),
    "DOOR_CODE_ILLEGAL": ("", ""),
    "DOOR_CONTROLLER_FAULT": ("", ""),
    "DOOR_POSITION_UNKNOWN": ("", ""),
    "FLOOR_CODE_ILLEGAL": ("", ""),
    "POSITION_LOST": ("", ""),
    "MOTION_CONTRADICTORY": ("", ""),
    "DOOR_OPENING_FAULT": CONTACT,
    "DOOR_TRAVEL_TIMEOUT": CONTACT,
    "START_TIMEOUT": ("", ""),
}
"""A fault of the device itself, the most telling first: an explanation, and where a person looks; ""
for the words of `bridges/runtime/faults.yaml`."""
READINGS: Final = ("INPUTS_NOT_FRESH", "COMMUNICATION_LOST")
OFFLINE: Final = (*READINGS, "OUTPUTS_NOT_WRITTEN", "MANUAL", "OUT_OF_SERVICE")
"""Faults that show a device as OFFLINE."""
STALLS_S: Final = 0.5
"""A reading that has grown older than the others by this time (s) shows that no new one came."""


def two_nodes(found: Answer, device: Device, clock: TimePhrases, topic: str) -> bool:
    """Explain two nodes that publish one device's states. True if there are two."""
    if TWO_NODES not in device.faults(clock.now) and not device.two_nodes(clock.now):
        return False
    names = device.nodes(clock.now)
    named = f": {listed(names)}" if len(names) > 1 else ", and the messages do not name them"
    found.because = (TWO_NODES,)
    found.say(
        f"Two nodes publish states of {device.name}{named}. While both do, neither its place nor its"
        " door is a fact.",
        NextStep(
            "a person",
            "stop one of the two, or give it another name; the wires tell which of them has the device"
            + ("" if len(names) > 1 else f" (`ros2 topic info -v /{topic}` lists the publishers)"),
        ),
    )
    return True


def comes_and_goes(found: Answer, device: Device, clock: TimePhrases) -> bool:
    """Explain a device that goes OFFLINE and comes back. True if it does. If its readings are old when it
    is OFFLINE, they do not come; else an input of the device says so."""
    ages = device.flaps(clock.now)
    if len(ages) < FLAPS:
        return False
    heard_s = lasted(min(FLAPS_WITHIN_S, clock.now.at - device.began.at))
    often = f"{device.name} goes OFFLINE and comes back again and again ({len(ages)} times in {heard_s})"
    on = common.relays(device, clock)
    if max(ages) - min(ages) < STALLS_S:
        found.because = ("RELAY_RESTS",)
        found.say(
            f"{often}, though its readings are fresh: an input flickers, such as a contact for manual mode"
            f" or out of service{on}.",
            NextStep("a person", FLICKERS),
        )
        return True
    found.because = READINGS
    bus = f" The last error on its bus: {device.bus_error}." if device.bus_error else ""
    found.say(
        f"{often}: its readings stop and come again, because its module or bus answers late or not at"
        f" all. What it shows in between proves nothing{on}.{bus}",
        NextStep("a person", BUS),
    )
    return True


def own_fault(
    found: Answer, device: Device, clock: TimePhrases, around: OthersHeard, *, end: str = "open"
) -> bool:
    """Explain the most telling fault of the device itself. True if there is one. `end`: the position
    in which its door should be."""
    present = {code: detail for code, (detail, _) in device.faults(clock.now).items()}
    if around.reason is not None and around.reason.fault:
        present.setdefault(around.reason.fault, around.reason.text.partition(": ")[2])
    code = next((code for code in OWN if code in present), None)
    if code is None:
        return False
    why, look = OWN[code]
    cause, do = around.remedies.get(code, (f"its daemon reports {code}", f"mend {code}"))
    contact = {"open": "'opened'", "shut": "'closed'"}[end]
    detail = f": {present[code]}" if present[code] else ""
    found.because = ()
    found.say(
        f"{device.name} has a fault of its own, {code}{detail}."
        + (f" {why.format(contact=contact)}" if why else f" The likely cause: {cause}."),
        NextStep("a person", (look or do).format(end=end, contact=contact)),
    )
    return True

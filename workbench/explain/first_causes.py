"""Causes that an answer names before any other cause, for every kind of device.

There are three such causes: two nodes that publish under one name, readings that come and go, and a
fault of the device itself. As long as such a cause lasts, an answer blames nothing else.
"""

from collections.abc import Mapping
from typing import Final

from bridges.observe.limits import FLAPS, FLAPS_WITHIN_S
from workbench.explain import answer as common
from workbench.explain.answer import Answer, OthersHeard
from workbench.explain.device import Device
from workbench.explain.phrases import TimePhrases, lasted, listed

TWO_NODES: Final = "TWO_NODES_FOR_ONE_DEVICE"
BUS: Final = (
    "check the bus or network: the module at its end, its supply, cable and address, and on Modbus a"
    " second master on the line; `rmf-bridge log` shows each lost reply"
)
FLICKERS: Final = (
    "find what kept changing: an input that flickers (check its wire and contact), or a relay module"
    " that restarts; `rmf-bridge log` shows which"
)
CONTACT: Final = (
    "The leaf has not moved all the way, or the {contact} contact or its wire is bad: both look the"
    " same from here.",
    "look whether the door really stands {end}; if it does, check the {contact} contact and its wire;"
    " if it does not, check what stops the leaf, and the relay that drives it",
)
OWN: Final[Mapping[str, tuple[str, str]]] = {
    "INPUTS_NOT_FRESH": ("", BUS),
    "COMMUNICATION_LOST": ("", BUS),
    "OUTPUTS_NOT_WRITTEN": (
        "What the daemon asks for does not reach the controller, so the controller is not to blame.",
        "check the relays that the fault names: their supply, their line, and on Modbus whether a"
        " second master writes to them",
    ),
    "RELAY_RESTS": (
        "While the relay rests, the daemon asks the controller for nothing, so the controller is not to"
        " blame.",
        FLICKERS,
    ),
    "DOOR_OPENING_FAULT": CONTACT,
    "DOOR_TRAVEL_TIMEOUT": CONTACT,
    "RUNTIME_LIMIT_EXCEEDED": (
        "The car does not come, or the floor code does not show it there.",
        "",
    ),
    **dict.fromkeys(
        (
            "DOOR_CONTACTS_CONTRADICT",
            "DOOR_CODE_ILLEGAL",
            "DOOR_CONTROLLER_FAULT",
            "DOOR_POSITION_UNKNOWN",
            "FLOOR_CODE_ILLEGAL",
            "POSITION_LOST",
            "MOTION_CONTRADICTORY",
            "START_TIMEOUT",
        ),
        ("", ""),
    ),
}
"""Faults of the device itself, the most telling first.

Each code has an explanation, and the place where a person should look. "" stands for the text in
`bridges/runtime/faults.yaml`.
"""
READINGS: Final = ("INPUTS_NOT_FRESH", "COMMUNICATION_LOST")
OFFLINE: Final = (*READINGS, "OUTPUTS_NOT_WRITTEN", "MANUAL", "OUT_OF_SERVICE")
"""Faults that make a device OFFLINE."""
UNSTEADY: Final = "not steady:"
STALLS_S: Final = 0.5
"""Limit (s) for the ages that readings have when the device changes. Ages that differ by this limit or
more show that new readings did not come."""


def two_nodes(
    found: Answer, device: Device, clock: TimePhrases, around: OthersHeard, topic: str
) -> bool:
    """Explain that two nodes publish one device's states on this topic. Return whether this is the
    cause."""
    if TWO_NODES not in device.faults(clock.now) and not device.two_nodes(clock.now):
        return False
    names, nodes = device.nodes(clock.now), around.publishers(topic)
    named = f"these nodes publish {topic}: {nodes}" if nodes else "the messages do not name them"
    if len(names) > 1:
        named = listed(names)
    found.because = (TWO_NODES,)
    found.say(
        f"Two nodes publish states of {device.name} ({named}). Until one of the two is stopped, trust"
        " none of these states.",
        "a person",
        "find out by the wires which of the two has the device, and stop the other or give it another"
        f" name (`ros2 topic info -v /{topic}` lists the publishers)",
    )
    return True


def comes_and_goes(found: Answer, device: Device, clock: TimePhrases) -> bool:
    """Explain a device that goes OFFLINE and comes back. Return whether the device does.

    A listener of a few seconds may hear few changes. Therefore present faults from the daemon count
    too, such as lost readings or unsteady inputs. Old readings, or several unsteady inputs, show that
    no new readings came. Otherwise an input flickers.
    """
    ages = device.flaps(clock.now)
    _, unsteady, inputs = device.waits_said(clock.now).get(device.kind, "").partition(UNSTEADY)
    lost = any(code in READINGS for code in device.faults(clock.now))
    if len(ages) < (1 if unsteady else 2 if lost else FLAPS):
        return False
    heard_s = lasted(min(FLAPS_WITHIN_S, clock.now.at - device.began.at))
    on, often = common.relays(device, clock), f"{len(ages)} changes in {heard_s}"
    if len(ages) == 1:
        often = f"1 change in {heard_s}; its inputs are still unsteady:{inputs}"
    flickers = "," not in inputs and max(ages) - min(ages) < STALLS_S
    found.because = () if flickers else READINGS
    why = (
        "though its readings are fresh: an input flickers, as a contact for manual mode may"
        if flickers
        else "because its bus or module answers late, or at times not at all; the states in between"
        " prove nothing"
    )
    bus = f" The last error on its bus: {device.bus_error}." if device.bus_error else ""
    again = " again and again" if len(ages) > 1 else ""
    found.say(
        f"{device.name} goes OFFLINE and comes back{again} ({often}), {why}{on}.{bus}",
        "a person",
        FLICKERS if flickers else BUS,
    )
    return True


def own_fault(
    found: Answer,
    device: Device,
    clock: TimePhrases,
    around: OthersHeard,
    shown: str = "",
    end: str = "open",
) -> bool:
    """Explain the most telling fault of the device itself. Return whether the device has such a fault.

    `shown` is the door's published state. `end` is the state that the door should have. A door that is
    shown closed has not moved, so no contact is to blame.
    """
    present = {code: detail for code, (detail, _) in device.faults(clock.now).items()}
    if around.reason is not None and around.reason.fault:
        present.setdefault(around.reason.fault, around.reason.text.partition(": ")[2])
    if shown == "closed":
        present.pop("DOOR_OPENING_FAULT", None)
    code = next((code for code in OWN if code in present), None)
    if code is None:
        return False
    cause, do = around.remedies.get(code, (f"its daemon reports {code}", f"mend {code}"))
    why, look = OWN[code]
    names = {"end": end, "contact": {"open": "'opened'", "shut": "'closed'"}[end]}
    detail = f": {present[code].rstrip('.?')}" if present[code] else ""
    found.because = ()
    found.say(
        f"{device.name} has a fault of its own, {code}{detail}."
        f" {why.format(**names) or f'The likely cause: {cause}.'}",
        "a person",
        look.format(**names) or do,
    )
    return True

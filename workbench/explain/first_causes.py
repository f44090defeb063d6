"""Causes that an explanation names before any other cause, for every kind of device.

There are three such causes: two nodes that publish under one name, readings that come and go, and a
fault of the device itself. As long as such a cause lasts, the explanation blames nothing else.
"""

from collections.abc import Collection, Mapping
from typing import Final

from bridges.observe.limits import FLAPS, FLAPS_WITHIN_S
from workbench.explain import answer as common
from workbench.explain.answer import Answer, OthersHeard
from workbench.explain.device import Device
from workbench.explain.phrases import TimePhrases, lasted, listed

TWO_NODES: Final = "TWO_NODES_FOR_ONE_DEVICE"
BUS: Final = (
    "check the bus, network or broker, and the supply, cable and address of the module; on Modbus, look"
    " for a second master on the line; `rmf-bridge log` shows each lost reply"
)
FLICKERS: Final = (
    "find what kept changing: an input that flickers (check its wire and contact), or a relay module"
    " that restarts; `rmf-bridge log` shows which of the two"
)
CONTACT: Final = (
    "The leaf has not moved all the way, or the {contact} contact or its wire is bad. The daemon"
    " cannot tell which.",
    "look whether the door really stands {end}; if so, check the {contact} contact and its wire;"
    " if not, check what stops the leaf, and the relay that drives the leaf",
)
OWN: Final[Mapping[str, tuple[str, str]]] = {
    "INPUTS_NOT_FRESH": ("", BUS),
    "COMMUNICATION_LOST": ("", BUS),
    "OUTPUTS_NOT_WRITTEN": (
        "What the daemon asks for does not reach the controller, so the controller is not to blame.",
        "check the supply and the bus line of the relays that the fault names; on Modbus, check whether"
        " a second master writes to these relays",
    ),
    "RELAY_RESTS": (
        "The daemon keeps this relay off for a while, because the relay was switched too often."
        " Meanwhile the daemon asks the controller for nothing, so the controller is not to blame.",
        FLICKERS,
    ),
    **dict.fromkeys(
        (
            "DOOR_CONTACTS_CONTRADICT",
            "DOOR_CONTACTS_UNSTEADY",
            "DOOR_CODE_ILLEGAL",
            "DOOR_CONTROLLER_FAULT",
            "DOOR_POSITION_UNKNOWN",
            "FLOOR_CODE_ILLEGAL",
            "POSITION_LOST",
            "MOTION_CONTRADICTORY",
        ),
        ("", ""),
    ),
    "DOOR_OPENING_FAULT": CONTACT,
    "DOOR_TRAVEL_TIMEOUT": CONTACT,
    "RUNTIME_LIMIT_EXCEEDED": (
        "The car does not come, or the floor code does not show that the car has come.",
        "",
    ),
    "START_TIMEOUT": ("", ""),
}
"""Faults of the device itself. The fault that explains most comes first.

Each code has two texts: an explanation, and what a person should check. "" stands for the text in
`bridges/runtime/faults.yaml`.
"""
TEXTS: Final[Mapping[str, tuple[str, str]]] = {
    **OWN,
    "AGV_MODE_LOST": ("Until its next try the daemon asks the controller for nothing.", ""),
}
"""The texts of `OWN`, and of other faults that explain a device only in some states. A fault without
texts has those of `bridges/runtime/faults.yaml`."""
HARMLESS: Final = ("nothing", "wait", "intended")
"""The beginnings of the remedies that ask nobody to act at once."""
READINGS: Final = ("INPUTS_NOT_FRESH", "COMMUNICATION_LOST")
OFFLINE: Final = (*READINGS, "OUTPUTS_NOT_WRITTEN", "MANUAL", "OUT_OF_SERVICE")
"""Faults because of which a daemon publishes its device as OFFLINE."""
UNSTEADY: Final = "not steady:"
STALLS_S: Final = 0.5
"""Limit (s) for the difference between the ages of readings. Each age is the reading's age when the
device went OFFLINE or came back. A greater difference shows that no new readings came."""


def two_nodes(
    found: Answer, device: Device, clock: TimePhrases, around: OthersHeard, topic: str
) -> bool:
    """Check whether two nodes publish this device's states on this topic. If so, explain this and
    return True."""
    if TWO_NODES not in device.faults(clock.now) and not device.two_nodes(clock.now):
        return False
    names, nodes = device.nodes(clock.now), around.publishers(topic)
    named = (
        f"these nodes publish {topic}: {nodes}" if nodes else "the messages do not name the nodes"
    )
    if len(names) > 1:
        named = listed(names)
    found.because = (TWO_NODES,)
    found.say(
        f"Two nodes publish states of {device.name} ({named}). Until one of the two is stopped, trust"
        " none of these states.",
        "a person",
        "follow the wires to find out which of the two nodes has the device; stop the other node, or"
        f" give its device another name (`ros2 topic info -v /{topic}` lists the publishers)",
    )
    return True


def comes_and_goes(found: Answer, device: Device, clock: TimePhrases) -> bool:
    """Check whether the device goes OFFLINE and comes back. If so, explain this and return True.

    A listener of a few seconds may hear few changes. Therefore fewer changes are enough if the daemon
    reports lost readings or unsteady inputs. The cause is lost readings if readings were old, or if
    several inputs were unsteady. Otherwise the cause is one input that flickers.
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
        "though its readings are fresh: an input flickers, for example a contact for manual mode"
        if flickers
        else "because its bus or module answers late, or sometimes not at all; do not rely on its"
        " states meanwhile"
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
    codes: Collection[str] = OWN.keys(),
) -> bool:
    """Explain the fault of the device itself that explains most. Return whether the device has one of
    the faults `codes`.

    `shown` is the door's published state. `end` is the state that the door should have. If the door is
    shown closed, the leaf has not moved. Therefore the text does not blame the end contact.
    """
    present = {code: detail for code, (detail, _) in device.faults(clock.now).items()}
    if around.reason is not None and around.reason.fault:
        present.setdefault(around.reason.fault, around.reason.text.partition(": ")[2])
    if shown == "closed":
        present.pop("DOOR_OPENING_FAULT", None)
    code = next((code for code in codes if code in present), None)
    if code is None:
        return False
    cause, do = around.remedies.get(code, (f"its daemon reports {code}", f"mend {code}"))
    why, look = TEXTS.get(code, ("", ""))
    names = {"end": end, "contact": {"open": "'opened'", "shut": "'closed'"}[end]}
    found.because = ()
    found.say(
        f"{device.name} has a fault of its own, {named(code, present[code])}."
        f" {why.format(**names) or f'The likely cause: {cause}.'}",
        "a person",
        look.format(**names) or do,
    )
    return True


def named(code: str, detail: str) -> str:
    """Return the fault's code and detail, for the middle of a sentence."""
    return f"{code}: {detail.rstrip('.?')}" if detail else code


def needs_a_person(found: Answer, device: Device, clock: TimePhrases, around: OthersHeard) -> bool:
    """Check whether a device that nobody requests has a fault that needs a person. If so, explain this
    and return True."""
    faults = device.faults(clock.now)
    for code, (detail, _) in faults.items():
        cause, do = around.remedies.get(code, ("", "nothing"))
        if not do.startswith(HARMLESS):
            found.because = tuple(other for other in faults if other != code)
            what = f"But {device.name} has a fault, {named(code, detail)}."
            found.say(f"{what} The likely cause: {cause}.", "a person", do)
            return True
    return False

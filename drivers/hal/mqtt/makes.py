"""Relays and inputs of well-known makes on MQTT: their topics, payloads and fields.

Each function takes the device's name on MQTT, the name of one relay or input (`part`), and the time of
the relay's timer in seconds (None without a timer). Each function returns the YAML keys of a point
(`points.py`) with their values.
"""

import json
import re
from collections.abc import Callable, Mapping
from typing import Any, Final, Literal

Profile = Literal["shelly-gen2", "tasmota", "zigbee2mqtt"]
Keys = Mapping[str, Any]


def shelly(device: str, part: str, off_s: float | None) -> Keys:
    """Return the keys for `switch:0` or `input:0` of a Shelly of generation 2 or later. `device` is the
    Shelly's topic prefix.

    The web page of the Shelly must have both "Enable MQTT Control" and "Generic status update over
    MQTT" on. The commands to a switch use RPC, because `toggle_after` is a parameter of `Switch.Set`.
    Sources: shelly-api-docs.shelly.cloud, gen2, ComponentsAndServices: Mqtt (`<prefix>/status/…`,
    `<prefix>/command` with `status_update`, `<prefix>/online`), Switch (`output`, `Switch.Set`) and
    Input (`state`).
    """
    sort, number = _matched(part, r"(switch|input):([0-9]{1,2})", "switch:0 or input:0")
    keys = {
        "topic": f"{device}/status/{part}",
        "field": "output" if sort == "switch" else "state",
        "ask": {"topic": f"{device}/command", "payload": "status_update"},
        "availability": {"topic": f"{device}/online", "offline": ["false"]},
    }
    if sort == "input":
        return keys
    timer = {} if off_s is None else {"toggle_after": off_s}
    on, off = (
        _switch_set(int(number), {"on": on} | more) for on, more in ((True, timer), (False, {}))
    )
    return keys | {"command": {"topic": f"{device}/rpc", "payload_on": on, "payload_off": off}}


def tasmota(device: str, part: str, off_s: float | None) -> Keys:
    """Return the keys for `POWER1` or `Switch1` of a device with Tasmota. `device` is its topic.

    A timer is the device's own setting `PulseTime`. Each `POWER1 ON` starts the timer again. For times
    from 12 s on, set `PulseTime1` to the seconds plus 100. A switch needs a `SwitchMode` of 1 or 2. To
    a command without a payload, Tasmota answers with the present value. A device with a single relay
    answers on `POWER`, so write `POWER` for such a device. Sources: tasmota.github.io/docs: Commands
    (Power, PulseTime, Status 10), MQTT (topics cmnd, stat and tele, LWT) and Buttons-and-Switches.
    """
    sort, _ = _matched(part, r"(POWER|Switch)([0-9]{0,2})", "POWER1 or Switch1")
    away = {"topic": f"tele/{device}/LWT", "offline": ["Offline"]}
    words: dict[str, Any] = {"when": ["ON"], "when_not": ["OFF"], "availability": away}
    if sort == "Switch":
        ask = {"topic": f"cmnd/{device}/Status", "payload": "10"}
        return words | {
            "topic": f"stat/{device}/STATUS10",
            "field": f"StatusSNS.{part}",
            "ask": ask,
        }
    command = {"topic": f"cmnd/{device}/{part}", "payload_on": "ON", "payload_off": "OFF"}
    result = {"topic": f"stat/{device}/{part}", "ask": {"topic": command["topic"]}}
    return words | result | {"command": command}


def zigbee2mqtt(device: str, part: str, off_s: float | None) -> Keys:
    """Return the keys for one value that a Zigbee2MQTT device publishes, such as `state` (a relay) or
    `contact`. `device` is the device's friendly name.

    `contact` is true while the contact is closed. The relay's firmware must support `on_time`. A
    battery sensor sleeps and does not answer `get`, so the bus never asks for a sensor's values. The
    availability topic is published only if Zigbee2MQTT has `availability` enabled. Sources:
    www.zigbee2mqtt.io/guide/usage/mqtt_topics_and_messages.html, and "On with timed off" on the pages
    of switches below www.zigbee2mqtt.io/devices.
    """
    _matched(part, r"([A-Za-z][A-Za-z0-9_]{0,40})()", "state, contact or another property")
    away = ['{"state":"offline"}', _json({"state": "offline"}), "offline"]
    keys = {
        "topic": f"zigbee2mqtt/{device}",
        "field": part,
        "availability": {"topic": f"zigbee2mqtt/{device}/availability", "offline": away},
    }
    if not part.startswith("state"):
        return keys
    timer = {} if off_s is None else {"on_time": off_s}
    on, off = _json({part: "ON"} | timer), _json({part: "OFF"})
    return keys | {
        "when": ["ON"],
        "when_not": ["OFF"],
        "ask": {"topic": f"zigbee2mqtt/{device}/get", "payload": _json({part: ""})},
        "command": {"topic": f"zigbee2mqtt/{device}/set", "payload_on": on, "payload_off": off},
    }


MAKES: Final[Mapping[Profile, Callable[[str, str, float | None], Keys]]] = {
    "shelly-gen2": shelly,
    "tasmota": tasmota,
    "zigbee2mqtt": zigbee2mqtt,
}


def _matched(part: str, pattern: str, examples: str) -> tuple[str, str]:
    found = re.fullmatch(pattern, part)
    if not found:
        raise ValueError(f"{part!r} is no relay or input of this make: write {examples}")
    return found[1], found[2]


def _switch_set(number: int, more: Keys) -> str:
    params = {"id": number} | dict(more)
    return _json({"id": 1, "src": "rmf-bridges", "method": "Switch.Set", "params": params})


def _json(value: Keys) -> str:
    return json.dumps(value)

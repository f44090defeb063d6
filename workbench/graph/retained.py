"""The retained MQTT messages that show RMF's devices to other systems.

    PREFIX/status                     online; after our end offline (MQTT's last will)
    PREFIX/KIND/ID/state              one JSON object
    PREFIX/KIND/ID/availability       online if states come and their reading is fresh, else offline
    HOMEASSISTANT/device/…/config     Home Assistant's discovery, one message for each device:
                                      https://www.home-assistant.io/integrations/mqtt/#device-discovery-payload

A reader cannot see the age of a retained message. Therefore each message expires at the broker if
nobody renews the message (MQTT 5, 3.3.2.3.3).

ID is the device's name. The characters A-Z a-z 0-9 and - stay. Every other byte of the name becomes
_XX, in hexadecimal.

All functions are pure, because rows and the time are arguments.
"""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from typing import Any, Final, NamedTuple

from bridges import VERSION
from bridges.messages import definitions as d
from bridges.messages import words
from bridges.observe.all_devices import AnyDevice
from bridges.observe.limits import SILENT_S
from workbench.graph.board import BoardRow

RENEWED_S: Final = 60.0
EXPIRES_S: Final = 180
"""Time (s) until a message expires. This time is three times RENEWED_S. If nobody renews a device's
messages, the broker drops the device."""
TEXT_MAX: Final = 255
"""Maximum length (characters) of an entity's state in Home Assistant."""


class Retained(NamedTuple):
    """One message. `news` is the part of the content that is compared: everything except times. When
    `news` changes, the message is published immediately."""

    topic: str
    payload: str
    news: object


class ShownDevice(NamedTuple):
    """A device, together with the row that `watch` shows for this device."""

    device: AnyDevice
    row: BoardRow


class Retainer:
    """The messages that the broker should hold, and the messages already given to the broker.

    `discovery` is Home Assistant's prefix, or None without discovery.
    """

    def __init__(self, prefix: str, discovery: str | None) -> None:
        self._prefix = prefix
        self._discovery = discovery
        self._held: dict[str, tuple[object, float]] = {}

    @property
    def status(self) -> str:
        """The topic that tells whether this publisher lives."""
        return f"{self._prefix}/status"

    def forget(self) -> None:
        """Publish everything again, because the broker may have lost the messages."""
        self._held.clear()

    def due(self, shown: Iterable[ShownDevice], now: float, wall: float) -> Iterator[Retained]:
        """Yield the messages to publish at `now` (monotonic s). An empty payload deletes the message of
        its topic."""
        wanted = {self.status: Retained(self.status, "online", "online")}
        wanted |= {m.topic: m for one in shown for m in self._messages(one, now, wall)}
        for topic in [topic for topic in self._held if topic not in wanted]:
            yield Retained(topic, "", None)
        for message in wanted.values():
            news, at = self._held.get(message.topic, (None, 0.0))
            if message.news != news or now - at >= RENEWED_S:
                yield message

    def given(self, message: Retained, now: float) -> None:
        """Note that the broker got this message."""
        if message.payload:
            self._held[message.topic] = message.news, now
        else:
            self._held.pop(message.topic, None)

    def _messages(self, shown: ShownDevice, now: float, wall: float) -> Iterator[Retained]:
        device, row = shown
        path = f"{device.kind}/{_identifier(device.id)}"
        content = _content(device.state) | {
            "name": row.name,
            "summary": row.state,
            "held_by": row.held_by.removeprefix("-"),
            "waiting": row.waiting,
            "mark": row.mark.partition(" ")[0],
            "faults": row.faults,
            "simulated": row.simulated,
        }
        times = {"read_at": _iso(device.stamped_at), "published_at": _iso(wall)}
        state = f"{self._prefix}/{path}/state"
        yield Retained(state, json.dumps(content | times), (row.news(), _content(device.state)))
        heard = device.last_state is not None and now - device.last_state.at <= SILENT_S
        word = "online" if heard and not device.reading.value else "offline"
        available = f"{self._prefix}/{path}/availability"
        yield Retained(available, word, word)
        if self._discovery:
            topic = f"{self._discovery}/device/{_identifier(self._prefix)}_{path.replace('/', '_')}"
            found = json.dumps(self._discovered(device, row.name, state, available))
            yield Retained(f"{topic}/config", found, found)

    def _discovered(
        self, device: AnyDevice, name: str, state: str, available: str
    ) -> Mapping[str, Any]:
        own = f"{_identifier(self._prefix)}_{device.kind}_{_identifier(device.id)}"
        parts = {
            "state": "summary",
            **({"floor": "floor", "door": "door"} if _is_lift(device) else {}),
        }
        sensors = {
            f"{own}_{part}": {
                "p": "sensor",
                "name": part,
                "unique_id": f"{own}_{part}",
                "value_template": f"{{{{ value_json.{field}[:{TEXT_MAX}] }}}}",
                "expire_after": EXPIRES_S,
            }
            for part, field in parts.items()
        }
        problem = {
            "p": "binary_sensor",
            "name": "problem",
            "device_class": "problem",
            "unique_id": f"{own}_problem",
            "value_template": "{{ 'ON' if value_json.mark or value_json.faults else 'OFF' }}",
            "expire_after": EXPIRES_S,
            "json_attributes_topic": state,
            "availability": [{"topic": self.status}],
        }
        return {
            "dev": {"ids": own, "name": f"{device.kind} {name}"[:TEXT_MAX]},
            "o": {"name": "rmf-bridges", "sw": VERSION},
            "cmps": {**sensors, f"{own}_problem": problem},
            "state_topic": state,
            "availability": [{"topic": self.status}, {"topic": available}],
            "availability_mode": "all",
            "qos": 1,
        }


def _is_lift(device: AnyDevice) -> bool:
    return isinstance(device.state, d.LiftState)


def _content(state: object) -> dict[str, object]:
    """Return the fields that only this kind of device has. The values are RMF's words."""
    match state:
        case d.LiftState():
            return {
                "floor": words.printable(state.current_floor),
                "destination": words.printable(state.destination_floor),
                "door": words.plain(d.LiftDoor, state.door_state),
                "motion": words.plain(d.LiftMotion, state.motion_state),
                "mode": words.plain(d.LiftMode, state.current_mode),
            }
        case d.DoorState():
            return {"mode": words.plain(d.DoorModeValue, state.current_mode.value)}
        case d.ChargerState():
            said = words.plain(d.ChargerStateValue, state.state)
            return {"charger_state": said, "error": words.printable(state.error_message)}
    return {}


def _identifier(name: str) -> str:
    """Return a name in the characters that topics and discovery allow. Two different names never become
    the same."""
    return re.sub(
        r"[^A-Za-z0-9-]",
        lambda found: "".join(f"_{byte:02X}" for byte in found[0].encode("utf-8", "surrogatepass")),
        name,
    )


def _iso(at: float) -> str | None:
    """Return a time (s since the epoch) as ISO 8601. Return None for never, and for a time that the
    calendar does not have."""
    try:
        return (
            datetime.fromtimestamp(at, UTC).isoformat(timespec="milliseconds") if at > 0 else None
        )
    except (OverflowError, OSError, ValueError):
        return None

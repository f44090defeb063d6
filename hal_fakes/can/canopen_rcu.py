"""Xnergy's receiver as a CANopen node: `canopen.LocalNode`, with a plant behind its objects.

These parts of the receiver can fail. The parts of the plant and of the bus can fail as well.

|           | off    | stuck          | slow         | garbage            | wrong                  |
| node      | silent | answers no SDO | answers late | answers five bytes | answers another object |
| heartbeat | none   | none           | each second  | has three bytes    | state `stopped`        |

A node that is `off` loses its power, and sends its boot-up message when it is back.
"""

import time
from typing import Final

import can
import canopen
from canopen.objectdictionary import ODRecord, ODVariable, datatypes

from drivers.charger.canopen import HEARTBEAT_S, OBJECTS, CanOpenChargerSettings
from hal_fakes.can.side import Send
from hal_fakes.fake import Fake
from hal_fakes.plants.charger import Reading
from hal_fakes.plants.plant import Plant
from hal_fakes.plants.xnergy_rcu import SIGNALS, rcu_plant, words

TYPES: Final = {1: datatypes.UNSIGNED8, 2: datatypes.UNSIGNED16}
BEAT: Final = {None: HEARTBEAT_S, "slow": 1.0}
STARTING, STOPPED, OPERATIONAL = 0, 4, 5
NAMES: Final = {(found.index, found.subindex): name for name, found in OBJECTS.items()}


class CanOpenRcu:
    """Xnergy's receiver as a station of a simulated CAN bus (`hal_fakes.can.side.CanStation`)."""

    def __init__(self, plant: Plant, node: int) -> None:
        self.plant = plant
        self._id = node
        self._latched = 0
        self._beat_at = float("-inf")
        self._was_off = False
        self._network = _Network(self)
        self._node = canopen.LocalNode(node, dictionary())
        self._node.associate_network(self._network)
        self._node.add_read_callback(self._read)  # type: ignore[no-untyped-call]
        self._node.add_write_callback(self._write)  # type: ignore[no-untyped-call]
        self._send: Send | None = None

    def hear(self, message: can.Message, now: float, send: Send) -> None:
        """Answer a request, if the request is for this node."""
        if self.plant.failures.get("node") in ("off", "stuck") or message.is_extended_id:
            return
        self._send = send
        self._network.notify(message.arbitration_id, bytearray(message.data), now)

    def tick(self, now: float, send: Send) -> None:
        """Send the heartbeat if it is due."""
        off = self.plant.failures.get("node") == "off"
        if off and not self._was_off:
            self.plant.drive("power", False, now)
        if off:
            self._was_off = True
            return
        mode = self.plant.failures.get("heartbeat")
        if mode in ("off", "stuck") or now < self._beat_at + BEAT.get(mode, HEARTBEAT_S):
            return
        self._beat_at = now
        state = STARTING if self._was_off else STOPPED if mode == "wrong" else OPERATIONAL
        self._was_off = False
        beat = bytes((state, 0, 0)) if mode == "garbage" else bytes((state,))
        send(frame(0x700 + self._id, beat))

    def reply(self, can_id: int, answer: bytes) -> None:
        """Send the answer that the canopen library has made. If the node fails as `garbage` or `wrong`,
        spoil the answer first. If it fails as `slow`, send the answer late."""
        mode = self.plant.failures.get("node")
        if mode == "garbage":
            answer = answer[:5]
        elif mode == "wrong":
            answer = answer[:3] + bytes((answer[3] ^ 0x40,)) + answer[4:]
        assert self._send  # a request has set this, because an answer comes only after a request
        self._send(frame(can_id, answer), late=mode == "slow")

    def _reading(self) -> Reading:
        self.plant.advance(time.monotonic())
        reading = self.plant.reading()
        assert isinstance(reading, Reading)
        return reading

    def _read(self, index: int, subindex: int, od: object) -> int | None:
        at = (index, subindex)
        name = NAMES.get(at)
        if name is None or name in SIGNALS:
            return None
        found = words(self._reading(), self._latched)
        self._latched = found["latched_high"] << 16 | found["latched_low"]
        return found[name]

    def _write(self, index: int, subindex: int, od: object, data: bytes) -> None:
        if (name := NAMES.get((index, subindex), "")) in SIGNALS:
            self.plant.drive(SIGNALS[name], bool(data[0]), time.monotonic())


class _Network(canopen.Network):
    """The library's network, without a bus and without threads."""

    def __init__(self, rcu: CanOpenRcu) -> None:
        super().__init__()
        self._rcu = rcu

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Send an answer of the node."""
        self._rcu.reply(can_id, bytes(data))


def frame(can_id: int, payload: bytes) -> can.Message:
    """Make a frame with an id of eleven bits."""
    return can.Message(arbitration_id=can_id, is_extended_id=False, data=payload)


def dictionary() -> canopen.ObjectDictionary:
    """Return the RCU's published objects."""
    made = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
    for found in OBJECTS.values():
        if found.index not in made:
            made.add_object(ODRecord(f"objects {found.index:04X}", found.index))
        variable = ODVariable(str(found), found.index, found.subindex)
        variable.data_type = TYPES[found.octets]
        record = made[found.index]
        assert isinstance(record, ODRecord)
        record.add_member(variable)
    return made


FAKE = Fake[CanOpenChargerSettings](
    plant=lambda name, settings, wires: rcu_plant(name, "node", "heartbeat", "bus"),
    station=lambda plant, settings: CanOpenRcu(plant, settings.node),
)

"""Xnergy's receiver (`xnergy.py`) on CANopen. The driver reads and writes the receiver's objects by
SDO.

The maker's defaults are 250 kbit/s and node id 10. The node sends a heartbeat (operational) every 100
ms. The driver does not read a node whose heartbeat is missing. Receivers with old firmware send no
heartbeat. For such a receiver write `heartbeat: none`.
"""

from collections.abc import Iterable, Mapping
from typing import Annotated, Final, Literal

import msgspec

from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from drivers.charger import xnergy
from drivers.driver_type import DriverType
from drivers.hal import can
from drivers.hal.can.canopen import CanOpenNode

HEARTBEAT_S: Final = 0.1

BeatTimeout = Annotated[float, msgspec.Meta(ge=0.15, le=10, extra={"unit": "s"})]


class Object(msgspec.Struct, frozen=True):
    """An unsigned little-endian CANopen object that the driver reads by SDO. `octets` is the object's
    width in bytes."""

    index: int
    subindex: int
    octets: int = 2

    def __str__(self) -> str:
        return f"SDO 0x{self.index:04X}:{self.subindex:02X}"


OBJECTS: Final[Mapping[str, Object]] = {
    xnergy.ENABLE: Object(0x2000, 1, 1),
    xnergy.CHECK_RANGE: Object(0x2000, 2, 1),
    "latched_low": Object(0x2002, 0x01),
    "latched_high": Object(0x2002, 0x02),
    "error_low": Object(0x2002, 0x03),
    "error_high": Object(0x2002, 0x04),
    "volts": Object(0x2002, 0x06),
    "amps": Object(0x2002, 0x07),
    "state": Object(0x2002, 0x0A),
    "range": Object(0x2002, 0x0D),
}


class CanOpenChargerSettings(
    ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True
):
    """The settings of one receiver, which a robot carries."""

    node: Annotated[
        int,
        msgspec.Meta(ge=1, le=127),
        tells("the receiver's CANopen node id; the maker's default is 10."),
    ]
    heartbeat: Annotated[
        Literal["required", "none"], tells("`none` for old firmware, which sends no heartbeat.")
    ] = "required"
    heartbeat_timeout_s: Annotated[
        BeatTimeout, tells("the receiver counts as lost after this time without a heartbeat.")
    ] = 0.5


def claims(settings: CanOpenChargerSettings) -> Iterable[tuple[str, tuple[str, ...]]]:
    """Yield the node with its path in the YAML. No other device of the bus may use the node."""
    yield f"node {settings.node}", ("node",)


def describe(
    settings: CanOpenChargerSettings, bus_settings: can.CanSettings
) -> list[tuple[str, str]]:
    """Return the rows that `check` prints instead of a wiring table. Each row is a subject and its
    meaning."""
    rows = [("bus", f"{can.describe(bus_settings)}; node {settings.node}")]
    if settings.heartbeat == "required":
        lost = f"lost after {settings.heartbeat_timeout_s:g} s"
        rows.append(("heartbeat", f"each {HEARTBEAT_S:g} s, {lost}"))
    return rows + xnergy.rows(settings, {name: str(found) for name, found in OBJECTS.items()})


def warnings(settings: CanOpenChargerSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake."""
    found = list(xnergy.warnings(settings, "CAN"))
    if settings.heartbeat == "none":
        found.append(
            (("heartbeat",), "without a heartbeat the restart of a receiver is not noticed")
        )
    return sorted(found)


def create(name: str, settings: CanOpenChargerSettings, bus: can.CanBus) -> xnergy.Receiver:
    """Make the receiver's driver on its bus. The driver sends nothing before the first reading."""
    return xnergy.Receiver(settings, Objects(settings, bus))


class Objects:
    """Access to the objects of one node (`xnergy.ReceiverAccess`). The driver reads no temperatures,
    because the maker publishes no objects for temperatures."""

    reads = xnergy.ALWAYS

    def __init__(self, settings: CanOpenChargerSettings, bus: can.CanBus) -> None:
        limit_s = settings.heartbeat_timeout_s if settings.heartbeat == "required" else None
        self._node = CanOpenNode(bus, settings.node, limit_s)
        self._starts = 0
        self.insist = bus.insist
        self.now = bus.now

    def alive(self) -> bool:
        """Check the heartbeat. Return True if the node has restarted since the last call of `alive`.
        Raises HalError."""
        self._node.alive()
        before, self._starts = self._starts, self._node.starts
        return before != self._starts

    def read(self, names: Iterable[str]) -> dict[str, int]:
        """Read these objects with one SDO request for each object. Raises HalError."""
        objects = ((name, OBJECTS[name]) for name in names)
        return {name: self._node.read(o.index, o.subindex, o.octets) for name, o in objects}

    def write(self, name: str, value: int, safe: bool = False) -> None:
        """Write an object by SDO. Raises HalError if the node does not acknowledge the write."""
        found = OBJECTS[name]
        self._node.write(found.index, found.subindex, found.octets, value, safe=safe)


DRIVER = DriverType(
    settings=CanOpenChargerSettings,
    buses=("can",),
    create=create,
    describe=describe,
    claims=claims,
    warnings=warnings,
    fake="hal_fakes.can.canopen_rcu",
)

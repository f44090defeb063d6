"""A wireless charger's receiver (Xnergy RCU) on CANopen: read and commanded by SDO.

Its numbers are in `xnergy.py`. Bitrate 250 kbit/s and node 10 are the maker's; the node says
each 100 ms that it lives, and one whose heartbeat stays away is not read at all. No object for clearing
an error is published: an error ends by itself, or with the receiver's power.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Annotated, Final, Literal

import msgspec

from bridges.charger.settings import ChargerSettings
from bridges.charger.signals import Activity, ChargerOutputs, ChargerSample
from drivers import DriverError
from drivers.charger import xnergy
from drivers.driver_type import DriverType
from drivers.hal import can
from drivers.hal.can.canopen import CanOpenNode

ALWAYS: Final = ("state", "error_low", "error_high", "volts", "amps", "range")
IN_ERROR: Final = ("latched_low", "latched_high")

BeatTimeout = Annotated[float, msgspec.Meta(ge=0.15, le=10, extra={"unit": "s"})]


class Settings(ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One receiver.

    `node`: its CANopen node number; the maker's is 10.
    `heartbeat`: `none` for a receiver whose old firmware sends none.
    `heartbeat_timeout_s`: a receiver that has not been heard for so long does not live.
    """

    node: Annotated[int, msgspec.Meta(ge=1, le=127)]
    heartbeat: Literal["required", "none"] = "required"
    heartbeat_timeout_s: BeatTimeout = 0.5


def claims(settings: Settings) -> Iterable[tuple[str, tuple[str, ...]]]:
    """What no other device of the bus may use: (place, path)."""
    yield f"node {settings.node}", ("node",)


def describe(settings: Settings, bus_settings: can.Settings) -> list[tuple[str, str]]:
    """What `check` prints in place of a wiring table: (what, meaning)."""
    rows = [("bus", f"{can.describe(bus_settings)}; node {settings.node}")]
    if settings.heartbeat == "required":
        rows.append(("heartbeat", f"each 0.1 s, lost after {settings.heartbeat_timeout_s:g} s"))
    rows += [(name, f"read SDO {where.sdo}") for name, where in xnergy.READS.items() if where.sdo]
    rows += [
        ("power", f"write SDO {xnergy.ENABLE.sdo}: 1 starts from idle, 0 stops"),
        ("range check", f"write SDO {xnergy.CHECK_RANGE.sdo} before each start"),
        ("clear error", "no object for it is published: cycle the receiver's power"),
        ("end of the daemon", "0 is written" if settings.on_death == "stop" else "nothing"),
    ]
    return rows + xnergy.state_rows()


def warnings(settings: Settings) -> Iterable[tuple[tuple[str, ...], str]]:
    """What is legal but worth a look: (path, text)."""
    yield (
        (),
        "the maker's published objects are not tried on hardware: watch the first charge, and pull"
        " the CAN plug during one",
    )
    if settings.heartbeat == "none":
        yield ("heartbeat",), "without it a receiver that restarts is not noticed"
    if settings.receivers:
        yield ("receivers",), "this controller tells no receiver's id: it will charge nobody"


def create(name: str, settings: Settings, bus: can.CanBus) -> "CanOpenCharger":
    """The receiver on its bus; nothing is sent before the first reading."""
    return CanOpenCharger(settings, bus)


class CanOpenCharger:
    """`drivers.Driver` of one receiver."""

    def __init__(self, settings: Settings, bus: can.CanBus) -> None:
        self._settings = settings
        self._now = bus.now
        limit_s = settings.heartbeat_timeout_s if settings.heartbeat == "required" else None
        self._node = CanOpenNode(bus, settings.node, limit_s)
        self._told = xnergy.Told()
        self._starts = 0
        self._code = -1
        self._touched = False

    def open(self) -> None:
        """Nothing is claimed and nothing sent: a charge under way is not ours to stop."""

    def read(self) -> ChargerSample:
        """The receiver now. Raises DriverError."""
        self._node.alive()
        if self._node.starts != self._starts:
            self._starts = self._node.starts
            self._told = replace(self._told, enabled=None)
        words = {name: self._word(name) for name in ALWAYS}
        if xnergy.activity(words["state"]) is Activity.ERROR:
            words |= {name: self._word(name) for name in IN_ERROR}
        self._code = words["state"]
        return xnergy.sample(words, xnergy.settled(self._told, self._now()))

    def write(self, outputs: ChargerOutputs) -> None:
        """Start, stop or check the range, where that is due. Raises DriverError."""
        told, orders = xnergy.steer(self._told, outputs, self._code, self._now())
        if orders.enable is not None:
            self._enable(orders.enable)
        if orders.check_range:
            self._told = replace(self._told, range_checks=told.range_checks, asked_at=told.asked_at)
            self._set(xnergy.CHECK_RANGE, 1)
        self._told = told

    def make_safe(self) -> None:
        """What the settings say of the daemon's end: stopped, and acknowledged, or left alone."""
        if self._settings.on_death == "stop":
            self._enable(False)

    def close(self) -> None:
        """Stopped, if it may be on and may not stay so; and let go."""
        if self._touched and self._told.enabled is not False:
            try:
                self.make_safe()
            except DriverError:
                return  # it was tried; make_safe has said so before

    def _enable(self, on: bool) -> None:
        self._touched = True
        self._told = replace(self._told, enabled=None)
        self._set(xnergy.ENABLE, int(on))
        self._told = replace(self._told, enabled=on)

    def _set(self, where: xnergy.Where, number: int) -> None:
        assert where.sdo
        self._node.write(where.sdo.index, where.sdo.subindex, where.sdo.octets, number)

    def _word(self, name: str) -> int:
        where = xnergy.READS[name].sdo
        assert where
        return self._node.read(where.index, where.subindex, where.octets)


DRIVER = DriverType(
    settings=Settings,
    buses=("can",),
    create=create,
    describe=describe,
    claims=claims,
    warnings=warnings,
    fake="hal_fakes.can.canopen_rcu",
)

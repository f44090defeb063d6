"""Xnergy's receiver (`xnergy.py`) on Modbus: its input registers and coils.

The maker's defaults are unit id 16 and 9600 baud. The maker's own driver reads input registers 0 to
100, at most 50 in one request.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Final

from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from drivers.charger import xnergy
from drivers.driver_type import DriverType
from drivers.hal import modbus
from drivers.hal.modbus.points import Point
from drivers.hal.modbus.registers import Unit, at

PLACES: Final[Mapping[str, str]] = {
    xnergy.ENABLE: "coil 0",
    xnergy.CHECK_RANGE: "coil 2",
    "latched_low": "input register 0",
    "latched_high": "input register 1",
    "amps": "input register 31",
    "volts": "input register 32",
    "device_c": "input register 36",
    "coil_c": "input register 37",
    "state": "input register 51",
    "error_low": "input register 52",
    "error_high": "input register 53",
    "range": "input register 100",
}


class ModbusChargerSettings(ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of one receiver, which a robot carries."""

    unit: Annotated[Unit, tells("the receiver's Modbus unit id; the maker's default is 16.")]


def points(settings: ModbusChargerSettings) -> dict[str, Point]:
    """Return the register or coil for each name of PLACES."""
    return {name: at(settings.unit, place) for name, place in PLACES.items()}


def claims(settings: ModbusChargerSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each coil that the driver writes, with its path in the YAML. No other device may use these
    coils."""
    for name in (xnergy.ENABLE, xnergy.CHECK_RANGE):
        yield str(points(settings)[name]), ("unit",)


def describe(
    settings: ModbusChargerSettings, bus_settings: modbus.ModbusSettings
) -> list[tuple[str, str]]:
    """Return the rows that `check` prints instead of a wiring table. Each row is a subject and its
    meaning."""
    return xnergy.rows(settings, {name: str(point) for name, point in points(settings).items()})


def warnings(settings: ModbusChargerSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake."""
    return xnergy.warnings(settings, "bus")


def create(name: str, settings: ModbusChargerSettings, bus: modbus.ModbusBus) -> xnergy.Receiver:
    """Make the receiver's driver on its bus. The driver sends nothing before the first reading."""
    return xnergy.Receiver(settings, Registers(settings, bus))


class Registers:
    """`xnergy.ReceiverAccess` on the registers and coils of one unit."""

    reads = (*xnergy.ALWAYS, *xnergy.TEMPERATURES)

    def __init__(self, settings: ModbusChargerSettings, bus: modbus.ModbusBus) -> None:
        self._points = points(settings)
        self._bus = bus
        self.insist = bus.insist
        self.now = bus.now

    def alive(self) -> bool:
        """Return False, because Modbus has no heartbeat, which would show a restart. Only a failed read
        shows that the unit does not answer."""
        return False

    def read(self, names: Iterable[str]) -> dict[str, int]:
        """Read the registers of these names in as few requests as possible. Raises HalError."""
        wanted = {name: self._points[name] for name in names}
        image = self._bus.cells(wanted.values())
        return {name: image[point] for name, point in wanted.items()}

    def write(self, name: str, value: int, safe: bool = False) -> None:
        """Write a register or coil. Raises HalError, also if the unit's echo differs from the
        request."""
        self._bus.write(self._points[name], value, safe)


DRIVER = DriverType(
    settings=ModbusChargerSettings,
    buses=("modbus",),
    create=create,
    describe=describe,
    claims=claims,
    warnings=warnings,
    fake="hal_fakes.plants.xnergy_rcu",
)

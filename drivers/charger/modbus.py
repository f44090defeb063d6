"""A wireless charger's receiver (Xnergy RCU) on Modbus: read and commanded by registers and coils.

Its numbers are in `xnergy.py`: unit 16 at 9600 baud are the maker's. No place for clearing an
error is published: an error ends by itself, or with the receiver's power.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

from bridges.charger.settings import ChargerSettings
from bridges.charger.signals import Activity, ChargerOutputs, ChargerSample
from drivers import DriverError
from drivers.charger import xnergy
from drivers.driver_type import DriverType
from drivers.hal import modbus
from drivers.hal.modbus.points import Point
from drivers.hal.modbus.registers import Unit, at, read, write

ALWAYS: Final = ("state", "error_low", "error_high", "volts", "amps", "range")
IN_ERROR: Final = ("latched_low", "latched_high")
COMMANDS: Final = (xnergy.ENABLE, xnergy.CHECK_RANGE)


class Settings(ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One receiver.

    `unit`: its Modbus unit; the maker's is 16.
    """

    unit: Unit


def claims(settings: Settings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """What no other device may use: its coils."""
    for where in COMMANDS:
        yield str(_point(settings.unit, where)), ("unit",)


def describe(settings: Settings, bus_settings: modbus.Settings) -> list[tuple[str, str]]:
    """What `check` prints in place of a wiring table: (what, meaning)."""
    rows = [(name, f"read {_at(settings, name)}") for name in ALWAYS]
    rows += [(name, f"the same in an error: {_at(settings, name)}") for name in IN_ERROR]
    rows += [
        ("power", f"write {_point(settings.unit, xnergy.ENABLE)}: 1 starts from idle, 0 stops"),
        ("range check", f"write {_point(settings.unit, xnergy.CHECK_RANGE)} before each start"),
        ("clear error", "no place for it is published: cycle the receiver's power"),
        ("end of the daemon", "0 is written" if settings.on_death == "stop" else "nothing"),
    ]
    return rows + xnergy.state_rows()


def warnings(settings: Settings) -> Iterable[tuple[tuple[str, ...], str]]:
    """What is legal but worth a look: (path, text)."""
    yield (
        (),
        "the maker's published registers are not tried on hardware: watch the first charge, and pull"
        " the bus plug during one",
    )
    if settings.receivers:
        yield ("receivers",), "this controller tells no receiver's id: it will charge nobody"


def create(name: str, settings: Settings, bus: modbus.ModbusBus) -> "ModbusCharger":
    """The receiver on its bus; nothing is sent before the first reading."""
    return ModbusCharger(settings, bus)


class ModbusCharger:
    """`drivers.Driver` of one receiver."""

    def __init__(self, settings: Settings, bus: modbus.ModbusBus) -> None:
        self._settings = settings
        self._bus = bus
        self._told = xnergy.Told()
        self._code = -1
        self._touched = False

    def open(self) -> None:
        """Nothing is claimed and nothing sent: a charge under way is not ours to stop."""

    def read(self) -> ChargerSample:
        """The receiver now. Raises DriverError."""
        words = self._words(ALWAYS)
        if xnergy.activity(words["state"]) is Activity.ERROR:
            words |= self._words(IN_ERROR)
        self._code = words["state"]
        return xnergy.sample(words, xnergy.settled(self._told, self._bus.now()))

    def write(self, outputs: ChargerOutputs) -> None:
        """Start, stop or check the range, where that is due. Raises DriverError."""
        told, orders = xnergy.steer(self._told, outputs, self._code, self._bus.now())
        if orders.enable is not None:
            self._enable(orders.enable)
        if orders.check_range:
            self._told = replace(self._told, range_checks=told.range_checks, asked_at=told.asked_at)
            write(self._bus, _point(self._settings.unit, xnergy.CHECK_RANGE), 1)
        self._told = told

    def make_safe(self) -> None:
        """What the settings say of the daemon's end: stopped, and acknowledged, or left alone."""
        if self._settings.on_death == "stop":
            self._enable(False)

    def close(self) -> None:
        """Stopped, if it may be on and may not stay so; and let go."""
        if self._touched and self._told.enabled is not False:
            self._bus.insist()
            try:
                self.make_safe()
            except DriverError:
                return  # it was tried; make_safe has said so before

    def _enable(self, on: bool) -> None:
        self._touched = True
        self._told = replace(self._told, enabled=None)
        write(self._bus, _point(self._settings.unit, xnergy.ENABLE), int(on))
        self._told = replace(self._told, enabled=on)

    def _words(self, names: Iterable[str]) -> dict[str, int]:
        points = {name: _point(self._settings.unit, xnergy.READS[name]) for name in names}
        image = read(self._bus, points.values())
        return {name: image[point] for name, point in points.items()}


def _at(settings: Settings, name: str) -> Point:
    return _point(settings.unit, xnergy.READS[name])


def _point(unit: int, where: xnergy.Where) -> Point:
    assert where.modbus
    return at(unit, where.modbus)


DRIVER = DriverType(
    settings=Settings,
    buses=("modbus",),
    create=create,
    describe=describe,
    claims=claims,
    warnings=warnings,
    fake="hal_fakes.plants.xnergy_rcu",
)

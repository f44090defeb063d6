"""Xnergy's receiver (RCU) in front of the plant. CANopen and Modbus share its numbers."""

from typing import Final

from bridges.kinds.charger.signals import Activity
from drivers.charger.modbus import ModbusChargerSettings, points
from drivers.charger.xnergy import CHECK_RANGE, ENABLE, IN_RANGE, TICKS_PER_UNIT
from drivers.hal.modbus.points import Point
from hal_fakes.fake import Fake
from hal_fakes.plants.charger import ChargerPlant, Reading
from hal_fakes.plants.pad import AMBIENT_C
from hal_fakes.plants.plant import Plant

SIGNALS: Final = {ENABLE: "power", CHECK_RANGE: "range_check"}
"""The plant's signal that each writable object drives."""
HANDSHAKE: Final = (1, 2, 3, 4)
STATES: Final = {
    Activity.IDLE: 0,
    Activity.CHARGING: 5,
    Activity.STOPPING: 11,
    Activity.RELEASED: 7,
    Activity.ERROR: 238,
}
ERRORS: Final = {
    "authentication": 0x0000_0008,
    "too_far": 0x0000_0040,
    "too_near": 0x0000_0080,
    "contact_lost": 0x0000_0100,
    "over_temperature": 0x0000_4000,
    "transmitter_fault": 0x0001_0000,
    "foreign_object": 0x0002_0000,
    "thermometer": 0x0010_0000,
}
RANGES: Final = {"none": 0, "ongoing": 0, "in": IN_RANGE, "out": 2, "failed": 240}


def words(reading: Reading, latched: int = 0) -> dict[str, int]:
    """Return the value of each of the receiver's words, by its name in `drivers.charger.xnergy`.
    `latched` has the bits of earlier errors."""
    now = sum(ERRORS[fault] for fault in reading.faults)
    shadow = now | latched
    return {
        "state": state(reading),
        "error_low": now & 0xFFFF,
        "error_high": now >> 16,
        "latched_low": shadow & 0xFFFF,
        "latched_high": shadow >> 16,
        "volts": round(reading.volts * TICKS_PER_UNIT),
        "amps": round(reading.amps * TICKS_PER_UNIT),
        "device_c": round(AMBIENT_C),
        "coil_c": round(reading.celsius),
        "range": RANGES[reading.range_result],
    }


def state(reading: Reading) -> int:
    """Return the state code. A handshake passes through four codes."""
    if reading.activity is Activity.HANDSHAKE:
        return HANDSHAKE[min(int(reading.progress * len(HANDSHAKE)), len(HANDSHAKE) - 1)]
    return STATES[reading.activity]


def rcu_plant(name: str, *links: str) -> ChargerPlant:
    """Build a charger with this receiver. `links` are the parts of its wire."""
    return ChargerPlant(name, commanded=True, cleared=False, links=links)


class ModbusRcu:
    """The registers and coils of one receiver, with a plant behind them (`hal_fakes.modbus.units`).

    `points` are all cells, including `outputs`. `unit` is the receiver's unit id.
    """

    def __init__(self, plant: Plant, settings: ModbusChargerSettings) -> None:
        self.plant = plant
        self.unit: int = settings.unit
        self._names = {point: name for name, point in points(settings).items()}
        self._coils = {point: 0 for point, name in self._names.items() if name in SIGNALS}
        self._latched = 0
        self.points = frozenset(self._names)
        self.outputs = frozenset(self._coils)

    def get(self, point: Point, now: float) -> int:
        """Return this point's value at `now` (monotonic s)."""
        if point in self._coils:
            return self._coils[point]
        self.plant.advance(now)
        reading = self.plant.reading()
        assert isinstance(reading, Reading)
        found = words(reading, self._latched)
        self._latched = found["latched_high"] << 16 | found["latched_low"]
        return found[self._names[point]] & 0xFFFF

    def set(self, point: Point, value: int, now: float) -> bool:
        """Write a value. Return False if the point cannot be written."""
        if point not in self._coils:
            return False
        self._coils[point] = value
        self.plant.drive(SIGNALS[self._names[point]], bool(value), now)
        return True


FAKE = Fake[ModbusChargerSettings](
    plant=lambda name, settings, wires: rcu_plant(name, "unit", "server"),
    station=lambda plant, settings: ModbusRcu(plant, settings),
)

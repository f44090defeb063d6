"""A charging station on registers. It shows its plant's state in the numbers of its map."""

from bridges.kinds.charger.signals import Activity
from drivers.charger.register import POWER, RegisterChargerSettings, cells, charger_map, orders
from drivers.charger.rules import UNKNOWN
from drivers.charger.state_codes import ROBOT_ERROR
from drivers.hal.modbus.points import Point
from drivers.json_fields import Value
from hal_fakes.charger_values import NEAREST, values
from hal_fakes.fake import Fake
from hal_fakes.plants.charger import ChargerPlant, Reading
from hal_fakes.plants.plant import Plant


class FakeRegisterCharger:
    """The cells of one station, which are its registers and coils (`hal_fakes.modbus.units`)."""

    def __init__(self, plant: Plant, settings: RegisterChargerSettings) -> None:
        self.plant = plant
        self.unit: int = settings.unit
        self._map = charger_map(settings)
        self._cells = cells(settings)
        self._orders = {point: name for name, point in orders(settings).items()}
        self._written = dict.fromkeys(self._orders, 0)
        if self._map.power:
            self._written[orders(settings)[POWER]] = self._map.power.stop
        self.points = frozenset((*self._orders, *(p for c in self._cells.values() for p in c)))
        self.outputs = frozenset(self._orders)

    def get(self, point: Point, now: float) -> int:
        """Return the register at `now` (monotonic s). Several values may share a register."""
        if point in self._written:
            return self._written[point]
        self.plant.advance(now)
        reading = self.plant.reading()
        assert isinstance(reading, Reading)
        shown = self._values(reading)
        word = 0
        for name, points in self._cells.items():
            if point in points:
                word |= self._map.values[name].encoded(float(shown[name]))[points.index(point)]
        return word

    def set(self, point: Point, value: int, now: float) -> bool:
        """Write a value. Return False if the point cannot be written."""
        if point not in self._written:
            return False
        self._written[point] = value
        name, power = self._orders[point], self._map.power
        on = power is not None and value == power.start if name == POWER else True
        self.plant.drive(name, on, now)
        return True

    def _values(self, reading: Reading) -> dict[str, Value]:
        wanted = ROBOT_ERROR if reading.robots else (reading.activity, "")
        measured: dict[str, Value] = {
            "volts": reading.volts,
            "amps": reading.amps,
            "battery_percent": 100 * (reading.battery or 0.0),
            "time_to_full_s": reading.time_to_full_s or 0.0,
            "receiver": reading.number,
            "in_range": bool(reading.in_range),
            "range_ok": reading.range_ok,
            "at_height": reading.at_height,
            **dict.fromkeys(self._map.temperatures.values(), reading.celsius),
            "state": self._code(reading.activity),
        }
        natural = {name: value for name, value in measured.items() if name in self._cells}
        found = values(self._map.rules, self._map.errors, wanted, natural)
        if found is None:
            found = values(self._map.rules, self._map.errors, UNKNOWN, natural) or {}
        return {**dict.fromkeys(self._cells, 0), **natural, **found}

    def _code(self, activity: Activity) -> int:
        lists = self._map.codes.lists() if self._map.codes else {}
        codes = lists.get(activity) or lists.get(NEAREST.get(activity, Activity.IDLE)) or [0]
        return codes[0]


def build(name: str, settings: RegisterChargerSettings) -> ChargerPlant:
    """Build the station of this map."""
    found = charger_map(settings)
    return ChargerPlant(
        name,
        settings.receivers,
        commanded=found.power is not None,
        asked=found.range_check is not None,
        cleared=found.clear_error is not None,
        links=("unit", "server"),
    )


FAKE = Fake[RegisterChargerSettings](
    plant=lambda name, settings, wires: build(name, settings),
    station=lambda plant, settings: FakeRegisterCharger(plant, settings),
)

"""A charging station of any make on Modbus registers. A register map describes the station.

The driver knows only whether the power should be on or off. It writes the power command while the
station shows the opposite. At the daemon's start the driver writes nothing, so a restart does not end a
charge.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Final

from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import ChargerOutputs, ChargerSample, Measured
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers import DriverError
from drivers.charger import rules
from drivers.charger.register_map import PROFILE, ChargerMap, RegisterNumber
from drivers.charger.register_tables import samples
from drivers.charger.rules import judged, receiver_text
from drivers.driver_type import DriverType
from drivers.hal.modbus import ModbusBus
from drivers.hal.modbus.points import Point
from drivers.hal.modbus.registers import TABLES, WRITABLE, Unit, at, misplaced

POWER: Final = "power"


class RegisterChargerSettings(
    ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True
):
    """One station."""

    unit: Annotated[Unit, tells("the station's Modbus unit id.")]
    profile: Annotated[
        Name | None, tells("the name of a file in drivers/profiles/ that holds the map.")
    ] = None
    map: Annotated[ChargerMap | None, tells("the map, written here instead of a profile.")] = None

    def can_stop(self) -> bool:
        """Return whether the driver can switch the power off. It can do so only if the map gives
        `power`."""
        return charger_map(self).power is not None

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        before = list(PROFILE.problems(self.profile, self.map))
        yield from before
        if before:
            return
        if self.receivers and "receiver" not in charger_map(self).values:
            text = "the map needs a value 'receiver', the id of the receiver that the station sees"
            yield ("receivers",), text
        if self.on_death == "keep" and not self.can_stop():
            yield (
                ("on_death",),
                "has no effect, because the driver cannot stop this station: delete on_death",
            )


def charger_map(settings: RegisterChargerSettings) -> ChargerMap:
    """Return the YAML's map, or the profile's map if the YAML has no map."""
    return PROFILE.chosen(settings.profile, settings.map)


def cells(settings: RegisterChargerSettings) -> dict[str, list[Point]]:
    """Return, for each value, its registers, or its coil or discrete input."""
    found: Mapping[str, RegisterNumber] = charger_map(settings).values
    return {name: number.points(settings.unit) for name, number in found.items()}


def orders(settings: RegisterChargerSettings) -> dict[str, Point]:
    """Return the register or coil where the driver writes each command."""
    return {n: at(settings.unit, text) for n, text in charger_map(settings).orders().items()}


def claims(settings: RegisterChargerSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each register or coil that the driver writes, with its path in the YAML. Yield nothing
    while the map has problems."""
    if any(PROFILE.problems(settings.profile, settings.map)):
        return
    for name, text in charger_map(settings).orders().items():
        if misplaced(text, WRITABLE) is None:
            path = ("map", name, "at") if settings.map else ("unit",)
            yield str(at(settings.unit, text)), path


def reads(settings: RegisterChargerSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each register, coil or discrete input that tells a value, with its path in the YAML. Yield
    nothing while the map has problems."""
    if any(PROFILE.problems(settings.profile, settings.map)):
        return
    for name, number in charger_map(settings).values.items():
        if misplaced(number.at, TABLES) is None:
            path = ("map", "values", name, "at") if settings.map else ("unit",)
            yield from ((str(point), path) for point in number.points(settings.unit))


def describe(settings: RegisterChargerSettings, bus: object) -> Iterator[tuple[str, str]]:
    """Yield rows for `check` about the registers of the values, the commands, and the meanings of
    numbers."""
    found = charger_map(settings)
    for name, points in cells(settings).items():
        number = found.values[name]
        scaled = "" if number.scale == 1.0 else f" x {number.scale:g}"
        bit = "" if number.bit is None else f" bit {number.bit}"
        yield name, f"{' and '.join(map(str, points))}{bit}{scaled}"
    written = orders(settings)
    if found.power:
        yield (
            POWER,
            f"{written[POWER]}: {found.power.start} allows a charge, {found.power.stop} forbids it",
        )
        yield (
            "end of the daemon",
            "the driver writes off" if settings.on_death == "stop" else "nothing",
        )
    for name, order in (("clear_error", found.clear_error), ("range_check", found.range_check)):
        if order:
            yield name.replace("_", " "), f"{written[name]}: write {order.write}"
    yield from rules.rows(found.rules, found.errors)
    yield from found.codes.rows() if found.codes else ()


def tables(settings: RegisterChargerSettings) -> Iterator[Table]:
    """Yield a sample of each value, for comparison with the station's registers."""
    yield samples(charger_map(settings), cells(settings))


def warnings(settings: RegisterChargerSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake."""
    yield from PROFILE.warnings(settings.profile, "watch the first charge")
    found = charger_map(settings)
    if found.power is None:
        yield (), "observe-only: without power in the map, no fault switches the station off"
    elif not found.power.read_back:
        yield (), "power cannot be read back, so the driver cannot verify that the power went off"
    if not settings.receivers:
        yield (), "without receivers the robot on the pad is not verified"


def create(name: str, settings: RegisterChargerSettings, bus: ModbusBus) -> "RegisterCharger":
    """Make the station's driver on its bus. The driver sends nothing before the first reading."""
    return RegisterCharger(settings, bus)


class RegisterCharger:
    """The driver of one station (`drivers.Driver`). `_power` is True while the power is on, False while
    the power is off, and None while this is unknown."""

    def __init__(self, settings: RegisterChargerSettings, bus: ModbusBus) -> None:
        self._settings = settings
        self._map = charger_map(settings)
        self._cells = cells(settings)
        self._orders = orders(settings)
        self._bus = bus
        self._power: bool | None = None
        self._is_read = False
        self._touched = False
        self._cleared = 0
        self._checked = 0

    def open(self) -> None:
        """Do nothing, because a restart must not end a charge."""

    def read(self) -> ChargerSample:
        """Read and decode the station's values. Raises DriverError."""
        power, self._power, self._is_read = self._power, None, False
        command = self._map.power
        shown = [self._orders[POWER]] if command and command.read_back else []
        image = self._bus.cells([*shown, *(p for points in self._cells.values() for p in points)])
        values = {
            name: self._map.values[name].value([image[point] for point in points])
            for name, points in self._cells.items()
        }
        self._power = power
        if command and shown:
            self._power = {command.start: True, command.stop: False}.get(image[shown[0]])
        self._is_read = True
        return decode(self._map, values)

    def write(self, outputs: ChargerOutputs) -> None:
        """Write the commands that the outputs need. Write the command that switches the power off
        before the other commands. After a failed reading do not write the command that switches the
        power on, because the station may have switched itself off.

        `outputs` counts the requests to clear errors, and the requests to check the range. Write the
        command once when its count has changed.
        """
        if outputs.power is False:
            self._switch(on=False)
        if outputs.clear_errors != self._cleared:
            self._cleared = outputs.clear_errors
            self._order("clear_error")
        if outputs.range_checks != self._checked:
            self._checked = outputs.range_checks
            self._order("range_check")
        if outputs.power and self._is_read:
            self._switch(on=True)

    def make_safe(self) -> None:
        """Switch the power off. Read the command back if the station allows this. With `on_death: keep`
        do nothing."""
        if self._settings.on_death == "stop":
            self._switch(on=False, anyway=True)
            command = self._map.power
            if command and command.read_back:
                point = self._orders[POWER]
                if self._bus.cells([point])[point] != command.stop:
                    raise DriverError(f"{point} is not off after {command.stop} was written")

    def close(self) -> None:
        """Switch the power off if the driver ever wrote the power command, and the power is not known
        to be off. Does not raise."""
        if self._touched and self._power is not False:
            self._bus.insist()
            try:
                self.make_safe()
            except DriverError:
                return  # do not raise, because `make_safe` has already reported the failure

    def _switch(self, on: bool, anyway: bool = False) -> None:
        command = self._map.power
        if command is None or (self._power is on and command.read_back and not anyway):
            return
        self._power, self._touched = None, True
        self._bus.write(self._orders[POWER], command.start if on else command.stop, safe=not on)
        self._power = on

    def _order(self, name: str) -> None:
        order = getattr(self._map, name)
        if order is not None:
            self._bus.write(self._orders[name], order.write)


def decode(found: ChargerMap, values: Mapping[str, float]) -> ChargerSample:
    """Decode the station's values. Never raises."""
    code = int(values["state"]) if found.codes else None
    said = judged(found, values.__getitem__, code)
    return ChargerSample(
        said.activity,
        said.code,
        said.text,
        Measured(
            receiver_id=receiver_text(values.get("receiver")),
            in_range=_flag(values.get("in_range")),
            volts=values.get("volts"),
            amps=values.get("amps"),
            battery_percent=values.get("battery_percent"),
            time_to_full_s=values.get("time_to_full_s"),
            range_ok=_flag(values.get("range_ok")),
            at_height=_flag(values.get("at_height")),
            temperatures=tuple((name, values[at]) for name, at in found.temperatures.items()),
        ),
        said.side,
        said.charges,
    )


def _flag(value: float | None) -> bool | None:
    return None if value is None else bool(value)


DRIVER = DriverType(
    settings=RegisterChargerSettings,
    buses=("modbus",),
    create=create,
    describe=describe,
    tables=tables,
    claims=claims,
    reads=reads,
    warnings=warnings,
    fake="hal_fakes.modbus.register_charger",
)

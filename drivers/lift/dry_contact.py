"""A lift on dry contacts. In the YAML a signal has a line of its own, or several lines together show a
number.

The lines are GPIO pins, or coils and discrete inputs of a Modbus I/O module.
"""

from collections.abc import Mapping
from contextlib import suppress
from functools import partial

from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Motion, Side
from bridges.kinds.shared.remarks import Remarks
from drivers import DriverError
from drivers.driver_type import DriverType
from drivers.hal.points import Points, PointsBus
from drivers.lift import checks as lift_checks
from drivers.lift import codes
from drivers.lift import table as lift_table
from drivers.lift import tables as lift_tables
from drivers.lift.wiring import LiftInputWiring, LiftWiring
from drivers.on_points import OnPoints

DOOR = {
    (True, False): DoorReading.OPEN,
    (False, True): DoorReading.CLOSED,
    (False, False): DoorReading.BETWEEN,
    (True, True): DoorReading.BOTH,
}
"""The reading of the door for each pair of contacts (opened, closed)."""

UP_DOWN = {
    (True, False): Motion.UP,
    (False, True): Motion.DOWN,
    (False, False): Motion.STOPPED,
    (True, True): Motion.CONTRADICTORY,
}


class DryContactLiftSettings(LiftWiring, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A lift on dry contacts."""

    def problems(self) -> Remarks:
        """Yield a problem for invalid wiring, and for each unsafe choice that `accept_unsafe` does not
        name."""
        return lift_checks.problems(self)


wires, debounce, warnings = lift_table.wires, lift_table.debounce, lift_checks.warnings


def notes(settings: DryContactLiftSettings) -> Remarks:
    """Yield a note for each setting that is no mistake, but has side effects. The note has its path
    below the device."""
    return lift_checks.notes(settings, partial(lift_checks.sees, settings))


def create(name: str, settings: DryContactLiftSettings, bus: PointsBus) -> "DryContactLift":
    """Make the lift's driver on its GPIO or Modbus bus. The driver touches nothing before `open`."""
    return DryContactLift(settings, bus)


class DryContactLift(OnPoints):
    """The driver of one lift (`drivers.Driver[LiftSample, LiftOutputs]`)."""

    def __init__(self, settings: DryContactLiftSettings, bus: PointsBus) -> None:
        super().__init__(Points(wires(settings), bus))
        self._settings = settings
        self._conditional = lift_table.conditional(settings)
        self._shown: Mapping[str, bool] = {}
        self._sample: LiftSample | None = None
        self._outputs: LiftOutputs | None = None
        self._lines: Mapping[str, bool] = {}

    def read(self) -> LiftSample:
        """Read every input now. Decode the inputs if one has changed."""
        shown = self._points.read()
        if self._sample is None or shown is not self._shown:
            self._shown = shown
            self._sample = decode(self._settings, shown, self._conditional)
        return self._sample

    def write(self, outputs: LiftOutputs) -> None:
        """Set every output as `outputs` says. Outputs that go off come first.

        If this fails during a call by a code, switch the code's bits off, because a part of the code
        may be the code of another landing.
        """
        if outputs != self._outputs:
            self._outputs, self._lines = outputs, encode(self._settings, outputs)
        try:
            self._points.write(self._lines)
        except DriverError:
            if self._settings.call_code and outputs.call is not None:
                with suppress(DriverError):  # the first error tells more
                    self._points.off(self._settings.call_code.lines(None))
            raise


def encode(settings: DryContactLiftSettings, outputs: LiftOutputs) -> dict[str, bool]:
    """Return whether each output signal must be asserted. Signals without a wire are included, and
    `Points` ignores them."""
    calls = {f"call_{level}": level == outputs.call for level in settings.calls}
    if settings.call_code:
        calls = settings.call_code.lines(outputs.call)
    return {
        "agv_mode_request": outputs.agv_request,
        "door_open": outputs.hold_door is Side.FRONT,
        "rear_door_open": outputs.hold_door is Side.REAR,
        **calls,
    }


def decode(
    settings: DryContactLiftSettings, shown: Mapping[str, bool], conditional: frozenset[str]
) -> LiftSample:
    """Decode the lines. `shown` has True for each asserted signal. `conditional` names groups of
    signals, such as `floor`, that are valid only in AGV mode."""
    inputs = settings.inputs
    service = _service(inputs, shown)
    agv = _agv(inputs, shown, service)
    unknown = frozenset() if agv else conditional
    level, code_fault = (None, "") if "floor" in unknown else settings.floor_code.read(shown)
    front = DoorReading.BETWEEN if "door" in unknown else _door(inputs, "door", shown)
    rear = DoorReading.BETWEEN if "rear_door" in unknown else _door(inputs, "rear_door", shown)
    return LiftSample(
        level=level,
        door=front or DoorReading.BETWEEN,
        code_fault=code_fault,
        rear_door=rear,
        motion=None if "motion" in unknown else _motion(inputs, shown),
        agv=agv,
        hazards=frozenset(
            h for h in Hazard if h == service or (h not in unknown and shown.get(h, False))
        ),
        floor_valid="floor" not in unknown,
    )


def _service(inputs: LiftInputWiring, shown: Mapping[str, bool]) -> str | None:
    if inputs.service is None:
        return None
    return inputs.service.means(codes.shown_number("service", shown, len(inputs.service.bits)))


def _agv(inputs: LiftInputWiring, shown: Mapping[str, bool], service: str | None) -> bool | None:
    if inputs.agv_mode:
        return shown["agv_mode"]
    if inputs.service and "agv_mode" in inputs.service.codes.values():
        return service == "agv_mode"
    return None


def _door(inputs: LiftInputWiring, prefix: str, shown: Mapping[str, bool]) -> DoorReading | None:
    single = getattr(inputs, prefix)
    if single and single.proves == "open":
        return DoorReading.OPEN if shown[prefix] else DoorReading.NOT_OPEN
    if single:
        return DoorReading.CLOSED if shown[prefix] else DoorReading.NOT_CLOSED
    if f"{prefix}_opened" not in shown:
        return None
    return DOOR[shown[f"{prefix}_opened"], shown[f"{prefix}_closed"]]


def _motion(inputs: LiftInputWiring, shown: Mapping[str, bool]) -> Motion | None:
    if inputs.moving:
        return Motion.MOVING if shown["moving"] else Motion.STOPPED
    if inputs.stopped:
        return Motion.STOPPED if shown["stopped"] else Motion.MOVING
    if inputs.up:
        return UP_DOWN[shown["up"], shown["down"]]
    if inputs.motion:
        number = codes.shown_number("motion", shown, len(inputs.motion.bits))
        known = inputs.motion.codes.get(number)
        return Motion(known) if known else Motion.CONTRADICTORY
    return None


DRIVER = DriverType(
    settings=DryContactLiftSettings,
    buses=("gpio", "modbus", "mqtt"),
    create=create,
    wires=wires,
    debounce=debounce,
    tables=lift_tables.tables,
    warnings=warnings,
    notes=notes,
)

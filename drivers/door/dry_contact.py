"""A door operator on dry contacts. A door operator is the machine that moves the door. A relay holds
the door open, and limit contacts show the door's position.

The contacts are on the GPIO header or on a Modbus I/O module (coils and discrete inputs).
`drivers/hal/points.py` translates levels to signals, and knows the level of a cut wire. The driver
makes no decision: the door's decision core (`bridges/kinds/door/`) decides.

Some operators need pulses instead of a held relay. A Modbus module may time these pulses itself
(`flash`). In this case the driver requests each pulse only once, because a second request would prolong
the pulse. The module ends the pulse. If the reply to a request is lost, the driver waits until the core
begins a new pulse; the lost pulse is then over (DOOR-PULSES-2). If the hold ends during a pulse, the
driver switches the relay off.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Final

import msgspec

from bridges.kinds.door.settings import DoorSettings
from bridges.kinds.door.signals import DoorOutputs, DoorSample
from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers.door.closing import CLOSING
from drivers.driver_type import DriverType
from drivers.hal.points import (
    Flash,
    Input,
    Output,
    Point,
    Points,
    PointsBus,
    Wire,
    debounces,
    input_wires,
)
from drivers.on_points import OnPoints
from drivers.unsafe import Unsafe, needlessly_accepted, slow_alarms, unaccepted, unsafe_wires

DEBOUNCE_S: Final = 0.05

CUT_MUST_READ: Final = {
    "opened": (False, "the door reads open"),
    "obstruction": (True, "somebody in the doorway is not seen"),
    "fire": (True, "a fire alarm reads clear"),
}
"""The reading that a cut wire must give, for each signal (True: asserted). The text names the danger if
a cut wire reads the opposite."""


class DoorInputWiring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The contacts that the driver reads. With `feedback: estimated` one or both limit contacts may be
    missing."""

    opened: Annotated[
        Input | None, tells("the limit contact that is on while the door is fully open.")
    ] = None
    closed: Annotated[
        Input | None, tells("the limit contact that is on while the door is closed.")
    ] = None
    obstruction: Annotated[
        Input | None,
        tells("somebody is in the doorway. A held door stays held until the doorway is clear."),
    ] = None
    fire: Annotated[Input | None, tells("the fire alarm; `on_fire` sets its effect.")] = None


class Hold(Output, frozen=True, forbid_unknown_fields=True):
    """The relay that holds the door open."""

    flash: Annotated[
        Point | None,
        tells("""the coil where the driver requests a pulse from a Modbus module that ends each
        `pulse` by itself. The module counts in tenths of a second. An example is `unit 1 coil
        0x200`, for the first relay of a Waveshare Modbus RTU Relay."""),
    ] = None


class DoorOutputWiring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The relay that commands the door operator. No relay closes the door."""

    hold_open: Annotated[Hold, tells("holds the door open while it is on.")]


class DryContactDoorSettings(DoorSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A door and its wiring."""

    inputs: Annotated[DoorInputWiring, tells("the contacts that the driver reads.")] = (
        DoorInputWiring()
    )
    outputs: Annotated[DoorOutputWiring, tells("the relay that the driver switches.")]

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        yield from self._feedback_problems()
        if self.inputs.fire and self.on_fire is None:
            yield (
                ("inputs", "fire"),
                "give the effect of a fire alarm: on_fire: open, or on_fire: release",
            )
        if self.on_fire and self.inputs.fire is None:
            yield (
                ("on_fire",),
                "there is no fire input; wire a fire input under inputs, or delete on_fire",
            )
        yield from self._flash_problems()
        yield from unaccepted(_unsafe(self), self.accept_unsafe)

    def _flash_problems(self) -> Remarks:
        if self.outputs.hold_open.flash is None:
            return
        if self.pulse is None:
            text = "is for pulses: write pulse: {on_s: …, every_s: …}, or delete flash"
            yield ("outputs", "hold_open", "flash"), text
        elif abs(self.pulse.on_s * 10 - round(self.pulse.on_s * 10)) > 1e-6:
            text = (
                f"with flash the module counts in tenths of a second, so {self.pulse.on_s:g}"
                " s is impossible: write a multiple of 0.1"
            )
            yield ("pulse", "on_s"), text

    def _feedback_problems(self) -> Remarks:
        missing = [s for s in ("opened", "closed") if getattr(self.inputs, s) is None]
        if self.feedback == "sensors":
            for signal in missing:
                text = (
                    f"needs '{signal}'; if the door has no such contact, write feedback: estimated"
                )
                yield ("inputs",), text
        elif not missing:
            yield ("feedback",), "both limit contacts are wired: delete feedback"


def wires(settings: DryContactDoorSettings) -> list[Wire]:
    """Return the wiring table, inputs first."""
    relay = settings.outputs.hold_open
    flash = None
    if relay.flash is not None and settings.pulse is not None:
        flash = Flash(relay.flash, settings.pulse.on_s)
    path = ("outputs", "hold_open")
    return [*input_wires(settings.inputs, DEBOUNCE_S), relay.wire("hold_open", path, flash)]


def debounce(settings: DryContactDoorSettings) -> Mapping[str, float]:
    """Return the debounce time (s) of each input. The keys are the inputs' signals."""
    return debounces(wires(settings))


def tables(settings: DryContactDoorSettings) -> Iterator[Table]:
    """Yield a table that shows when the relay is on."""
    pulse = settings.pulse
    driven = "on while RMF holds the door"
    if pulse is not None:
        by = "the module" if settings.outputs.hold_open.flash else "the daemon"
        driven = (
            f"{pulse.on_s:g} s every {pulse.every_s:g} s while RMF holds the door; {by} times it"
        )
    rows = (("hold_open", driven),)
    yield Table("outputs", ("output", "how long"), rows)


def warnings(settings: DryContactDoorSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting to review before the door goes
    into service."""
    for wire in wires(settings):
        if wire.signal == "closed" and wire.broken_reads() is not False:
            yield (
                wire.path,
                "a cut wire may read as a closed door; use a contact that a closed door closes",
            )
    yield from slow_alarms(w for w in wires(settings) if w.signal in ("fire", "obstruction"))
    yield from needlessly_accepted(_unsafe(settings), settings.accept_unsafe)
    if settings.feedback == "estimated":
        yield (
            ("feedback",),
            "RMF gets OPEN and CLOSED after fixed times, whatever the door really does",
        )


def create(name: str, settings: DryContactDoorSettings, bus: PointsBus) -> "DryContactDoor":
    """Make the door's driver on its bus. The driver touches nothing before `open`."""
    return DryContactDoor(
        Points(wires(settings), bus), flashes=settings.outputs.hold_open.flash is not None
    )


class DryContactDoor(OnPoints):
    """The driver of one door (`drivers.Driver`). If `flashes` is True, the Modbus module times the
    pulses of the hold relay."""

    def __init__(self, points: Points, flashes: bool = False) -> None:
        super().__init__(points)
        self._flashes = flashes
        self._asked = False

    def read(self) -> DoorSample:
        """Read every contact now."""
        read = self._points.read().get
        return DoorSample(read("opened"), read("closed"), read("obstruction"), read("fire"))

    def write(self, outputs: DoorOutputs) -> None:
        """Set the hold relay. If the module times the pulses, request each pulse once."""
        asked, self._asked = self._asked, outputs.hold_open
        if not self._flashes or not (outputs.hold_open or outputs.between_pulses):
            self._points.write({"hold_open": outputs.hold_open})
        elif outputs.hold_open and not asked:
            self._points.flash("hold_open")

    def make_safe(self) -> None:
        """Switch the hold relay off, and verify that the relay is off."""
        self._asked = False
        super().make_safe()


def _unsafe(settings: DryContactDoorSettings) -> Iterator[Unsafe]:
    return unsafe_wires(wires(settings), CUT_MUST_READ)


DRIVER = DriverType(
    settings=DryContactDoorSettings,
    buses=("gpio", "modbus", "mqtt"),
    create=create,
    wires=wires,
    debounce=debounce,
    tables=tables,
    describe=lambda settings, bus: (CLOSING,),
    warnings=warnings,
)

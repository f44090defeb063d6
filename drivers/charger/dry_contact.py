"""A charging station on dry contacts. A relay enables charging, and contacts show the station's state.

The relay and the contacts are on the GPIO header or on a Modbus I/O module (coils and discrete inputs).
The relay is off whenever the daemon does not run, so a charge ends with the daemon.
"""

import itertools
from collections.abc import Iterator, Mapping
from typing import Annotated, Final

import msgspec
from msgspec.structs import replace

from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import (
    Activity,
    ChargerOutputs,
    ChargerSample,
    FaultSide,
    Measured,
)
from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers.driver_type import DriverType
from drivers.hal.points import Input, Output, Points, PointsBus, Wire, debounces, input_wires
from drivers.on_points import OnPoints
from drivers.tables import lines_on, one_cut, told_of_cuts
from drivers.unsafe import Unsafe, needlessly_accepted, unaccepted, unsafe_wires

CUT_MUST_READ: Final = {
    "fault": (True, "a fault of the station is not seen"),
    "ready": (False, "a station that is not ready reads ready"),
    "at_height": (False, "a lowered pad reads as raised, so the station energises it"),
    "range_ok": (False, "a badly placed robot reads as in range, so the station energises its pad"),
}
"""The reading that a cut wire must give, for each signal (True: asserted). The text names the danger if
a cut wire reads the opposite."""
ENABLE: Final = "enable"
DEBOUNCE_S: Final = 0.05
FAULT_DEBOUNCE_S: Final = 0.1
"""The default debounce (s) of the contact `fault`. DEBOUNCE_S is the default of the other contacts."""


class ChargerInputWiring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The contacts that the driver reads."""

    charging: Annotated[Input, tells("current flows, also while it ramps down.")]
    ready: Annotated[
        Input | None,
        tells("""the station can charge the next robot. Without this contact the station counts as
        ready."""),
    ] = None
    fault: Annotated[Input | None, tells("the station is out of order.")] = None
    at_height: Annotated[
        Input | None,
        tells("""the station's moving pad is in its charging position. While this contact is off the
        relay stays off. If the contact goes off while current flows, this is a fault."""),
    ] = None
    range_ok: Annotated[
        Input | None,
        tells("""the robot stands where charging is possible. While this contact is off the relay
        stays off."""),
    ] = None


class ChargerOutputWiring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The command to the station."""

    enable: Annotated[Output, tells("the station may charge while this relay is on.")]


class DryContactChargerSettings(
    ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True
):
    """One station and its wiring."""

    inputs: Annotated[ChargerInputWiring, tells("the contacts that the driver reads.")]
    outputs: Annotated[ChargerOutputWiring, tells("the relay that the driver switches.")]

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        if self.on_death == "keep":
            yield (
                ("on_death",),
                "has no effect, because the relay is always off without the daemon: delete on_death",
            )
        if self.receivers:
            yield ("receivers",), "contacts cannot give a receiver's id: delete receivers"
        yield from unaccepted(_unsafe(self), self.accept_unsafe)


def wires(settings: DryContactChargerSettings) -> list[Wire]:
    """Return the wiring table, inputs first."""
    relay = settings.outputs.enable.wire(ENABLE, ("outputs", ENABLE))
    return [*map(_debounced, input_wires(settings.inputs)), relay]


def _debounced(wire: Wire) -> Wire:
    default_s = FAULT_DEBOUNCE_S if wire.signal == "fault" else DEBOUNCE_S
    return wire if wire.debounce_s is not None else replace(wire, debounce_s=default_s)


def debounce(settings: DryContactChargerSettings) -> Mapping[str, float]:
    """Return the debounce (s) of each contact. The keys are the contacts' signals."""
    return debounces(wires(settings))


def _unsafe(settings: DryContactChargerSettings) -> Iterator[Unsafe]:
    return unsafe_wires(wires(settings), CUT_MUST_READ)


def tables(settings: DryContactChargerSettings) -> Iterator[Table]:
    """Yield a table of the contacts, and a table of the relay. The first table gives the station's
    state for each combination of contacts. It also gives each wrong state that the daemon would read
    with one wire cut."""
    table = {wire.signal: wire for wire in wires(settings) if wire.direction == "in"}
    rows = []
    for on in itertools.product((False, True), repeat=len(table)):
        shown = dict(zip(table, on, strict=True))
        means = _means(shown)
        cuts = [(signal, _means(cut)) for signal, cut in one_cut(shown, table)]
        told = told_of_cuts([(signal, reads) for signal, reads in cuts if reads != means])
        rows.append((lines_on(shown), means, told))
    yield Table("contacts", ("asserted", "reads as", "reads with one wire cut"), tuple(rows))
    driven = "on while a robot may charge"
    yield Table("outputs", ("output", "how long"), ((ENABLE, driven),))


def _means(shown: Mapping[str, bool]) -> str:
    """Describe the meaning of the contacts with the relay off. If the relay changes the meaning, add
    the meaning with the relay on."""
    off, on = (str(decode(shown, enabled).activity) for enabled in (False, True))
    return off if off == on else f"{off} ({on} while enabled)"


def warnings(settings: DryContactChargerSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting to review before the station
    goes into service."""
    for wire in wires(settings):
        if wire.signal == "charging" and wire.broken_reads() is not True:
            yield (
                wire.path,
                "a cut wire reads as no charge: check the wire if a charge never begins",
            )
        if wire.bus:
            text = (
                f"while the bus '{wire.bus}' is not read, the relay keeps its state, so a charge"
                " continues"
            )
            yield (*wire.path, "bus"), f"{text} even if the contact '{wire.signal}' changes"
    if settings.inputs.fault is None:
        yield ("inputs",), "without a fault contact a station that is out of order reads as idle"
    yield from needlessly_accepted(_unsafe(settings), settings.accept_unsafe)
    yield (), "contacts cannot give a receiver's id, so the robot on the pad is not verified"


def create(name: str, settings: DryContactChargerSettings, bus: PointsBus) -> "DryContactCharger":
    """Make the station's driver on its bus. The driver touches nothing before `open`."""
    return DryContactCharger(Points(wires(settings), bus))


class DryContactCharger(OnPoints):
    """The driver of one station (`drivers.Driver`)."""

    def __init__(self, points: Points) -> None:
        super().__init__(points)
        self._enabled = False

    def read(self) -> ChargerSample:
        """Read every contact now."""
        return decode(self._points.read(), self._enabled)

    def write(self, outputs: ChargerOutputs) -> None:
        """Set the relay. A `power` of None leaves the relay unchanged. Contacts cannot carry the
        commands that clear errors or check the range."""
        if outputs.power is not None:
            self._enabled = outputs.power
        self._points.write({ENABLE: self._enabled})

    def make_safe(self) -> None:
        """Switch the relay off, and verify that the relay is off."""
        self._enabled = False
        super().make_safe()


def decode(shown: Mapping[str, bool], enabled: bool) -> ChargerSample:
    """Decode the contacts. `enabled` is True while the relay is on."""
    activity, text = Activity.IDLE, ""
    side: FaultSide = ""
    if shown.get("fault"):
        activity, text, side = Activity.ERROR, "the fault contact", "station"
    elif shown["charging"]:
        activity = Activity.CHARGING
    elif shown.get("ready") is False:
        activity = Activity.RELEASED
    elif enabled:
        activity = Activity.HANDSHAKE
    on = [signal for signal, asserted in shown.items() if asserted]
    pad = Measured(range_ok=shown.get("range_ok"), at_height=shown.get("at_height"))
    return ChargerSample(activity, "+".join(on) or "no contact", text, pad, side=side)


DRIVER = DriverType(
    settings=DryContactChargerSettings,
    buses=("gpio", "modbus", "mqtt"),
    create=create,
    wires=wires,
    debounce=debounce,
    tables=tables,
    warnings=warnings,
)

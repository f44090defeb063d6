"""An alarm panel on contacts or registers. Each source of the alarm is one point of the GPIO header, of
a Modbus module, or of a controller's registers.

A fire panel's contact is wired normally closed, so that a cut loop reads as an alarm. If a cut loop
would read as no alarm, the daemon refuses the wiring, unless the YAML accepts it with `accept_unsafe`.
A bit of a register has no cable of its own, so this check does not apply to bits.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Final

from msgspec import Meta

from bridges.kinds.alarm.settings import PanelSettings
from bridges.kinds.alarm.signals import DRILL, SILENT, PanelOutputs, PanelSample
from bridges.kinds.shared.alarming import alarm_notes
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers.alarm.sources import PURPOSE, drill_problems
from drivers.driver_type import DriverType
from drivers.hal.points import Input, Points, PointsBus, Wire, debounces, is_number
from drivers.on_points import OnPoints
from drivers.unsafe import Unsafe, cut_must_read, needlessly_accepted, slow_alarms, unaccepted

DEBOUNCE_S: Final = 0.1


class DryContactPanelSettings(PanelSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A panel and its wiring."""

    sources: Annotated[
        dict[Name, Input],
        Meta(min_length=1),
        tells("""the sources of the alarm, by names that the site chooses (`fire_panel`,
        `code_blue`)."""),
    ]
    drill: Annotated[
        Input | None, tells("a key switch or test contact that begins a drill of `drill_s`.")
    ] = None

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        yield from drill_problems(self, self.sources, self.drill is not None)
        yield from unaccepted(_unsafe(self), self.accept_unsafe)


def wires(settings: DryContactPanelSettings) -> list[Wire]:
    """Return the wiring table."""
    sources = settings.sources.items()
    table = [point.wire(name, ("sources", name), DEBOUNCE_S) for name, point in sources]
    drill = settings.drill
    return [*table, *([drill.wire(DRILL, (DRILL,), DEBOUNCE_S)] if drill else [])]


def _unsafe(settings: DryContactPanelSettings) -> Iterator[Unsafe]:
    for wire in wires(settings):
        if wire.signal != DRILL and not is_number([wire]):
            yield from cut_must_read(wire, True, f"{wire.signal} reads clear in an alarm")


def debounce(settings: DryContactPanelSettings) -> Mapping[str, float]:
    """Return the debounce time of each input (s), by signal."""
    return debounces(wires(settings))


def warnings(settings: DryContactPanelSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that a person should review
    before the panel goes into service."""
    yield from slow_alarms(w for w in wires(settings) if w.signal != DRILL)
    yield from needlessly_accepted(_unsafe(settings), settings.accept_unsafe)


def tables(settings: DryContactPanelSettings) -> Iterator[Table]:
    """Yield a table with the fleets that each source stops, and with the value that a cut loop reads
    as. One row shows what happens when the panel no longer answers."""
    fleets = ", ".join(settings.fleets) or "every fleet"
    reads = {None: "anything", True: "an alarm", False: "clear"}
    rows = [
        (wire.signal, fleets, "-" if is_number([wire]) else reads[wire.broken_reads()])
        for wire in wires(settings)
        if wire.signal != DRILL
    ]
    silent = f"after {settings.silent_alarm_after_s:g} s without a reading"
    rows.append((SILENT, fleets, silent))
    if settings.drill:
        rows.append((DRILL, fleets, f"ends by itself after {settings.drill_s:g} s"))
    yield Table("alarm", ("source", "stops the robots of", "with its loop cut it reads"), (*rows,))


def create(name: str, settings: DryContactPanelSettings, bus: PointsBus) -> "DryContactPanel":
    """Make the panel's driver on its bus. The driver accesses no hardware before `open`."""
    return DryContactPanel(Points(wires(settings), bus))


class DryContactPanel(OnPoints):
    """The driver of one panel (`drivers.Driver`)."""

    def read(self) -> PanelSample:
        """Read every contact now."""
        read = dict(self._points.read())
        drill = read.pop(DRILL, None)
        return PanelSample(read, drill)

    def write(self, outputs: PanelOutputs) -> None:
        """Do nothing, because a panel is only read."""


DRIVER = DriverType(
    settings=DryContactPanelSettings,
    buses=("gpio", "modbus"),
    create=create,
    wires=wires,
    debounce=debounce,
    tables=tables,
    describe=lambda settings, bus: (PURPOSE,),
    warnings=warnings,
    notes=alarm_notes,
)

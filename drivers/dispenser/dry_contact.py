"""A dispenser or ingestor on dry contacts. A relay starts a cycle, and contacts show whether the cycle
runs, has ended or has failed.

The contacts are on the GPIO header, or are coils, discrete inputs or bits of registers behind Modbus. A
contact carries no number, so each request is for one item. If the workcell has several sorts of items,
each sort may have a relay that selects the sort.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Final

import msgspec

from bridges.kinds.dispenser.settings import WorkcellSettings
from bridges.kinds.dispenser.signals import WorkcellOutputs, WorkcellSample
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers.driver_type import DriverType
from drivers.hal.points import Input, Output, Points, PointsBus, Wire, debounces, input_wires
from drivers.on_points import OnPoints
from drivers.unsafe import Unsafe, needlessly_accepted, unaccepted, unsafe_wires

DEBOUNCE_S: Final = 0.05

CUT_MUST_READ: Final = {
    "done": (
        False,
        "every request counts as done, so RMF sends robots away before they are loaded",
    ),
    "ready": (False, "a workcell that is not ready is started"),
    "fault": (True, "a fault of the workcell is not seen"),
}
"""The reading that a cut wire must give, for each signal (True: asserted). The text names the danger if
a cut wire reads the opposite."""


class WorkcellInputWiring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The contacts that the driver reads."""

    done: Annotated[
        Input,
        tells("the cycle has succeeded. The contact is off before a cycle and on at its end."),
    ]
    busy: Annotated[
        Input | None, tells("a cycle runs. A cycle that ends without `done` has failed.")
    ] = None
    ready: Annotated[
        Input | None,
        tells("""a cycle may start (filled, closed, no jam). Without this contact a cycle may always
        start."""),
    ] = None
    fault: Annotated[Input | None, tells("the workcell reports a fault.")] = None


class WorkcellOutputWiring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The relays that the driver switches."""

    start: Annotated[Output, tells("starts one cycle. `pulse_s` sets how long the relay is on.")]
    select: Annotated[
        dict[Name, Output],
        tells("type_guid -> the relay that selects this sort while its cycle runs."),
    ] = {}


class DryContactWorkcellSettings(
    WorkcellSettings, frozen=True, kw_only=True, forbid_unknown_fields=True
):
    """A dispenser or ingestor and its wiring."""

    inputs: Annotated[WorkcellInputWiring, tells("the contacts that the driver reads.")]
    outputs: Annotated[WorkcellOutputWiring, tells("the relays that the driver switches.")]

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        select = self.outputs.select
        for name, asked in self.items.items():
            if asked.most > 1:
                yield ("items", name, "most"), "a contact carries no number: delete most"
            if len(asked.compartments) > 1:
                yield ("items", name, "compartments"), "contacts can serve one compartment only"
            if len(self.items) > 1 and name not in select:
                text = f"needs a relay for {name}, because otherwise every item has the same start"
                yield ("outputs", "select"), text
        for name in select.keys() - self.items.keys():
            yield ("outputs", "select", name), "is not one of items"
        yield from unaccepted(_unsafe(self), self.accept_unsafe)


def wires(settings: DryContactWorkcellSettings) -> list[Wire]:
    """Return the wiring table, inputs first."""
    found = input_wires(settings.inputs, DEBOUNCE_S)
    for name, relay in settings.outputs.select.items():
        found.append(relay.wire(f"select_{name}", ("outputs", "select", name)))
    return [*found, settings.outputs.start.wire("start", ("outputs", "start"))]


def debounce(settings: DryContactWorkcellSettings) -> Mapping[str, float]:
    """Return the debounce time (s) of each input. The keys are the inputs' signals."""
    return debounces(wires(settings))


def warnings(settings: DryContactWorkcellSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting to review before the workcell
    goes into service."""
    yield from needlessly_accepted(_unsafe(settings), settings.accept_unsafe)
    yield from blind(settings, busy=settings.inputs.busy is not None)


def items_table(settings: WorkcellSettings) -> Iterator[Table]:
    """Yield a table of the items that the YAML lists, so that RMF may request them. The daemon answers
    a request for any other item with FAILED."""
    rows = tuple(
        (name, str(one.most), ", ".join(one.compartments) or "-")
        for name, one in settings.items.items()
    )
    yield Table(
        "items", ("type_guid", "at most", "compartments"), rows or (("no items", "-", "-"),)
    )


def blind(settings: WorkcellSettings, *, busy: bool) -> Remarks:
    """Yield a warning for each state of the workcell that this wiring cannot show."""
    if not busy:
        text = "without busy, only cycle_limit_s reveals a cycle that stops in the middle"
        yield (), f"{text} ({settings.limits.cycle_limit_s:g} s)"


def create(name: str, settings: DryContactWorkcellSettings, bus: PointsBus) -> "DryContactWorkcell":
    """Make the workcell's driver on its bus. The driver touches nothing before `open`."""
    return DryContactWorkcell(Points(wires(settings), bus))


class DryContactWorkcell(OnPoints):
    """The driver of one dispenser or ingestor (`drivers.Driver`). While a relay selects a sort,
    `_selected` is the guid of the request that needs this sort."""

    def __init__(self, points: Points) -> None:
        super().__init__(points)
        self._selected = ""

    def read(self) -> WorkcellSample:
        """Read every contact now."""
        read = self._points.read().get
        return WorkcellSample(read("done"), read("busy"), read("ready"), read("fault"))

    def write(self, outputs: WorkcellOutputs) -> None:
        """Set the relays. At the beginning of a cycle, first switch on the relay that selects the sort,
        and then the start relay."""
        relays = {f"select_{outputs.item.type_guid}": True} if outputs.guid else {}
        if outputs.guid != self._selected:
            self._points.write(relays)
            self._selected = outputs.guid
        self._points.write({**relays, "start": outputs.start})


def _unsafe(settings: DryContactWorkcellSettings) -> Iterator[Unsafe]:
    return unsafe_wires(wires(settings), CUT_MUST_READ)


DRIVER = DriverType(
    settings=DryContactWorkcellSettings,
    buses=("gpio", "modbus"),
    create=create,
    wires=wires,
    debounce=debounce,
    tables=items_table,
    warnings=warnings,
    fake="hal_fakes.plants.dispenser",
)

"""A dispenser or ingestor behind HTTP and JSON. The call `start` begins a cycle. The answer to
`state_path` shows whether the cycle runs, has ended or has failed.

The body of `start` may contain the texts $guid, $type_guid, $quantity and $compartment as values. The
driver replaces each text with the value from RMF's request. The driver sends only one start for each
cycle, even if the answer is lost, because a second start could dispense twice.
"""

from collections.abc import Iterator
from typing import Annotated, Any, Final

import msgspec

from bridges.kinds.dispenser.settings import WorkcellSettings
from bridges.kinds.dispenser.signals import WorkcellOutputs, WorkcellSample
from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from drivers import DriverError, json_fields
from drivers.dispenser.dry_contact import blind, items_table
from drivers.driver_type import DriverType
from drivers.hal import http
from drivers.http_call import Call, InsistentCalls, claim, described, send
from drivers.json_fields import JsonFlag
from drivers.unsafe import Unsafe, needlessly_accepted, unaccepted

STOP: Final = "stop"


class WorkcellInputFields(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fields of the answer."""

    done: Annotated[
        JsonFlag,
        tells("the cycle has succeeded. The flag is off before a cycle and comes on at its end."),
    ]
    busy: Annotated[
        JsonFlag | None, tells("a cycle runs. A cycle that ends without `done` has failed.")
    ] = None
    ready: Annotated[
        JsonFlag | None, tells("a cycle may start. Without this field a cycle may always start.")
    ] = None
    fault: Annotated[JsonFlag | None, tells("the workcell reports a fault.")] = None


class HttpWorkcellSettings(WorkcellSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A dispenser or ingestor and its controller. Every path is relative to the bus's `api_base`."""

    state_path: Annotated[http.Path, tells("the path that GET reads the inputs from.")]
    inputs: Annotated[WorkcellInputFields, tells("the fields of that answer.")]
    start: Annotated[
        Call,
        tells("""starts one cycle. The driver replaces the texts "$guid", "$type_guid", "$quantity"
        and "$compartment" in its body by the values of the request."""),
    ]
    stop: Annotated[
        Call | None,
        tells("ends a running cycle. If no cycle runs, this call must do nothing."),
    ] = None

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        body = self.start.body or ""
        for name, asked in self.items.items():
            for wanted, mark, key in (
                (len(self.items) > 1, "$type_guid", ""),
                (asked.most > 1, "$quantity", "most"),
                (len(asked.compartments) > 1, "$compartment", "compartments"),
            ):
                if wanted and f'"{mark}"' not in body:
                    path = ("items", name, key) if key else ("items",)
                    yield (
                        path,
                        f'the body of start must contain this value: write "{mark}" into the body',
                    )
        if self.pulse_s is not None:
            yield (
                ("pulse_s",),
                "is for relays, but a start over HTTP is one command: delete pulse_s",
            )
        yield from unaccepted(_unsafe(self), self.accept_unsafe)


def _unsafe(settings: HttpWorkcellSettings) -> Iterator[Unsafe]:
    if settings.stop is None:
        text = (
            "nothing ends a cycle that takes too long or goes on after the daemon's end: give stop"
        )
        yield STOP, (), text


def claims(settings: HttpWorkcellSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each command with its path in the YAML. No other device may send these commands."""
    yield claim(settings.start), ("start", "path")
    if settings.stop is not None:
        yield claim(settings.stop), (STOP, "path")


def describe(settings: HttpWorkcellSettings, bus: http.HttpSettings) -> Iterator[tuple[str, str]]:
    """Yield rows for `check` about the state that the driver reads, and about the commands."""
    api = http.base(bus.api_base)
    yield "state", f"GET {api.url(settings.state_path)} every {bus.scan_s:g} s"
    for signal in settings.inputs.__struct_fields__:
        if place := getattr(settings.inputs, signal):
            yield signal, json_fields.place_text(place)
    yield "start", f"{described(settings.start, api)}, once for each cycle"
    yield STOP, described(settings.stop, api) if settings.stop else "nothing"


def warnings(settings: HttpWorkcellSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting to review before the workcell
    goes into service."""
    yield from needlessly_accepted(_unsafe(settings), settings.accept_unsafe)
    yield from blind(settings, busy=settings.inputs.busy is not None)


def create(name: str, settings: HttpWorkcellSettings, bus: InsistentCalls) -> "HttpWorkcell":
    """Make the workcell's driver on its bus. The driver sends nothing before `open`."""
    return HttpWorkcell(settings, bus)


class HttpWorkcell:
    """The driver of one dispenser or ingestor (`drivers.Driver`). `_sent` is the guid of the last
    request whose start the driver sent. `_on` is True until the cycle of this request has ended."""

    def __init__(self, settings: HttpWorkcellSettings, bus: InsistentCalls) -> None:
        self._settings = settings
        self._bus = bus
        self._sent = ""
        self._on = False

    def open(self) -> None:
        """Do nothing, because a restart must not end a cycle. The first reading shows whether the
        controller answers."""

    def read(self) -> WorkcellSample:
        """Read every input now. Raises DriverError."""
        answer, found = self._bus.get_json(self._settings.state_path), self._settings.inputs
        return WorkcellSample(
            done=json_fields.flag(answer, found.done),
            busy=json_fields.certain_if(answer, found.busy),
            ready=json_fields.flag_if(answer, found.ready),
            fault=json_fields.certain_if(answer, found.fault),
        )

    def write(self, outputs: WorkcellOutputs) -> None:
        """Send the start once for each cycle, and the stop when the cycle is over."""
        if outputs.start and outputs.guid != self._sent:
            self._sent, self._on = outputs.guid, True
            send(self._bus, filled(self._settings.start, outputs))
        elif not outputs.guid:
            self._sent = ""
            if self._on:
                self.make_safe()

    def make_safe(self) -> None:
        """End the cycle."""
        send(self._bus, self._settings.stop, safe=True)
        self._on = False

    def close(self) -> None:
        """End the cycle if one runs. Does not raise."""
        if not self._on:
            return
        self._bus.insist()
        try:
            self.make_safe()
        except DriverError:
            return  # do not raise: the daemon ends, so nobody could try again


def filled(call: Call, outputs: WorkcellOutputs) -> Call:
    """Return the call with the request's values in its body."""
    if call.body is None:
        return call
    item = outputs.item
    marks: dict[Any, object] = {
        "$guid": outputs.guid,
        "$type_guid": item.type_guid,
        "$quantity": item.quantity,
        "$compartment": item.compartment,
    }
    body = _put_in(msgspec.json.decode(call.body), marks)
    return msgspec.structs.replace(call, body=msgspec.json.encode(body).decode())


def _put_in(value: Any, marks: dict[Any, object]) -> object:
    if isinstance(value, dict):
        return {key: _put_in(inner, marks) for key, inner in value.items()}
    if isinstance(value, list):
        return [_put_in(inner, marks) for inner in value]
    return marks.get(value, value) if isinstance(value, str) else value


DRIVER = DriverType(
    settings=HttpWorkcellSettings,
    buses=("http",),
    create=create,
    describe=describe,
    tables=items_table,
    claims=claims,
    warnings=warnings,
    unwired=lambda settings: (STOP,),
    fake="hal_fakes.http_dispenser",
)

"""Points: the named contacts and relays of a device, on any bus that has them.

A driver works with signals that are asserted or not (`fire_alarm`, `call_L1`). This file knows each
signal's address, and whether high or low means asserted. The bus (`drivers/hal/`) knows only high and
low levels. Signals on GPIO pins are treated like signals on the coils and discrete inputs of a Modbus
I/O module.
"""

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, ClassVar, Literal, Protocol, runtime_checkable

import msgspec

from bridges.kinds.shared.fields import tells
from drivers import DriverError

Active = Literal["high", "low"]
Pull = Literal["up", "down", "none"]
Point = Annotated[str, msgspec.Meta(extra={"check": "point"})]
"""A contact's address. The bus's `canonical` checks the address while the YAML is read."""
OtherBus = Annotated[str, msgspec.Meta(extra={"check": "other bus"})]
"""The name of a bus other than the device's own bus. `bridges/settings/wiring.py` checks the name."""
DebounceSeconds = Annotated[float, msgspec.Meta(ge=0, le=10, extra={"unit": "s"})]


class Input(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One contact that the driver reads."""

    point: Annotated[
        Point, tells("the address: `BCM4` or `J8:7` on GPIO, `unit 1 discrete input 0` on Modbus.")
    ]
    active: Annotated[Active, tells("the level of an asserted signal (`high` is 1 on Modbus).")]
    pull: Annotated[
        Pull | None, tells("the pull resistor of an input; required on GPIO, refused on Modbus.")
    ] = None
    debounce_s: Annotated[
        DebounceSeconds | None,
        tells("how long a change must last. Without this key the default of the signal counts."),
    ] = None
    bus: Annotated[
        OtherBus | None,
        tells("""the bus that has this contact, if it is not the device's `bus`. While the daemon
        cannot read that bus, the device counts as not read too."""),
    ] = None

    def wire(self, signal: str, path: tuple[str, ...], debounce_s: float | None) -> "Wire":
        """Return the input's row of the wiring table. `debounce_s` is the default of the debounce."""
        own_s = debounce_s if self.debounce_s is None else self.debounce_s
        bus = self.bus or ""
        return Wire(signal, "in", self.point, self.active, self.pull, own_s, path, bus=bus)


class Output(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One relay or line that the driver drives. The safe level always means "not asserted"."""

    refused: ClassVar[Mapping[str, str]] = {
        "bus": "an output is always on the device's own bus: wire the relay there, and delete 'bus'"
    }

    point: Annotated[
        Point, tells("the address: `BCM18` or `J8:12` on GPIO, `unit 1 coil 0` on Modbus.")
    ]
    active: Annotated[Active, tells("the level of an asserted output.")]
    read_back: Annotated[
        bool,
        tells("""`false` for a coil that cannot be read back, or that the controller clears by
        itself. In this case every scan writes the coil, and nothing proves its level. On GPIO this
        key is refused."""),
    ] = True

    def wire(
        self,
        signal: str,
        path: tuple[str, ...],
        flash: "Flash | None" = None,
        clearing: "Clearing | None" = None,
    ) -> "Wire":
        """Return the output's row of the wiring table."""
        return Wire(
            signal,
            "out",
            self.point,
            self.active,
            path=path,
            flash=flash,
            read_back=self.read_back,
            clearing=clearing,
        )


def input_wires(inputs: msgspec.Struct, debounce_s: float | None = None) -> list["Wire"]:
    """Return a row for each Input of a YAML's `inputs`. `debounce_s` is the default of the debounce."""
    fields = ((signal, getattr(inputs, signal)) for signal in inputs.__struct_fields__)
    return [line.wire(s, ("inputs", s), debounce_s) for s, line in fields if line is not None]


class Flash(msgspec.Struct, frozen=True):
    """A pulse that a Modbus module ends by itself. `point` is the coil where the driver requests the
    pulse, and `on_s` is the pulse's length (s)."""

    point: str
    on_s: float


class Clearing(msgspec.Struct, frozen=True):
    """The behaviour of a controller that takes a command from a coil or register, and then clears it by
    itself. `bits` are the bits that hold the command.

    If `pulse` is true, the command is a pulse. Then the controller may clear it before the pulse's end,
    and no warning is given.
    """

    bits: int = 1
    pulse: bool = False


class Wire(msgspec.Struct, frozen=True):
    """One row of the wiring table: a signal, its point, and the meaning of its level."""

    signal: str
    direction: Literal["in", "out"]
    point: str
    active: Active
    pull: Pull | None = None
    debounce_s: float | None = None
    path: tuple[str, ...] = ()
    """The wire's path in the YAML for error messages. The path begins at the device."""
    flash: Flash | None = None
    read_back: bool = True
    clearing: Clearing | None = None
    """The behaviour of a controller that clears this output by itself, or None."""
    bus: str = ""
    """The bus of an input that is not on the device's own bus."""

    def level(self, asserted: bool) -> bool:
        """Return the electrical level (True is high) for an asserted or a not asserted signal."""
        return asserted == (self.active == "high")

    def asserted(self, level: int) -> bool:
        """Return whether this electrical level (1 is high) means asserted."""
        return level == (self.active == "high")

    def broken_reads(self) -> bool | None:
        """Return how a cut wire reads. True means asserted, and False means not asserted. None means
        that the wire floats, so that it may read either way.

        A cut wire at a GPIO input takes the level of the input's pull. At a Modbus module an open
        contact reads 0.
        """
        if self.direction == "out":
            return False
        if self.pull == "none":
            return None
        return self.asserted(self.pull == "up")


def debounces(wires: Iterable[Wire]) -> dict[str, float]:
    """Return the debounce (s) of each input, by signal."""
    return {wire.signal: wire.debounce_s for wire in wires if wire.debounce_s is not None}


def is_number(wires: Iterable[Wire]) -> bool:
    """Return whether these lines are bits of registers. Such bits form a number inside a controller,
    and have no cable that somebody could cut."""
    return all(re.search(r"\bbit\b", wire.point, re.IGNORECASE) for wire in wires)


def are_pins(wires: Iterable[Wire]) -> bool:
    """Return whether these wires are at pins of the header. Pins switch within microseconds of each
    other. At other buses each output needs a request of its own."""
    return all(re.match(r"BCM|J8:", wire.point) for wire in wires)


class Lines(Protocol):
    """The contacts and relays of one device on one bus, as raw levels. The values 1 and True mean
    high."""

    def claim(self) -> None:
        """Claim every input and every output. An output must have its safe level from the first moment.
        Raises HalError."""

    def read(self) -> Mapping[str, int]:
        """Read every input now. Return the level of each input. The keys are the canonical spellings of
        the points. Raises HalError.

        The result contains an output only if the output has lost its level and must be written again.
        """

    def write(self, levels: Mapping[str, bool]) -> None:
        """Drive these outputs. Raises HalError. After an error the levels of these outputs are unknown.

        The call tries every output that goes to its safe level, even after another output has failed.
        """

    def outputs(self) -> Mapping[str, int] | None:
        """Read back the levels of the outputs that can be read. Return None if no output can be
        read."""

    def close(self) -> None:
        """Set the outputs to their safe level and release every line. Does not raise."""


@runtime_checkable
class FlashLines(Protocol):
    """Lines of a bus whose modules can end a pulse by themselves."""

    def flash(self, point: str, flash: Flash) -> None:
        """Request a pulse, only once. The module switches this output on, and switches it off again by
        itself.

        Raises HalError. After an error the output may be on.
        """


@runtime_checkable
class RenewedLines(Protocol):
    """Lines of a bus whose relays may have timers. A relay's own timer switches the relay off."""

    def renew(self, points: Iterable[str]) -> None:
        """Restart the timers of these relays, which must be on already. Raises HalError."""


class PointsBus(Protocol):
    """A bus that has points: GPIO, Modbus or MQTT."""

    def canonical(self, point: str) -> str:
        """Return the canonical spelling of a point. Raises ValueError with the right spelling."""

    def lines(
        self,
        inputs: Mapping[str, Pull | None],
        outputs: Mapping[str, bool],
        unread: Collection[str] = (),
        clearing: Mapping[str, Clearing] = MappingProxyType({}),
    ) -> Lines:
        """Return the lines of one device: its inputs, and its outputs with their safe levels. All
        points are in canonical spelling.

        `unread` are the outputs that are never read back. `clearing` are the outputs that the
        controller may clear.
        """


class HalError(DriverError):
    """The error of a bus, such as a missing chip, a refused connection, a timeout or a bad frame."""


Readings = Callable[[], Mapping[str, bool]]
"""A function that returns for each input on another bus whether the input is asserted. The function
raises DriverError while one of these inputs is unknown."""


def _not_read() -> Mapping[str, bool]:
    raise DriverError("no function to read the inputs on the other bus is set")


class Points:
    """The signals of one device, as asserted or not.

    The outputs are on `bus`, the device's own bus. `take_inputs` sets the function that reads the
    inputs on other buses.
    """

    def __init__(self, wires: Sequence[Wire], bus: PointsBus) -> None:
        self._elsewhere = _not_read if any(wire.bus for wire in wires) else dict[str, bool]
        wires = [wire for wire in wires if not wire.bus]
        self._in = {w.signal: (w, bus.canonical(w.point)) for w in wires if w.direction == "in"}
        self._out = {w.signal: (w, bus.canonical(w.point)) for w in wires if w.direction == "out"}
        self._lines = bus.lines(
            {point: w.pull for w, point in self._in.values()},
            {point: w.level(False) for w, point in self._out.values()},
            {point for w, point in self._out.values() if not w.read_back},
            {point: w.clearing for w, point in self._out.values() if w.clearing},
        )
        self._unread = {signal for signal, (wire, _) in self._out.items() if not wire.read_back}
        self._driven = {point for _, point in self._out.values()}
        self._renews = isinstance(self._lines, RenewedLines)
        self._levels: Mapping[str, int] = {}
        self._here: dict[str, bool] = {}
        self._read: dict[str, bool] = {}
        self._written: dict[str, bool] | None = None

    def take_inputs(self, elsewhere: Readings) -> None:
        """From now on, call `elsewhere` to read the inputs that are on other buses."""
        self._elsewhere = elsewhere

    def open(self) -> None:
        """Claim every line. No output is asserted afterwards."""
        self._written = None
        self._lines.claim()

    def read(self) -> dict[str, bool]:
        """Return for each input whether it is asserted. If no input has changed, the call returns the
        same object again. After a failure of the device's own bus, the next `write` writes all outputs
        again.

        Raises DriverError also while the inputs of another bus are unknown.
        """
        written, self._written = self._written, None
        levels = self._lines.read()
        kept = written or {}
        if not self._driven.isdisjoint(levels):
            kept = {s: on for s, on in kept.items() if self._out[s][1] not in levels}
        self._written = kept
        if levels != self._levels or not self._here:
            self._here = {s: w.asserted(levels[point]) for s, (w, point) in self._in.items()}
            self._levels = levels
        elsewhere = self._elsewhere()
        self._read = {**self._here, **elsewhere} if elsewhere else self._here
        return self._read

    def last_known(self) -> dict[str, bool]:
        """Return each input's last reading, and each output's last written value. Leave out an output
        whose value is unknown."""
        return {**self._read, **(self._written or {})}

    def write(self, asserted: Mapping[str, bool]) -> None:
        """Set every output. Outputs that go off come first, so that exclusive outputs never overlap."""
        wanted = {signal: asserted.get(signal, False) for signal in self._out}
        if wanted == self._written and not (self._unread or self._renews):
            return
        known = self._written or {}
        changed = [s for s in wanted if known.get(s) != wanted[s] or s in self._unread]
        kept = [self._out[s][1] for s in wanted if wanted[s] and s not in changed]
        for turning_on in (False, True):
            levels = {
                self._out[s][1]: self._out[s][0].level(wanted[s])
                for s in changed
                if wanted[s] == turning_on
            }
            if levels:
                self._written = None
                self._lines.write(levels)
        if kept and isinstance(self._lines, RenewedLines):
            self._written = None
            self._lines.renew(kept)
        self._written = wanted

    def off(self, signals: Iterable[str]) -> None:
        """Switch these outputs off, even if they should be off already. Try each one, even if another
        one fails. Raises HalError. The next `write` writes all outputs again."""
        self._written = None
        found = [self._out[signal] for signal in signals]
        self._lines.write({point: wire.level(False) for wire, point in found})

    def flash(self, signal: str) -> None:
        """Request a pulse of this output, which the module ends by itself. From now on the output's
        level is unknown.

        Raises HalError. After an error the module may still give the pulse. A second request would
        prolong the pulse.
        """
        wire, point = self._out[signal]
        assert wire.flash  # callers pass only outputs with `flash`
        assert isinstance(self._lines, FlashLines)  # `wire_problems` refuses `flash` on other buses
        self._written = None
        self._lines.flash(point, wire.flash)

    def make_safe(self) -> None:
        """Switch every output off, even if the output should be off already. Read the outputs back
        where the hardware allows this."""
        self._written = None
        self.write({})
        levels = self._lines.outputs()
        stuck = [
            signal
            for signal, (w, point) in self._out.items()
            if levels is not None and point in levels and w.asserted(levels[point])
        ]
        if stuck:
            raise DriverError(f"still on after being switched off: {', '.join(stuck)}")

    def close(self) -> None:
        """Switch every output off and release the lines."""
        self._lines.close()

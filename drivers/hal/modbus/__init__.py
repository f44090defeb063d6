"""Modbus: the coils and discrete inputs of I/O modules, over TCP or on a serial line (RTU).

- A request has `timeout_s` from the lookup of the name to the last byte of the reply, and is tried
  `retries` times more. That a late reply or half a frame is never taken for the answer to another
  question is the work of `modbus_wire.py` (TCP: new connections) and `modbus_rtu.py` (RTU: silence).
  Only reads and coil writes are repeated: a repeat changes nothing.
- A connection or port that cannot be opened pauses the bus, a unit that fails pauses that unit, from
  0.5 to 30 s; meanwhile calls fail at once with the same text. After a pause there is one try until the
  unit answers again: a dead unit costs the others one `timeout_s` a pause, and no more.
- Nothing is written before a first good reading. What is written is read back, and looked at again in
  each reading: a module that restarts with its coils off, or whose watchdog has tripped, is noticed.

A gateway that waits for its serial units longer than `timeout_s` makes the others wait too: set its
own timeout below ours.
"""

import functools
import math
import random
import time
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Final

import msgspec

from bridges.core.fields import Period
from drivers.hal import Bus, BusType, HalError
from drivers.hal.backoff import Backoff
from drivers.hal.modbus.flash import ask_for
from drivers.hal.modbus.places import Serial, Tcp
from drivers.hal.modbus.points import (
    Point,
    Range,
    canonical,
    describe,
    parse,
    pieces,
    ranges,
    wire_problems,
)
from drivers.hal.modbus.replies import EXCEPTIONS
from drivers.hal.modbus.rtu import Line
from drivers.hal.modbus.watchdog import Guard, Watchdog, Watchdogs
from drivers.hal.modbus.wire import BadReply, Call, Connection, NoReply, Unreachable
from drivers.hal.points import Flash, Pull

if TYPE_CHECKING:
    from pymodbus.client.mixin import ModbusClientMixin
    from pymodbus.pdu import ModbusPDU

__all__ = [
    "BUS",
    "EXCEPTIONS",
    "ModbusBus",
    "Serial",
    "Settings",
    "Tcp",
    "canonical",
    "describe",
    "open_bus",
    "warnings",
    "wire_problems",
]

READS: Final = {"coil": 1, "discrete input": 2}
WRITE_COIL: Final = 5
ILLEGAL_ADDRESS: Final = 2

Timeout = Annotated[float, msgspec.Meta(ge=0.05, le=5, extra={"unit": "s"})]


class Settings(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag_field="type",
    tag="modbus",
):
    """A module, or a gateway or serial line with several units: `tcp` or `serial`, one of the two.

    `tcp`: where the module or gateway listens.
    `serial`: the serial line (Modbus RTU).
    `timeout_s`: for one try of one request.
    `retries`: how many more tries a request gets.
    `scan_s`: how often every input is read.
    `module_watchdog`: the modules' own dead-man switch for their outputs.
    """

    tcp: Tcp | None = None
    serial: Serial | None = None
    timeout_s: Timeout = 0.3
    retries: Annotated[int, msgspec.Meta(ge=0, le=5)] = 1
    scan_s: Period = 0.1
    module_watchdog: Watchdog | None = None

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """What the fields cannot say one by one."""
        if self.tcp is None and self.serial is None:
            yield (), "says not where the units are: write tcp: {host: …} or serial: {port: …}"
        elif self.tcp and self.serial:
            yield ("serial",), "a bus has tcp or serial: write a second bus for the other"


def warnings(settings: Settings) -> Iterable[tuple[tuple[str, ...], str]]:
    """What is legal but worth a look: (path, text)."""
    for path, text in settings.serial.warnings() if settings.serial else ():
        yield ("serial", *path), text
    for path, text in settings.module_watchdog.warnings() if settings.module_watchdog else ():
        yield ("module_watchdog", *path), text


def open_bus(settings: Settings) -> "ModbusBus":
    """The way to this module; nothing is sent yet."""
    return ModbusBus(settings)


class ModbusRefused(HalError):
    """The unit answered with an exception; `code` is its number."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


class ModbusBus(Bus):
    """One TCP connection or serial line, and the units there (also a `drivers.hal.points.PointsBus`).

    `clock` and `jitter` are a test's in place of the real ones; `now` is that clock.
    """

    canonical = staticmethod(canonical)

    def __init__(
        self,
        settings: Settings,
        clock: Callable[[], float] = time.monotonic,
        jitter: Callable[[], float] = random.random,
    ) -> None:
        self.now = clock
        self._settings = settings
        self._connection, self._where = _way(settings)
        self._backoff = functools.partial(Backoff, clock, jitter)
        self._link = self._backoff()
        self._units: dict[int, Backoff] = {}
        self._watchdogs = Watchdogs(self, settings.module_watchdog, clock)

    def lines(
        self, inputs: Mapping[str, Pull | None], outputs: Mapping[str, bool]
    ) -> "ModbusLines":
        """Canonical inputs, and coils with their safe level (True is 1)."""
        return ModbusLines(self, inputs, outputs)

    def read(self, bits: Range) -> dict[Point, bool]:
        """These bits, read now. Raises HalError."""
        function = READS[bits.table]

        def call(client: "ModbusClientMixin[ModbusPDU]") -> "ModbusPDU":
            ask = client.read_coils if bits.table == "coil" else client.read_discrete_inputs
            reply = ask(bits.start, count=bits.count, device_id=bits.unit)
            if not reply.isError() and len(reply.bits) != 8 * math.ceil(bits.count / 8):
                raise BadReply(f"{len(reply.bits)} bits for {bits.count}")
            return reply

        reply = self.ask(bits.unit, function, f"read {bits}", call)
        return dict(zip(bits.points(), reply.bits, strict=False))

    def write(self, coil: Point, level: bool) -> None:
        """Set this coil. Raises HalError; then it may be set or not."""
        sent = [0xFF00 if level else 0]

        def call(client: "ModbusClientMixin[ModbusPDU]") -> "ModbusPDU":
            reply = client.write_coil(coil.address, level, device_id=coil.unit)
            if not reply.isError() and (reply.address, reply.registers) != (coil.address, sent):
                raise BadReply("the echo of another write")
            return reply

        self.ask(coil.unit, WRITE_COIL, f"write coil {coil.address}", call)

    def guard(self, units: Iterable[int]) -> Guard:
        """The modules' own watchdogs, for a device with outputs at these units."""
        return self._watchdogs.guard(units)

    def scanned(self) -> None:
        """Keep the modules' watchdogs from tripping."""
        self._watchdogs.scanned()

    def insist(self) -> None:
        """Try at once what is asked next, whatever the pauses: to switch off before the end."""
        for backoff in (self._link, *self._units.values()):
            backoff.insist()

    def close(self) -> None:
        """Hang up."""
        self._connection.close()

    def ask(
        self, unit: int, function: int, what: str, call: Call, *, once: bool = False
    ) -> "ModbusPDU":
        """The unit's good answer to one request. `once`: a repeat would change something."""
        backoff = self._units.setdefault(unit, self._backoff())
        self._link.check()
        backoff.check(not_yet=backoff.probing and self._connection.owes(unit))
        text = f"modbus unit {unit} at {self._where}, {what}: "
        reason = ""
        tries = 1 if once or backoff.probing else self._settings.retries + 1
        if not backoff.insisting:
            self._connection.begin(unit)
        for _ in range(tries):
            try:
                self._connection.connect()
                reply = self._connection.ask(function, call)
            except Unreachable as error:
                raise self._link.failed(str(error)) from error
            except NoReply as error:
                reason = str(error)
                continue
            self._link.mended()
            if reply.isError():
                self._watchdogs.refused(unit, reply.exception_code)
                raise _refused(backoff, text, reply.exception_code)
            backoff.mended()
            return reply
        raise backoff.failed(f"{text}{reason}, tried {tries}x")


def _way(settings: Settings) -> tuple[Connection | Line, str]:
    """How to reach the units, and where that is, for texts."""
    if settings.serial:
        return Line(settings.serial, settings.timeout_s), settings.serial.port
    assert settings.tcp  # or `problems` has said so
    host, port = settings.tcp.host, settings.tcp.port
    return Connection(host, port, settings.timeout_s), f"{host}:{port}"


def _refused(backoff: Backoff, text: str, code: int) -> HalError:
    """An exception reply. One about the question itself shows that the unit lives: no pause."""
    text += f"exception {code}, {EXCEPTIONS.get(code, EXCEPTIONS[9])}"
    if code not in (1, 2, 3):
        backoff.failed(text)
    return ModbusRefused(text, code)


class ModbusLines:
    """The points of one device (`drivers.hal.points.Lines`), by their canonical spelling."""

    def __init__(self, bus: ModbusBus, inputs: Iterable[str], outputs: Mapping[str, bool]) -> None:
        self._bus = bus
        self._inputs = {name: parse(name) for name in inputs}
        self._coils = {name: parse(name) for name in outputs}
        self._safe = dict(outputs)
        self._ranges = ranges([*self._inputs.values(), *self._coils.values()])
        self._set: dict[Point, bool] = {}
        self._touched = False
        self._claimed = False
        self._guard = bus.guard(coil.unit for coil in self._coils.values())

    def claim(self) -> None:
        """Read the coils, then switch each to its safe level, and see that it is.

        Inputs are not asked: one that cannot be read must not keep an output from going off. Claimed
        again after a failure it only reads: the outputs are as they were, or as the next write says.
        A door that is held must not drop because one reply was lost.
        """
        self._set.clear()
        self._guard.check()
        self.outputs()
        if not self._claimed:
            self.write(self._safe)
            self._claimed = True

    def read(self) -> dict[str, bool]:
        """Every input's level. Raises HalError, also when an output is not as it was written."""
        self._see_watchdogs()
        image = self._read_all(self._ranges)
        self._verify(image)
        return {name: image[point] for name, point in self._inputs.items()}

    def write(self, levels: Mapping[str, bool]) -> None:
        """Set these coils and read them back."""
        self._touched = True
        wanted = {self._coils[name]: level for name, level in levels.items()}
        for coil, level in wanted.items():
            self._set.pop(coil, None)
            self._bus.write(coil, level)
        self._set.update(wanted)
        self._verify(self._read_all(ranges(wanted)))

    def flash(self, point: str, flash: Flash) -> None:
        """Ask the module for this pulse. Its coil reads 1, then 0 by itself: it is not compared."""
        self._touched = True
        self._set.pop(self._coils[point], None)
        ask_for(self._bus, parse(flash.point), flash.on_s)

    def outputs(self) -> dict[str, bool]:
        """The coils, read now."""
        image = self._read_all(ranges(self._coils.values()))
        return {name: image[coil] for name, coil in self._coils.items()}

    def close(self) -> None:
        """Every coil to its safe level, one try for each unit whatever the pauses; not if unclaimed."""
        if not self._touched:
            return
        self._bus.insist()
        for name, coil in self._coils.items():
            try:
                self._bus.write(coil, self._safe[name])
            except HalError:
                continue  # the unit pauses now: its other coils cost no time

    def _see_watchdogs(self) -> None:
        try:
            self._guard.check()
        except HalError:
            self._set.clear()
            raise

    def _read_all(self, wanted: list[Range]) -> dict[Point, bool]:
        image: dict[Point, bool] = {}
        for bits in tuple(wanted):  # which may be split meanwhile
            try:
                image.update(self._bus.read(bits))
            except ModbusRefused as refusal:
                image.update(self._read_pieces(bits, refusal))
        return image

    def _read_pieces(self, bits: Range, refusal: ModbusRefused) -> dict[Point, bool]:
        """A module may lack the addresses in a gap: from now on they are left out."""
        parts = pieces(bits, [*self._inputs.values(), *self._coils.values()])
        if refusal.code != ILLEGAL_ADDRESS or len(parts) == 1:
            raise refusal
        image: dict[Point, bool] = {}
        for part in parts:
            image.update(self._bus.read(part))
        if bits in self._ranges:
            at = self._ranges.index(bits)
            self._ranges[at : at + 1] = parts
        return image

    def _verify(self, image: Mapping[Point, bool]) -> None:
        for coil, level in self._set.items():
            if image.get(coil, level) != level:
                self._set.clear()
                raise HalError(
                    f"{coil} reads {int(not level)} after {int(level)} was written: the module has"
                    " restarted, its watchdog has tripped, or somebody else writes it"
                )


BUS = BusType(
    settings=Settings,
    open_bus=open_bus,
    fake="hal_fakes.modbus",
    warnings=warnings,
    canonical=canonical,
    describe=describe,
    wire_problems=wire_problems,
)

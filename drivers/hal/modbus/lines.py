"""One device's coils and registers. Every driver claims, reads, writes, reads back and closes its lines
through this file.

The driver reads an output before its first write, and reads it back after each write. Each later
reading compares the output with the written value. A difference reveals a module that restarted with
its outputs off, a tripped watchdog, or another master (`drivers/hal/rivals.py`). Every output that
should go to its safe value is written, even if another output, an input or the unit's watchdog fails.
"""

from collections.abc import Collection, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from types import MappingProxyType
from typing import TYPE_CHECKING

from drivers.hal import HalError
from drivers.hal.every import Every
from drivers.hal.modbus.clearing import ClearedCalls
from drivers.hal.modbus.points import Point, Range, parse, pieces, ranges
from drivers.hal.modbus.wire import ILLEGAL_ADDRESS, UnitException
from drivers.hal.points import Clearing, Flash
from drivers.hal.rivals import Rivals

if TYPE_CHECKING:
    from drivers.hal.modbus.bus import ModbusBus


class Image:
    """A set of points that are read together, in as few requests as possible."""

    def __init__(self, units: "ModbusBus", points: Iterable[Point]) -> None:
        self._units = units
        self._points = set(points)
        self._ranges = ranges(self._points)

    def read(self, safe: bool = False, every: Every | None = None) -> dict[Point, int]:
        """Read bits (0 or 1) and registers now. Raises HalError.

        With `every`, return all points that can be read, even if other points fail.
        """
        image: dict[Point, int] = {}
        asked = list(self._ranges)
        while asked:
            with _tried(every):
                image |= self._part(asked.pop(0), asked, safe)
        return image

    def _part(self, part: Range, asked: list[Range], safe: bool) -> dict[Point, int]:
        """Make one request. If the module lacks an address between used points, later requests leave
        that address out."""
        parts = pieces(part, self._points) if self._units.refused.within(part) else []
        if len(parts) < 2:
            try:
                return self._units.read(part, safe)
            except UnitException as refusal:
                parts = pieces(part, self._points)
                if refusal.code != ILLEGAL_ADDRESS or len(parts) == 1:
                    raise
            self._units.refused.add(part)
        asked[:0] = parts
        at = self._ranges.index(part)
        self._ranges[at : at + 1] = parts
        return {}


class ModbusLines:
    """One device's inputs and outputs by name (`drivers.hal.points.Lines`).

    `safe` gives each output's safe value. `unread` are the outputs that cannot be read back. Every scan
    writes the `unread` outputs, because the controller may have restarted. `clearing` are the outputs
    that the controller may clear by itself (`clearing.py`).
    """

    def __init__(
        self,
        units: "ModbusBus",
        inputs: Mapping[str, Point],
        outputs: Mapping[str, Point],
        safe: Mapping[str, int],
        unread: Collection[str] = (),
        clearing: Mapping[str, Clearing] = MappingProxyType({}),
    ) -> None:
        self._units = units
        self._inputs = dict(inputs)
        self._outputs = dict(outputs)
        self._safe = dict(safe)
        self._unread = frozenset(unread)
        back = [point for name, point in outputs.items() if name not in self._unread]
        self._back = Image(units, back)
        self._all = Image(units, [*(point.cell for point in inputs.values()), *back])
        self._calls = ClearedCalls(units.now, units.scan_s, safe, clearing)
        self._clearing = bool(clearing)
        self._verified: tuple[dict[str, int], dict[Point, int]] | None = None
        """The written values and the readings that `read` has compared last, so that it need not
        compare the same values again. It is None if a controller may clear outputs, because then the
        result depends on time too."""
        self._levels: dict[str, int] = {}
        self._set: dict[str, int] = {}
        self._touched = False
        self._claimed = False
        self._rivals = Rivals(units.now)
        self._guard = units.guard(point.unit for point in outputs.values())

    def claim(self) -> None:
        """Read each output. In the first claim, also bring each output to its safe value.

        If the outputs cannot be read, read the inputs instead, to check that the unit answers. A claim
        after a failure leaves the outputs unchanged. For example, a lost reply must not release a door
        that RMF holds.
        """
        self._set.clear()
        every = Every()
        with every.one():
            self._guard.check()
        found = self._back.read(every=every)
        if not self._claimed:
            names = (n for n, p in self._outputs.items() if p in found or n in self._unread)
            self._write({name: self._safe[name] for name in names}, every)
        every.check()
        if self._unread:
            self._all.read()
        self._claimed = True

    def read(self) -> dict[str, int]:
        """Read every input. Return also each output whose call has disappeared, so that the driver
        writes the call again.

        A call (such as a lift's call) may disappear because the controller clears it or restarts
        (`clearing.py`). Raises HalError if a request fails, or if an output contradicts its written
        value. After a failure the outputs count as unknown.
        """
        known, self._set = self._set, {}
        self._guard.check()
        asked_at = self._units.now()
        image = self._all.read()
        if self._verified == (known, image):
            self._set = known
            return self._levels
        self._verify(known, image)
        lost = self._lost(known, image, asked_at)
        self._set = {name: value for name, value in known.items() if name not in lost}
        self._levels = {**lost, **{n: p.of(image[p.cell]) for n, p in self._inputs.items()}}
        self._verified = None if self._clearing else (dict(known), image)
        return self._levels

    def bring(self, values: Mapping[str, int]) -> None:
        """Set these outputs. Do not write an output that is known to have its value already.

        Raises HalError if a request fails, or if an output does not read back as written. Also raises
        HalError while another master writes one of the device's outputs.
        """
        changed = {n for n, value in values.items() if self._set.get(n) != value}
        self.write({n: values[n] for n in values if n in changed | self._unread})
        self._rivals.check(map(str, self._outputs.values()))

    def write(self, values: Mapping[str, int]) -> None:
        """Set these outputs, and read them back. Raises HalError if a request fails, or if an output
        does not read back as written. After an error the values of these outputs are unknown."""
        every = Every()
        self._write(values, every)
        every.check()

    def flash(self, point: str, flash: Flash) -> None:
        """Request this pulse. The module itself switches the coil, so the coil's value is not
        compared."""
        self._touched = True
        self._set.pop(point, None)
        self._units.flash(parse(flash.point), flash.on_s)

    def outputs(self) -> dict[str, int] | None:
        """Read the outputs now. Return None if no output can be read."""
        image = self._back.read()
        return {n: image[p] for n, p in self._outputs.items() if n not in self._unread} or None

    def make_safe(self) -> None:
        """Set every output to its safe value, even if the output should have this value already. Raises
        HalError."""
        self.write(self._safe)

    def close(self) -> None:
        """If this device ever wrote an output, try once to make every output safe. Does not raise."""
        if not self._touched:
            return
        self._units.insist()
        unheard = Every()  # nobody reads these failures, because the daemon ends
        for name, point in self._outputs.items():
            with unheard.one():
                self._units.write(point, self._safe[name], safe=True)

    def _write(self, values: Mapping[str, int], every: Every) -> None:
        """Write the outputs. The outputs that get their safe value come first, and after a failure only
        they are written. Then read each written output back."""
        self._touched = self._touched or bool(values)
        safe = {name for name, value in values.items() if value == self._safe[name]}
        written: dict[str, int] = {}
        for name in sorted(values, key=lambda name: name not in safe):
            self._set.pop(name, None)
            if name in safe or not every.failure:
                with every.one():
                    if name not in safe:
                        self._rivals.check([str(self._outputs[name])])
                    self._units.write(self._outputs[name], values[name], safe=name in safe)
                    self._calls.wrote(name)
                    written[name] = values[name]
        self._read_back(written, safe=len(safe) == len(values), every=every)

    def _read_back(self, written: Mapping[str, int], safe: bool, every: Every) -> None:
        points = [self._outputs[name] for name in written if name not in self._unread]
        with every.one():
            self._verify(written, Image(self._units, points).read(safe))
            self._set |= written

    def _verify(self, written: Mapping[str, int], image: Mapping[Point, int]) -> None:
        for name, value in written.items():
            point = self._outputs[name]
            if not self._calls.may_read(name, value, self._reading(name, value, image)):
                self._rivals.contradicted(str(point))
                self._rivals.check([str(point)])
                raise HalError(
                    f"{point} reads {image[point]} after {value:d} was written: the module has"
                    " restarted, its watchdog has tripped, or another master writes the output"
                )

    def _reading(self, name: str, value: int, image: Mapping[Point, int]) -> int:
        """Return an output's value in `image` (the last readings). Return the written value instead if
        `image` lacks the output, or if the output cannot be read back (`unread`)."""
        return value if name in self._unread else image.get(self._outputs[name], value)

    def _lost(
        self, known: Mapping[str, int], image: Mapping[Point, int], asked_at: float
    ) -> dict[str, int]:
        """Return the reading of each output whose call has disappeared. The driver must write these
        calls again. `asked_at`: the time when the request for `image` was sent."""
        lost: dict[str, int] = {}
        for name, value in known.items():
            point = self._outputs[name]
            reading = self._reading(name, value, image)
            if not self._calls.keeps(name, value, reading, asked_at):
                lost[name] = image[point]
            self._calls.tell(name, str(point))
        return lost


def _tried(every: Every | None) -> AbstractContextManager[None]:
    return nullcontext() if every is None else every.one()

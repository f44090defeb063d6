"""The units of one TCP connection or serial line: one request at a time, with retries and backoff.

- One try of a request has `timeout_s`, from the name lookup to the last byte of the reply. After a
  failure there are up to `retries` more tries. Reads and writes may be repeated. A pulse is not
  repeated, because a repeat would prolong it.
- A late reply or an incomplete frame must not pass for the reply to another request. To prevent this,
  `tcp.py` opens a new connection after a failure, and `rtu.py` waits for silence.
- If the connection or port cannot be opened, the whole bus backs off for 0.5 to 30 s. If a unit fails,
  only this unit backs off. During a backoff calls fail at once with the same text.
- After a backoff each request gets only one try, until the unit answers again. A unit that has never
  answered also gets only one try. So a dead unit costs the other units one `timeout_s` for each
  backoff. After such a failed try no other dead unit is tried for TURN_S, so that the units that answer
  are read in between.
- At each unit, writes that switch off have a backoff of their own. So a failed reading never delays the
  first such write.

If a gateway waits for its serial units longer than `timeout_s`, the other units wait too. Set the
gateway's timeout below `timeout_s`.
"""

import functools
import math
import random
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from types import MappingProxyType
from typing import Final

from drivers.hal import Bus, HalError
from drivers.hal.backoff import Backoff
from drivers.hal.modbus.dead_man import DeviceWatchdogs, Watchdogs
from drivers.hal.modbus.lines import Image, ModbusLines
from drivers.hal.modbus.points import Point, Range, RefusedRanges, canonical, parse
from drivers.hal.modbus.settings import ModbusSettings
from drivers.hal.modbus.wire import (
    COIL_ON,
    EXCEPTIONS,
    READS,
    UNDEFINED,
    WRITES,
    NoReply,
    UnitException,
    UnitReply,
    UnitRequest,
    UnitWire,
    Unreachable,
)
from drivers.hal.points import Clearing, Pull

TURN_S: Final = 0.05
"""The pause (s) after a failed try before a try of another failed unit. The scan that has begun ends
within this pause. The pause is shorter than the period of scans."""


class ModbusBus(Bus):
    """One TCP connection or serial line, and its units. It is also a `drivers.hal.points.PointsBus`.

    Tests replace `clock` and `jitter`. `now` is the clock. `scan_s` is the period of readings (s).
    `refused` remembers each range of addresses that a unit has refused to read, because the range
    includes an address that the unit lacks. No further reading asks for such a range.
    """

    canonical = staticmethod(canonical)

    def __init__(
        self,
        settings: ModbusSettings,
        clock: Callable[[], float] = time.monotonic,
        jitter: Callable[[], float] = random.random,
    ) -> None:
        self.now = clock
        self.scan_s = settings.scan_s
        self.refused = RefusedRanges()
        self._settings = settings
        self._wire, self._where = _way(settings)
        self._backoff = functools.partial(Backoff, clock, jitter)
        self._link = self._backoff()
        self._backoffs: dict[tuple[int, bool], Backoff] = {}
        self._turn_at = -math.inf
        self._watchdogs = Watchdogs(self, settings.module_watchdog, clock)

    def lines(
        self,
        inputs: Mapping[str, Pull | None],
        outputs: Mapping[str, bool],
        unread: Collection[str] = (),
        clearing: Mapping[str, Clearing] = MappingProxyType({}),
    ) -> ModbusLines:
        """Return the lines of these points: canonical inputs, and coils with their safe level (True
        means 1)."""
        read, driven = ({n: parse(n) for n in names} for names in (inputs, outputs))
        return ModbusLines(self, read, driven, dict(outputs), unread, clearing)

    def read(self, asked: Range, safe: bool = False) -> dict[Point, int]:
        """Read these bits (0 or 1) or registers with one request. Raises HalError."""
        question = UnitRequest(asked.unit, READS[asked.table], asked.start, asked.count)
        found = self._ask(f"read {asked}", question, safe)
        return dict(zip(asked.points(), found.values, strict=True))

    def cells(self, points: Iterable[Point]) -> dict[Point, int]:
        """Read these bits and registers in as few requests as possible. Raises HalError."""
        return Image(self, points).read()

    def write(self, point: Point, value: int, safe: bool = False) -> None:
        """Set this coil (0 or 1) or register. Raises HalError. After an error the value of the coil or
        register is unknown."""
        coil = point.table == "coil"
        sent = (COIL_ON if value else 0) if coil else value
        what = f"write {'coil' if coil else 'register'} {point.address}"
        self._ask(what, UnitRequest(point.unit, WRITES[point.table], point.address, sent), safe)

    def flash(self, place: Point, on_s: float) -> None:
        """Let the module switch a relay on and, after `on_s` seconds, off again. This is the command
        "flash on" of Waveshare's Modbus RTU Relay boards.

        The request is function 5. Its address is 0x0200 plus the relay's number, which begins at 0. Its
        value is the time in tenths of a second. The reply is an echo. Source: the maker's manual,
        protocol V2: `01 05 02 00 00 07 8D B0` switches relay 0 of unit 1 on for 0.7 s.

        The request is sent once, because a second request would restart the pulse. Raises HalError.
        After an error it is unknown whether the module gives the pulse.
        """
        question = UnitRequest(place.unit, WRITES["coil"], place.address, round(on_s * 10))
        self._ask(f"flash at coil {place.address:#x}", question, once=True)

    def guard(self, units: Iterable[int]) -> DeviceWatchdogs:
        """Return the watchdogs of the modules at these units, where the caller's device has its
        outputs."""
        return self._watchdogs.guard(units)

    def scanned(self) -> None:
        """Refresh the modules' watchdogs, so that they do not trip."""
        self._watchdogs.scanned()

    def insist(self) -> None:
        """Let the next call skip the backoff, so that outputs go off before the daemon ends."""
        for backoff in (self._link, *self._backoffs.values()):
            backoff.insist()

    def close(self) -> None:
        """Close the connection or port."""
        self._wire.close()

    def _ask(
        self, what: str, question: UnitRequest, safe: bool = False, once: bool = False
    ) -> UnitReply:
        """Return the unit's valid answer. With `once` send the request only once. Raises HalError."""
        unit = question.unit
        backoff = self._backoffs.setdefault((unit, safe), self._backoff())
        self._link.check()
        not_yet = self._wire.owes(unit) or self.now() < self._turn_at
        backoff.check(not_yet=backoff.probing and not_yet)
        first = question.function in READS.values() and not (backoff.proven or safe)
        probe = backoff.probing or (first and not backoff.insisting)
        tries = 1 if once or probe else self._settings.retries + 1
        if not backoff.insisting:
            self._wire.begin(unit)
        answer, reason = self._tried(question, tries)
        if answer is not None and answer.exception is None:
            backoff.mended()
            return answer
        text = f"modbus unit {unit} at {self._where}, {what}: "
        if answer is None:
            self._turn_at = self.now() + TURN_S
            raise backoff.failed(f"{text}{reason}, tried {tries}x")
        assert answer.exception is not None
        raise self._refused(backoff, unit, text, answer.exception)

    def _tried(self, question: UnitRequest, tries: int) -> tuple[UnitReply | None, str]:
        """Return the answer and "". If no answer comes, return None and the reason. Raises HalError if
        there is no connection."""
        reason = ""
        for _ in range(tries):
            began, failed = self.now(), True
            try:
                self._wire.connect()
                answer = self._wire.ask(question)
                failed = answer.exception is not None
            except Unreachable as error:
                raise self._link.failed(str(error)) from error
            except NoReply as error:
                reason = str(error)
            else:
                self._link.mended()
                return answer, ""
            finally:
                self.calls += 1
                self.units.ended(f"unit {question.unit}", self.now() - began, failed=failed)
        return None, reason

    def _refused(self, backoff: Backoff, unit: int, text: str, code: int) -> HalError:
        """Return the error for an exception reply. Codes 1 to 3 cause no backoff, because the unit
        works."""
        self._watchdogs.refused(unit, code)
        text += f"exception {code}, {EXCEPTIONS.get(code, UNDEFINED)}"
        if code not in (1, 2, 3):
            backoff.failed(text)
        return UnitException(text, code)


def _way(settings: ModbusSettings) -> tuple[UnitWire, str]:
    """Return the connection or serial line to the units, and its name for messages. Only this function
    imports the libraries."""
    if settings.serial:
        from drivers.hal.modbus.rtu import SerialLine

        return SerialLine(settings.serial, settings.timeout_s), settings.serial.port
    from drivers.hal.modbus.tcp import Connection

    assert settings.tcp  # `problems` refuses settings with neither tcp nor serial
    host, port = settings.tcp.host, settings.tcp.port
    return Connection(host, port, settings.timeout_s), f"{host}:{port}"

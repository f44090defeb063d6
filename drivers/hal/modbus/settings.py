"""The settings of a Modbus bus in a device YAML (`type: modbus`): the units' address and the times."""

import math
import os
from collections.abc import Iterable, Sequence
from typing import Annotated

import msgspec

from bridges.kinds.shared.fields import DeviceSettings, Name, Period, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from drivers.hal import BusSettings, Needs, UnwatchedOutputs, Where, serial_port
from drivers.hal.hosts import one_spelling
from drivers.hal.modbus.registers import Unit, at
from drivers.hal.modbus.tcp_or_serial import Serial, Tcp
from drivers.hal.modbus.watchdog import Habits, Watchdog

Timeout = Annotated[float, msgspec.Meta(ge=0.05, le=5, extra={"unit": "s"})]


class ModbusSettings(
    BusSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="modbus"
):
    """A Modbus connection. It reaches one module, a gateway with several units, or a serial line with
    several units. The YAML gives either `tcp` or `serial`."""

    tcp: Annotated[Tcp | None, tells("where the module or gateway listens.")] = None
    serial: Annotated[Serial | None, tells("the serial line (Modbus RTU).")] = None
    timeout_s: Annotated[Timeout, tells("how long one try of one request may take.")] = 0.3
    retries: Annotated[
        int, msgspec.Meta(ge=0, le=5), tells("how many more tries a request gets after the first.")
    ] = 1
    scan_s: Annotated[Period, tells("how often every input is read.")] = 0.1
    module_watchdog: Annotated[
        Watchdog | None, tells("the modules' own watchdogs for their outputs.")
    ] = None
    without_watchdog: Annotated[
        dict[Unit, Name],
        tells("""unit -> the reason why this unit needs no watchdog here. Write why its outputs may
        keep their value when the daemon's machine or the network dies. Or write how the unit
        switches them off by itself (`set on its web page: all off after 5 s without a master`)."""),
    ] = msgspec.field(default_factory=dict)

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        if self.tcp is None and self.serial is None:
            yield (), "needs a connection: write tcp: {host: …} or serial: {port: …}"
        elif self.tcp and self.serial:
            yield ("serial",), "a bus has only one of tcp and serial: define a second bus"
        for unit in self.without_watchdog:
            if unit in self.watched():
                yield (
                    ("without_watchdog", str(unit)),
                    f"unit {unit} is in module_watchdog too: delete one of the two",
                )

        yield from self._late_refresh()

    def _late_refresh(self) -> Remarks:
        """Yield a problem for a watchdog that trips although every scan is in time. The daemon
        refreshes it after a scan, and scans at least every second."""
        habits = self.habits()
        if habits and min(self.scan_s, 1.0) + habits.refresh_s >= habits.time_s:
            text = (
                f"after a scan every {self.scan_s:g} s and a refresh every {habits.refresh_s:g} s the"
                f" watchdog's {habits.time_s:g} s are over: lower scan_s"
            )
            yield ("scan_s",), text

    def habits(self) -> Habits | None:
        """Return the registers and times of the modules' watchdogs. Return None without a watchdog, or
        with problems in its settings."""
        watchdog = self.module_watchdog
        return watchdog.chosen() if watchdog and not any(watchdog.problems()) else None

    def watched(self) -> Sequence[int]:
        """Return the units whose own watchdog switches their outputs off."""
        return self.module_watchdog.units if self.module_watchdog else ()


def warnings(settings: ModbusSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake."""
    for path, text in settings.serial.warnings() if settings.serial else ():
        yield ("serial", *path), text
    for path, text in settings.module_watchdog.warnings() if settings.module_watchdog else ():
        yield ("module_watchdog", *path), text


def unwatched(settings: ModbusSettings, places: Iterable[str]) -> UnwatchedOutputs:
    """Report the units that the daemon writes and that have no watchdog. If the daemon's machine fails,
    nothing switches the outputs of these units off."""
    written = {int(place.split()[1]) for place in places}
    bare = sorted(written.difference(settings.watched(), settings.without_watchdog))
    warned = [((), _bare(bare))] if bare else []
    accepted, idle = [], []
    for unit, why in settings.without_watchdog.items():
        path = ("without_watchdog", str(unit))
        if unit in written:
            accepted.append((path, f"unit {unit} has no module_watchdog: {why}"))
        else:
            idle.append((path, f"the daemon writes nothing to unit {unit}: delete this entry"))
    return UnwatchedOutputs([*warned, *idle], accepted)


def paced(
    settings: ModbusSettings, devices: Sequence[DeviceSettings], points: Iterable[str]
) -> Remarks:
    """Yield a warning if one silent unit makes the other units' readings stale, or lets a module's
    watchdog switch off. Yield a warning if a serial line is too slow for its `scan_s`."""
    units = {int(point.split()[1]) for point in points}
    units |= {device.unit for device in devices if hasattr(device, "unit")}
    stale_s = min((s for d in devices if (s := d.stale_after()) is not None), default=math.inf)
    silent_s = settings.timeout_s * (1 + settings.retries)
    if len(units) > 1 and silent_s + settings.scan_s > stale_s:
        yield (
            ("timeout_s",),
            (
                f"one silent unit delays the other units by {silent_s:g} s (timeout_s for each try),"
                f" but readings are stale after {stale_s:g} s: lower timeout_s or retries"
            ),
        )
    habits = settings.habits()
    if len(units) > 1 and habits:
        unseen_s = silent_s + settings.scan_s + habits.refresh_s
        if unseen_s >= habits.time_s:
            yield (
                ("timeout_s",),
                f"beside one silent unit a watchdog gets no refresh for {unseen_s:g} s, and after"
                f" {habits.time_s:g} s it switches its outputs off: lower timeout_s or retries",
            )
    line = settings.serial
    if line and (round_s := len(units) * line.least_s) > settings.scan_s:
        text = f"to read every unit once takes {round_s:.2g} s at {line.baudrate} baud"
        yield ("scan_s",), f"{text}: raise scan_s or the baud rate"


def claims(settings: ModbusSettings) -> Iterable[tuple[str, tuple[str, ...]]]:
    """Yield each place that the bus writes for the modules' watchdogs, with its path in the YAML. If a
    second daemon refreshed a watchdog, the module would not notice the death of the first daemon."""
    habits, watchdog = settings.habits(), settings.module_watchdog
    if habits and watchdog:
        path = ("module_watchdog", "habits" if watchdog.habits else "profile")
        writes = (*habits.arm, habits.refresh, *habits.rearm)
        for unit in watchdog.units:
            yield from ((text, path) for text in {str(at(unit, one.at)): None for one in writes})


def tables(settings: ModbusSettings) -> Iterable[Table]:
    """Yield a table of the registers that the bus writes and reads for the modules' watchdogs."""
    if settings.module_watchdog:
        units = ", ".join(map(str, settings.module_watchdog.units))
        yield Table(
            f"watchdog of unit {units}",
            ("when", "place", "value"),
            tuple(settings.module_watchdog.rows()),
        )


def _bare(units: Sequence[int]) -> str:
    which, keep = f"unit {units[0]}", "keeps its outputs"
    if len(units) > 1:
        which, keep = f"units {', '.join(map(str, units))}", "keep their outputs"
    return (
        f"{which} {keep} when this machine or the cable dies: arm the watchdog of the"
        " module (module_watchdog), or write why that is safe (without_watchdog)"
    )


def unreachable(settings: ModbusSettings, point: str) -> str | None:
    """Return an error for a unit outside 1 to 247 on a serial line (Modbus over Serial Line 2.2).
    Return None for any other unit."""
    unit = int(point.split()[1])
    if settings.serial is None or 1 <= unit <= 247:
        return None
    why = "addresses all units at once, so no unit answers" if unit == 0 else "is for Modbus TCP"
    return f"unit {unit} {why}: units on a serial line are 1 to 247"


def where(settings: ModbusSettings) -> Where:
    """Return the address of the gateway or module, or the port of the line. Only one daemon can open a
    port."""
    if settings.serial:
        return Where(os.path.normpath(settings.serial.port), local=True, clients="one")
    assert settings.tcp  # `problems` has reported a missing address
    host = one_spelling(settings.tcp.host)
    return Where(f"{host}:{settings.tcp.port}", local=False, clients=None)


def needs(settings: ModbusSettings) -> Needs:
    """Return the permission to use the line's port, or to reach the module's address."""
    if settings.serial:
        return serial_port.needs(settings.serial.port)
    assert settings.tcp  # `problems` has reported a missing address
    return Needs(host=settings.tcp.host)

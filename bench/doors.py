"""Eight doors on one 19200-baud line: a whole poll cycle against what the wire alone must take.

The wire: every character of the requests and replies, and the 3.5 characters of silence before each
frame. Real drivers and the real bus poll simulated units, whose line delays each byte by its time.
"""

import statistics
import tempfile
import time
from pathlib import Path
from typing import Any, Final, cast

from bridges.settings.load import Config, load
from drivers.door.dry_contact import create
from drivers.hal.modbus import ModbusBus
from hal_fakes.simulate import Simulation

DOORS: Final = 8
CYCLES: Final = 60
WARM_UP: Final = 3
REQUEST: Final = 8
REPLY: Final = 6
"""Characters of a request for bits, and of a reply with up to eight of them, with unit and CRC."""
READINGS: Final = 2
"""Of each door: its coil and its inputs."""

LINE: Final = """\
kind: door
driver: dry_contact
buses:
  line:
    type: modbus
    serial: {port: /dev/serial/by-id/simulated, baudrate: 19200, parity: none, stopbits: 1}
doors:
"""
DOOR: Final = """\
  door_{unit}:
    inputs:
      opened: {{point: "unit {unit} discrete input 0", active: high}}
      closed: {{point: "unit {unit} discrete input 1", active: high}}
    outputs:
      hold_open: {{point: "unit {unit} coil 0", active: high}}
"""


def measure(scratch: Path) -> dict[str, float]:
    """Milliseconds of a poll cycle, p50 and p99, and of the wire alone."""
    file = scratch / "eight_doors.yaml"
    file.write_text(LINE + "".join(DOOR.format(unit=unit) for unit in range(1, DOORS + 1)))
    config = load(file)
    wire_s = _wire_s(config)
    cycles = _cycles(config, scratch)
    cuts = statistics.quantiles(cycles, n=100, method="inclusive")
    return {
        "wire_ms": wire_s * 1e3,
        "p50_ms": cuts[49] * 1e3,
        "p99_ms": cuts[98] * 1e3,
        "p50_ratio": cuts[49] / wire_s,
        "p99_ratio": cuts[98] / wire_s,
        "cycles": len(cycles),
    }


def show(figures: dict[str, Any]) -> None:
    """The table."""
    print(
        f"\n{'8 doors, 19200 baud':28}{'wire ms':>9}{'p50 ms':>9}{'p50 ratio':>11}{'p99 ratio':>11}"
    )
    times = f"{figures['wire_ms']:>9.1f}{figures['p50_ms']:>9.1f}"
    ratios = f"{figures['p50_ratio']:>10.2f}x{figures['p99_ratio']:>10.2f}x"
    print(f"{'poll cycle':28}{times}{ratios}")


def _wire_s(config: Config) -> float:
    serial = config.buses["line"].serial
    exchange_s = (REQUEST + REPLY) * serial.character_s + 2 * serial.gap_s
    return float(DOORS * READINGS * exchange_s)


def _cycles(config: Config, scratch: Path) -> list[float]:
    """Seconds of each poll of all doors."""
    simulation = Simulation(config, scratch)
    bus = cast(ModbusBus, simulation.open_bus("line"))
    doors = [create(name, settings, bus) for name, settings in config.devices.items()]
    times = []
    for door in doors:
        door.open()
    for _ in range(WARM_UP + CYCLES):
        begun_at = time.monotonic()
        for door in doors:
            door.read()
        times.append(time.monotonic() - begun_at)
    for door in doors:
        door.close()
    bus.close()
    simulation.close()
    return times[WARM_UP:]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="rmf-bench-") as directory:
        show(measure(Path(directory)))

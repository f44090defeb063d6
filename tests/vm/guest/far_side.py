"""Simulate the equipment to which a device's YAML connects the daemon: `python3 -m
tests.vm.guest.far_side FILE`.

The program runs in the package's own Python. It connects the simulated devices (plants) of `hal_fakes/`
to real wires: lines of gpio-sim, a pseudo-terminal, or an interface of SocketCAN. The simulated devices
keep running when the daemon dies.
"""

import os
import socket
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from bridges.settings.load import Config, load
from drivers.hal.can import CanSettings as CanSettings
from drivers.hal.modbus import ModbusSettings as ModbusSettings
from hal_fakes.can.side import CanFarSide, VirtualBus, slow_s
from hal_fakes.control import Control
from hal_fakes.fake import plants_on, stations_on
from hal_fakes.modbus.rtu import RtuLine
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.vm.guest import header

LOOK_S = 0.05


def main() -> int:
    """Serve until killed. The socket /run/far-<name> takes commands (`hal_fakes/control.py`)."""
    config = load(Path(sys.argv[1]))
    (bus,) = config.buses
    world = RealTime(plants_on(config, bus))
    stations = stations_on(config, bus, world.plants)
    threading.excepthook = lambda failed: os._exit(
        1
    )  # an interface has gone down: exit, and systemd starts this program again
    Control(Path(f"/run/far-{config.path.stem}"), world.plants)
    _serve(config, bus, stations)
    return 0


def _serve(config: Config, bus: str, stations: Sequence[object]) -> None:
    settings = config.buses[bus]
    if isinstance(settings, CanSettings):
        medium = VirtualBus(str(settings.socketcan), interface="socketcan")
        CanFarSide(medium, stations, slow_s(settings))  # type: ignore[arg-type]
        _ready()
        threading.Event().wait()
    elif isinstance(settings, ModbusSettings):
        assert settings.serial
        line = RtuLine(stations, settings.serial, 2 * settings.timeout_s, "/run")  # type: ignore[arg-type]
        _be_udev(line.adapter.path, Path(settings.serial.port))
    else:
        _stand_at_header([s for s in stations if isinstance(s, PlantWiring)])


def _be_udev(adapter: Path, port: Path) -> None:
    """Do udev's work whenever somebody plugs the adapter in. Give the adapter a lasting name, and give
    the daemon access."""
    adapter.parent.chmod(0o755)
    port.parent.mkdir(parents=True, exist_ok=True)
    port.unlink(missing_ok=True)
    port.symlink_to(adapter)
    port.chmod(0o666)
    _ready()
    while True:
        with suppress(FileNotFoundError):
            port.chmod(0o666)
        time.sleep(LOOK_S)


def _stand_at_header(wirings: Sequence[PlantWiring]) -> None:
    """Read the outputs and set the inputs in a loop. An input must be set again after a process has
    requested its line.

    On gpio-sim, requesting an input with a pull resistor sets the input to the resistor's level. On a
    Raspberry Pi the level of the wire would be stronger.
    """
    driven: dict[str, bool] = {}
    _ready()
    while True:
        now = time.monotonic()
        for wiring in wirings:
            for point in wiring.outputs:
                level = header.level(_number(point))
                if driven.get(point) != level:
                    driven[point] = level
                    wiring.drive(point, level, now)
            for point, level in wiring.levels(now).items():
                header.pull(_number(point), level)
        time.sleep(LOOK_S)


def _number(point: str) -> int:
    return int(point.removeprefix("BCM"))


def _ready() -> None:
    """Tell systemd that this unit (Type=notify) is ready."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as told:
        told.sendto(b"READY=1", os.environ["NOTIFY_SOCKET"])


if __name__ == "__main__":
    sys.exit(main())

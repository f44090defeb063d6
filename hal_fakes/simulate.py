"""The hardware of `rmf-bridge run FILE --simulate`. Each device has a plant, its simulated physics,
behind its bus.

The far side of a bus is the simulated hardware behind the bus. If possible, a far side is a child
process on 127.0.0.1 (`hal_fakes/__main__.py`), and the real bus connects to this child process. GPIO
pins cannot leave a process, so their fake is in the daemon's process. If a device has inputs on another
bus, its plant is behind both buses. In this case all far sides are in the daemon's process.

Each bus has a control socket in the runtime directory. The socket is `plant.sock`, or
`plant-<bus>.sock` if the file has several buses.
"""

import contextlib
import importlib.util
import logging
import selectors
import subprocess
import sys
from pathlib import Path
from typing import Literal

import msgspec

from bridges.settings.load import Config
from drivers.hal import Bus, HalError
from hal_fakes.control import Control
from hal_fakes.fake import Inside, far_side, plants_on, stations_on
from hal_fakes.realtime import RealTime

LogFormat = Literal["text", "json"]
READY_S = 15.0
"""The time limit (s) for a child's start. A busy Raspberry Pi imports slowly."""
STAND_IN = "STAND-IN: rmf_adapter is not installed: no RMF directs these robots, and they patrol"
PATIENCE_S = 1.5
"""The least time (s) for which a simulated bus waits for an answer. The far side shares this machine,
which may be busy. A longer time is not possible, because a call may take only half of the shortest
WatchdogSec (bridges/runtime/drop_in.py)."""


class Simulation:
    """The far sides of a file's buses. Far sides in separate processes start at the same time as the
    daemon.

    Make a Simulation before the daemon changes its directory. Otherwise the file's relative paths would
    be wrong.
    """

    def __init__(
        self, config: Config, runtime_dir: Path, *, log_format: LogFormat | None = None
    ) -> None:
        """Start the far sides. `log_format` is the format in which a child logs the orders `press`.
        None means no log."""
        self._log = ["--log-format", log_format] if log_format else []
        self._config = config
        self._file = str(Path(config.path).resolve())
        self._runtime_dir = runtime_dir.resolve()
        self._open = contextlib.ExitStack()
        self._shared = (
            self._world(*config.buses) if any(map(config.other_buses, config.devices)) else None
        )
        self._children = {
            name: self._start(name) for name in config.buses if self._has_process(name)
        }

    def open_bus(self, name: str) -> Bus:
        """Open a real bus in front of its fake. Raises HalError.

        Only one thread at a time may open a bus.
        """
        if self._has_process(name):
            return self._config.bus_type(name).open_bus(self._pointed_at_child(name))
        return self._inside(name)

    def rmf_adapter(self) -> object | None:
        """Return the stand-in of RMF's fleet adapter, for a fleet on a machine without the real one."""
        if self._config.kind != "fleet" or importlib.util.find_spec("rmf_adapter"):
            return None
        from hal_fakes.rmf.adapter import StandIn

        logging.getLogger(__name__).warning(STAND_IN)
        return StandIn()

    def close(self) -> None:
        """End every fake. Close the buses first. The caller may call `close` twice."""
        self._open.close()

    def socket_path(self, name: str) -> Path:
        """Return the path of the control socket to this bus's plants."""
        several = len(self._config.buses) > 1
        return self._runtime_dir / (f"plant-{name}.sock" if several else "plant.sock")

    def _has_process(self, name: str) -> bool:
        """Does the bus's fake run in a process of its own? The answer needs no import of the fake or
        its libraries."""
        bus_type = self._config.bus_type(name)
        return bool(bus_type.fake) and not bus_type.fake_inside and self._shared is None

    def _world(self, *buses: str) -> RealTime:
        """Start the plants of the devices on these buses in this process."""
        plants = [one for bus in buses for one in plants_on(self._config, bus).items()]
        world = RealTime(dict(plants))
        self._open.callback(world.close)
        return world

    def _inside(self, name: str) -> Bus:
        far = far_side(self._config, name)
        world = self._shared or self._world(name)
        plants = {device: world.plants[device] for device in self._config.devices_on(name)}
        self._open.callback(Control(self.socket_path(name), plants).close)
        stations = stations_on(self._config, name, world.plants)
        if isinstance(far, Inside):
            return far.open_bus(self._config.buses[name], stations, world)
        server = far.serve(self._config.buses[name], stations)
        self._open.callback(server.close)
        return self._config.bus_type(name).open_bus(self._pointed(name, server.replace))

    def _start(self, name: str) -> "subprocess.Popen[bytes]":
        socket = self.socket_path(name)
        child = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "hal_fakes",
                self._file,
                name,
                "--socket",
                str(socket),
                *self._log,
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C in a terminal must reach only the daemon
        )
        self._open.callback(_end, child)
        return child

    def _pointed_at_child(self, name: str) -> msgspec.Struct:
        child = self._children.pop(name) if name in self._children else self._start(name)
        return self._pointed(name, _first_line(child, name))

    def _pointed(self, name: str, replace: dict[str, object]) -> msgspec.Struct:
        settings: msgspec.Struct = self._config.buses[name]
        found = {**msgspec.to_builtins(settings), **replace}
        if "timeout_s" in found:
            found["timeout_s"] = max(found["timeout_s"], PATIENCE_S)
        return msgspec.convert(found, type(settings))


def _first_line(child: "subprocess.Popen[bytes]", bus_name: str) -> dict[str, object]:
    assert child.stdout is not None
    with selectors.DefaultSelector() as ready:
        ready.register(child.stdout, selectors.EVENT_READ)
        line = child.stdout.readline() if ready.select(READY_S) else b""
    if not line:
        raise HalError(
            f"the simulated far side of bus {bus_name} did not start; its log has the reason"
        )
    return msgspec.json.decode(line, type=dict[str, object])


def _end(child: "subprocess.Popen[bytes]") -> None:
    """End a child by closing its standard input. Kill the child if it does not end."""
    assert child.stdin is not None
    assert child.stdout is not None
    with contextlib.suppress(OSError):
        child.stdin.close()
    try:
        child.wait(5.0)
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()
    child.stdout.close()

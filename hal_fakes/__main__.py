"""`python -m hal_fakes FILE BUS --socket PATH`: the far side of one bus, in a process of its own.

For buses that a process can stand on (Modbus, HTTP). The convention between this file and
`hal_fakes/<bus type>.py`:

    serve(settings, plants: Mapping[str, Plant], config, bus_name) -> Server

starts a real server on 127.0.0.1 (a free port) and returns at once. The plants may be called from
any thread; somebody else keeps their time and their control socket. `server.replace` is what must
stand in the bus's settings instead (`{"tcp": {"host": "127.0.0.1", "port": 41234}}`); it is printed
as one line of JSON when all is ready. `server.close()` ends it.

The process ends when its standard input does, so that nothing is left behind however the daemon
died. It ignores SIGINT: Ctrl-C in a terminal reaches both, and the daemon has to finish first.
"""

import argparse
import json
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from bridges.settings.load import SettingsError, load
from drivers import DriverError
from hal_fakes.control import Control
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import plants_on


class Server(Protocol):
    """What `serve` returns."""

    replace: dict[str, Any]

    def close(self) -> None:
        """Stop serving. Does not raise."""


def main(argv: Sequence[str] | None = None) -> int:
    """Serve until standard input ends."""
    parser = argparse.ArgumentParser(prog="python -m hal_fakes")
    parser.add_argument("file", type=Path)
    parser.add_argument("bus")
    parser.add_argument("--socket", type=Path, required=True)
    arguments = parser.parse_args(argv)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        _serve(arguments.file, arguments.bus, arguments.socket)
    except (SettingsError, DriverError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


def _serve(path: Path, bus_name: str, socket: Path) -> None:
    config = load(path)
    settings = config.buses[bus_name]
    fake = import_module(f"hal_fakes.{config.bus_types[bus_name]}")
    world = RealTime(plants_on(config, bus_name))
    control = Control(socket, world.plants)
    server: Server = fake.serve(settings, world.plants, config, bus_name)
    sys.stdout.write(json.dumps(server.replace) + "\n")
    sys.stdout.flush()
    sys.stdin.buffer.read()
    server.close()
    control.close()
    world.close()


if __name__ == "__main__":
    sys.exit(main())

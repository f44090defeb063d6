"""Serves the far side of one bus in a separate process: `python -m hal_fakes FILE BUS --socket PATH`.

The far side of a bus is the simulated hardware behind the bus. This program serves the buses whose fake
is an `Outside` (`hal_fakes/fake.py`). When the far side is ready, the process prints one line of JSON.
The line has the settings with which the real bus finds the far side, such as its port.

The process ends when its standard input ends, so nothing is left behind even if the daemon is killed.
The process ignores SIGINT. Otherwise Ctrl-C in a terminal would end the far side before the daemon has
finished.
"""

import argparse
import atexit
import gc
import json
import logging
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from bridges.settings.load import SettingsError, load
from bridges.system import log
from drivers import DriverError
from hal_fakes.control import Control
from hal_fakes.fake import Outside, far_side, plants_on, stations_on
from hal_fakes.realtime import RealTime


def main(argv: Sequence[str] | None = None) -> int:
    """Serve until standard input ends."""
    atexit.register(gc.freeze)  # saves CPU time at exit, as in bridges/cli.py
    parser = argparse.ArgumentParser(prog="python -m hal_fakes")
    parser.add_argument("file", type=Path)
    parser.add_argument("bus")
    parser.add_argument("--socket", type=Path, required=True)
    parser.add_argument(
        "--log-format", choices=("text", "json"), help="log pressed buttons to standard error"
    )
    arguments = parser.parse_args(argv)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if arguments.log_format:
        log.start("WARNING", json=arguments.log_format == "json")
        logging.getLogger("hal_fakes").setLevel(logging.INFO)
    try:
        with served(arguments.file, arguments.bus, arguments.socket) as replace:
            sys.stdout.write(json.dumps(replace) + "\n")
            sys.stdout.flush()
            sys.stdin.buffer.read()
    except (SettingsError, DriverError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


@contextmanager
def served(path: Path, bus_name: str, socket: Path) -> Iterator[dict[str, object]]:
    """Serve the far side of this bus until the end of the block. Yield the settings with which the real
    bus finds the far side.

    Raises SettingsError or DriverError.
    """
    config = load(path)
    far = far_side(config, bus_name)
    assert isinstance(far, Outside)
    with (
        closing(RealTime(plants_on(config, bus_name))) as world,
        closing(Control(socket, world.plants)),
    ):
        stations = stations_on(config, bus_name, world.plants)
        with closing(far.serve(config.buses[bus_name], stations)) as server:
            yield server.replace


if __name__ == "__main__":
    sys.exit(main())

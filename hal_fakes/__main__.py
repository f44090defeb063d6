"""`python -m hal_fakes FILE BUS --socket PATH`: the far side of one bus, in a process of its own.

For buses whose fake is `Outside` (`hal_fakes/fake.py`). What must stand in the bus's settings instead
is printed as one line of JSON when all is ready.

The process ends when its standard input does, so that nothing is left behind however the daemon
died. It ignores SIGINT: Ctrl-C in a terminal reaches both, and the daemon has to finish first.
"""

import argparse
import atexit
import gc
import json
import logging
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from bridges import log
from bridges.settings.load import SettingsError, load
from drivers import DriverError
from hal_fakes.control import Control
from hal_fakes.fake import Outside, far_side, plants_on, stations_on
from hal_fakes.realtime import RealTime


def main(argv: Sequence[str] | None = None) -> int:
    """Serve until standard input ends."""
    atexit.register(gc.freeze)  # as in bridges/cli.py
    parser = argparse.ArgumentParser(prog="python -m hal_fakes")
    parser.add_argument("file", type=Path)
    parser.add_argument("bus")
    parser.add_argument("--socket", type=Path, required=True)
    parser.add_argument(
        "--log-format", choices=("text", "json"), help="say what is pressed, on standard error"
    )
    arguments = parser.parse_args(argv)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if arguments.log_format:
        log.start("WARNING", json=arguments.log_format == "json")
        logging.getLogger("hal_fakes").setLevel(logging.INFO)
    try:
        _serve(arguments.file, arguments.bus, arguments.socket)
    except (SettingsError, DriverError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


def _serve(path: Path, bus_name: str, socket: Path) -> None:
    config = load(path)
    far = far_side(config, bus_name)
    assert isinstance(far, Outside)
    world = RealTime(plants_on(config, bus_name))
    control = Control(socket, world.plants)
    server = far.serve(config.buses[bus_name], stations_on(config, bus_name, world.plants))
    sys.stdout.write(json.dumps(server.replace) + "\n")
    sys.stdout.flush()
    sys.stdin.buffer.read()
    server.close()
    control.close()
    world.close()


if __name__ == "__main__":
    sys.exit(main())

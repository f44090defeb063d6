"""`rmf-bridge outputs-off FILE`: every output off, from a fresh process, after any death of the daemon.

systemd runs it as ExecStopPost. What the dead daemon wrote down before it claimed anything comes
before the YAML, which may have been edited since.
"""

import argparse
import logging
from pathlib import Path

from bridges import log
from bridges.serve import directory as runtime
from bridges.serve.daemon import outputs_off
from bridges.settings.load import SettingsError, load

TIMEOUT_S = 5.0
EX_UNAVAILABLE, EX_CONFIG = 69, 78


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `outputs-off`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML")
    parser.add_argument("--runtime-dir", metavar="DIR", help="the dead daemon's runtime directory")


def run(args: argparse.Namespace) -> int:
    """0 when every output is verified off, 1 when not, 69 while the daemon lives."""
    log.start()
    file = args.file.absolute()
    try:
        held = runtime.RuntimeDirectory(runtime.directory(file, args.runtime_dir))
    except runtime.AlreadyRunning as error:
        logging.error("%s: stop it instead, it switches its outputs off", error)
        return EX_UNAVAILABLE
    try:
        return _off(held, file)
    finally:
        held.close()


def _off(held: runtime.RuntimeDirectory, file: Path) -> int:
    try:
        config = load(held.claimed() or file)
    except SettingsError as error:
        for problem in error.problems:
            logging.error(str(problem))
        return EX_CONFIG
    if not outputs_off(config, TIMEOUT_S):
        logging.error(
            "outputs not verified off: cut the relays' supply before working on the device"
        )
        return 1
    held.released()
    return 0

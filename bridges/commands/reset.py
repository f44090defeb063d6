"""`rmf-bridge reset FILE`: an operator says that latched faults may clear if their cause is gone."""

import argparse
import os
import signal
import sys
from pathlib import Path

from bridges.serve import directory as runtime


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `reset`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML of the daemon")
    parser.add_argument("--runtime-dir", metavar="DIR", help="the daemon's runtime directory")


def run(args: argparse.Namespace) -> int:
    """0 when the daemon was told, 1 when none is running."""
    directory = runtime.directory(args.file, args.runtime_dir)
    pid = runtime.running_pid(directory)
    if pid is None:
        print(f"no daemon is running for {args.file} (looked in {directory})", file=sys.stderr)
        return 1
    os.kill(pid, signal.SIGUSR1)
    print(f"reset sent; see {directory / runtime.STATUS} or the log for what remains")
    return 0

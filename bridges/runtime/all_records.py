"""`outputs-off --all-records` switches off all outputs that the services' records name.

The command runs at boot, after a power cut and before the daemons start. One process loads the program,
and then forks a child for each service. So a wire that hangs delays no other service, and each record
uses its own profiles.

This machine's pins come first, because they depend on no other device. The command has a time limit,
because every daemon waits for the command. Each daemon switches off the remaining outputs when it
starts.
"""

import argparse
import logging
import os
import re
import signal
import time
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from bridges.runtime import dead_daemon
from bridges.runtime.record import PATTERN, read
from bridges.system import log
from bridges.system.directories import SERVICE_STATE
from bridges.system.log import pairs
from bridges.yaml.problems import SettingsError
from drivers.profiles import texts

OWN_S, OTHERS_S = 4.0, 2.0
"""The time limits (s) for this machine's own pins and for all other outputs. Every daemon waits during
these times."""
LOOK_EVERY_S = 0.01
OWN_PINS = re.compile(rb"\btype: *[\"']?gpio\b")
"""A pattern that finds a YAML whose outputs are this machine's pins. The pattern decides only which
outputs come first."""


def switch_off_all(
    state: Path = SERVICE_STATE, own_s: float = OWN_S, others_s: float = OTHERS_S
) -> int:
    """Return 0 if every output in the records is verified off, else 1."""
    log.start()
    own, others = list[Path](), list[Path]()
    for path in sorted(state.glob(f"*/{PATTERN}")):
        if record := read(path):
            file = Path(record.file)
            with suppress(SettingsError):  # the service's child logs the error
                record.config()  # imports the modules once, for all children
            (own if OWN_PINS.search(record.yaml) else others).append(file)
    texts.give({})
    left = _off(own, own_s) | _off(set(others) - set(own), others_s)
    for file in sorted(left):
        logging.warning(pairs("left_to_its_daemon", file=file))
    return 1 if left else 0


def _off(files: Collection[Path], within_s: float) -> set[Path]:
    """Switch these services' outputs off in parallel. Return the files with outputs that are not
    verified off."""
    give_up_at = time.monotonic() + within_s
    running = {_forked(file): file for file in dict.fromkeys(files)}
    left = set(running.values())
    while running and time.monotonic() < give_up_at:
        pid, ended = os.waitpid(-1, os.WNOHANG)
        if pid == 0:
            time.sleep(LOOK_EVERY_S)
        elif (file := running.pop(pid)) and ended == 0:
            left.discard(file)
    for pid in running:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
    return left


def _forked(file: Path) -> int:
    """Start a child process that switches off a service's outputs, and return the child's pid. The
    child exits with 0 on success."""
    if pid := os.fork():
        return pid
    code = 1
    try:
        code = dead_daemon.switch_off(argparse.Namespace(file=file, runtime_dir=None, record=[]))
    finally:
        os._exit(code)

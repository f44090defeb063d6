"""`outputs-off --all-records` switches off all outputs that are named in the services' records
(`record.py`).

The command runs at boot, after a power cut and before the daemons start. It begins as root, and then
forks a child for each service. Each child becomes the service's user before it reads the service's
files. So a bus that hangs delays no other service. And a service's files can do no more harm than the
service's user could.

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
from bridges.system.directories import (
    SERVICE_FILES,
    SERVICE_RUN,
    SERVICE_STATE,
    Directories,
    act_as_owner,
)
from bridges.system.log import pairs
from bridges.yaml.problems import SettingsError
from drivers.profiles import texts

OWN_S, OTHERS_S = 4.0, 2.0
"""The time limit (s) for this machine's own pins, and the time limit (s) for all other outputs. Every
daemon waits during both times."""
LOOK_EVERY_S = 0.01
OWN_PINS = re.compile(rb"\btype: *[\"']?gpio\b")
"""A pattern that finds a YAML whose outputs are this machine's pins. The pattern decides only which
outputs come first."""


def switch_off_all(
    state: Path = SERVICE_STATE,
    run: Path = SERVICE_RUN,
    files: Path = SERVICE_FILES,
    own_s: float = OWN_S,
    others_s: float = OTHERS_S,
) -> int:
    """Return 0 if every output in the records is verified off, else 1. `files`: the services' YAMLs."""
    log.start(unhurried=True)
    own, others = list[Directories](), list[Directories]()
    for folder in sorted({path.parent for path in state.glob(f"*/{PATTERN}")}):
        yaml = _loaded(files / f"{folder.name}.yaml")
        (own if OWN_PINS.search(yaml) else others).append(Directories(run / folder.name, folder))
    texts.give({})
    left = _off(own, own_s) | _off(others, others_s)
    for name in sorted(left):
        logging.warning(pairs("left_to_its_daemon", service=name))
    return 1 if left else 0


def _loaded(file: Path) -> bytes:
    """Return a YAML's text, and import the modules that it needs. Each child inherits these modules."""
    from bridges.settings.load import understood

    with suppress(OSError, SettingsError):  # the child that uses the record logs its errors
        yaml = file.read_bytes()
        understood(file, yaml)
        return yaml
    return b""


def _off(services: Collection[Directories], within_s: float) -> set[str]:
    """Switch these services' outputs off in parallel. Return the names of those services whose outputs
    are not verified off."""
    give_up_at = time.monotonic() + within_s
    running = {_forked(places): places.state.name for places in services}
    left = set(running.values())
    while running and time.monotonic() < give_up_at:
        pid, ended = os.waitpid(-1, os.WNOHANG)
        if pid == 0:
            time.sleep(LOOK_EVERY_S)
        elif (name := running.pop(pid, None)) and ended == 0:  # None: an earlier group's child
            left.discard(name)
    for pid in running:
        try:
            os.kill(pid, signal.SIGKILL)
        except PermissionError:  # let the other services go on; the child gives up by itself
            logging.warning(pairs("not_killed", service=running[pid]))
        else:
            os.waitpid(pid, 0)
    return left


def _forked(places: Directories) -> int:
    """Switch a service's outputs off in a child process, which exits with 0 on success. Return the
    child's pid."""
    if pid := os.fork():
        return pid
    code = 1
    try:
        code = _switched_off(places)
    except BaseException:
        logging.exception(pairs("outputs_off_failed", service=places.state.name))
    finally:
        logging.shutdown()  # writes the last lines
        os._exit(code)


def _switched_off(places: Directories) -> int:
    """Become the service's user, and switch off the outputs in the service's records."""
    _make_runtime(places)
    act_as_owner(places)
    os.environ |= {"RUNTIME_DIRECTORY": str(places.runtime), "STATE_DIRECTORY": str(places.state)}
    files = [record.file for record in map(read, places.state.glob(PATTERN)) if record]
    if not files:
        return 1
    told = argparse.Namespace(file=Path(min(files)), runtime_dir=None, record=[])
    return dead_daemon.switch_off(told)  # uses the records of the other files too


def _make_runtime(places: Directories) -> None:
    """Make the directory for the lock, as systemd makes it for the service that starts later."""
    owner = places.state.stat()
    with suppress(FileExistsError):
        places.runtime.mkdir(mode=0o750, parents=True)
        os.chown(places.runtime, owner.st_uid, owner.st_gid)

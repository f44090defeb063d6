"""A person's order to a running daemon: a reset, or a decision about a workcell's requests.

A signal delivers the order. A decision is also a file in the runtime directory, which is written before
the signal is sent. The file names the daemon's process, so that no later daemon obeys it.
"""

import logging
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from bridges.kinds.shared.decision import DecidedByPerson
from bridges.runtime import holder
from bridges.runtime.runtime_directory import find
from bridges.runtime.signals import RESET
from bridges.system import files
from bridges.system.directories import Directories, act_as_owner, opened
from bridges.system.log import pairs

log = logging.getLogger(__name__)

ORDER: Final = "order.json"
LONGEST: Final = 65536


class PersonsOrder(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A person's decision, and the daemon that must obey. `device`: a device's name, or "" for every
    device."""

    verdict: DecidedByPerson
    device: str
    pid: int
    started: int


def places_of(file: Path, given: str | None) -> Directories | None:
    """Return the directories of this file's daemon, and act as their owner from now on. If the file
    does not exist, print this and return None. Raises PermissionError."""
    if not given and not file.exists():
        print(f"{file} does not exist", file=sys.stderr)
        return None
    places = find(file.absolute(), given)
    act_as_owner(places)
    return places


def send(file: Path, places: Directories, verdict: DecidedByPerson | None, device: str = "") -> int:
    """Send an order to the daemon of this file, and return the exit code. `verdict`: the decision, or
    None for a reset.

    Raises PermissionError if this user may not see or signal the daemon.
    """
    found = holder.look(places)
    if found is None or not found.serves or not found.started:  # another process may have this pid
        why = (
            f"{found}, which is not a daemon of this version"
            if found
            else "no process holds this directory"
        )
        print(f"no daemon serves {file}: {places.runtime}: {why}", file=sys.stderr)
        return 1
    if verdict is not None:
        order = PersonsOrder(verdict, device, found.pid, found.started)
        with opened(places.runtime):
            files.replace(places.runtime / ORDER, msgspec.json.encode(order))
    try:
        os.kill(found.pid, RESET)
    except ProcessLookupError:
        print(f"the daemon of {file} has just ended", file=sys.stderr)
        return 1
    return 0


def take(runtime: Path, file: Path) -> PersonsOrder | None:
    """Return the decision that waits for this process, and remove it. Return None without a decision.
    Raises nothing."""
    path, ours = runtime / ORDER, holder.ourselves(file, serves=True)
    try:
        with opened(runtime):
            order = msgspec.json.decode(files.read(path, LONGEST), type=PersonsOrder)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError) as error:
        log.error(pairs("order_not_read", file=path, reason=error))
        order = None
    with suppress(OSError):
        path.unlink(missing_ok=True)
    if order is None or (order.pid, order.started) != (ours.pid, ours.started):
        return None
    return order

"""A person's order to a running daemon: a reset, a drill, or a decision about a workcell's requests.

Each order is a file of its own in the runtime directory, and a signal tells the daemon to read the
files. A file names the daemon's process, so that a daemon that starts later does not obey the order. A
signal without a readable order does nothing. When every device has decided about the order, the daemon
answers in its status file.
"""

import json
import logging
import os
import secrets
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec

from bridges.kinds.shared.decision import (
    DecidedByPerson,
    DrillOrdered,
    OperatorReset,
    OrderedByPerson,
)
from bridges.runtime import holder
from bridges.runtime.holder import STATUS, STATUS_MAX, LockHolder
from bridges.runtime.runtime_directory import find
from bridges.runtime.signals import RESET
from bridges.system import files
from bridges.system.directories import Directories, act_as_owner, opened, usual_runtimes
from bridges.system.log import pairs

log = logging.getLogger(__name__)

ORDERS: Final = "order-*.json"
"""The files of orders. Their names sort by the time at which the orders were given."""
LONGEST: Final = 65536
ANSWERS_WITHIN_S: Final = 10.0
"""The time (s) for which the command waits for the daemon's answer. It is long enough, because the
daemon writes its status each second. Only a device on a silent bus takes longer, because it reads
the order at its next scan."""
LOOK_EVERY_S: Final = 0.05
REFUSED: Final = 4
"""The exit code of a command whose order was refused."""


class PersonsOrder(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An order, and the daemon that must obey it.

    - `device`: the device that must obey, or "" for every device
    - `id`: the name of the order in the daemon's answer
    - `reset`, `verdict`, `drill_s` (s): a reset, a decision, or the duration of a drill. An order says
      exactly one of these.
    """

    pid: int
    started: int
    id: str
    device: str = ""
    reset: bool = False
    verdict: DecidedByPerson | None = None
    drill_s: float | None = None

    def __post_init__(self) -> None:
        """Raise ValueError unless the order says exactly one thing."""
        if self.reset + (self.verdict is not None) + (self.drill_s is not None) != 1:
            raise ValueError("an order is a reset, a decision or a drill")

    @property
    def event(self) -> OrderedByPerson:
        """The event that tells the devices' cores about the order."""
        if self.drill_s is not None:
            return DrillOrdered(self.drill_s)
        return self.verdict or OperatorReset()


class OrderAnswered(msgspec.Struct):
    """The daemon's answer in its status file. `refused` maps each device that has refused the order to
    the reason."""

    id: str
    refused: dict[str, str]


def places_of(file: Path, given: str | None) -> Directories | None:
    """Return the directories of this file's daemon, and act as their owner from now on. If the file
    does not exist, print this and return None. Raises PermissionError."""
    if not given and not file.exists():
        print(f"{file} does not exist", file=sys.stderr)
        return None
    places = find(file.absolute(), given)
    act_as_owner(places)
    return _where_it_runs(places)


def _where_it_runs(places: Directories) -> Directories:
    """Return these directories with the runtime directory that their daemon uses. A daemon that was
    started without a login, as by cron, uses another one than a login shell would. Both use the same
    state directory, which names the daemon."""
    daemon = holder.look(places)
    if daemon is None or holder.written(places.runtime) == daemon:
        return places
    for runtime in usual_runtimes(os.geteuid(), places.runtime.name):
        with suppress(OSError), opened(runtime, ours=True):
            if holder.written(runtime) == daemon:
                return Directories(runtime, places.state)
    return places


def has_device(file: Path, status: Mapping[str, Any], device: str) -> bool:
    """Return whether the daemon's status has this device, or `device` is "". If it has not, print its
    devices."""
    names = status.get("devices", {})
    if not device or device in names:
        return True
    print(f"{file} has no device '{device}'; it has {', '.join(names)}", file=sys.stderr)
    return False


def give(file: Path, places: Directories, **order: Any) -> int:
    """Give an order to the daemon of this file, and wait for the daemon's answer. `order` has fields of
    `PersonsOrder`.

    If the daemon does not obey, or if the order cannot be written, print the reason. Return the exit
    code. Raises PermissionError if this user may not see or signal the daemon.
    """
    found = holder.look(places)
    if found is None or not found.serves or not found.started:  # another process may have this pid
        why = (
            f"held by {found}, which is not a daemon of this version"
            if found
            else "no process holds this directory"
        )
        print(f"no daemon serves {file}: {places.runtime}: {why}", file=sys.stderr)
        return 1
    try:
        given = send(found, places, **order)
    except ProcessLookupError:
        print(f"the daemon of {file} has just ended", file=sys.stderr)
        return 1
    except PermissionError:
        raise
    except OSError as error:
        to_do = "if the daemon uses another directory, give it with --runtime-dir"
        why = f"{places.runtime}: {error.strerror or error}; {to_do}"
        print(f"the order to the daemon of {file} cannot be written: {why}", file=sys.stderr)
        return os.EX_UNAVAILABLE
    return _wait(file, places, given)


def send(daemon: LockHolder, places: Directories, **order: Any) -> PersonsOrder:
    """Give an order to this daemon, and do not wait for the answer. Raises ProcessLookupError if the
    daemon has ended, and other OSErrors."""
    given = PersonsOrder(daemon.pid, daemon.started, secrets.token_hex(8), **order)
    name = ORDERS.replace("*", f"{time.monotonic_ns():020}-{given.id}")
    with opened(places.runtime):
        files.replace(places.runtime / name, msgspec.json.encode(given))
    os.kill(daemon.pid, RESET)
    return given


def _wait(file: Path, places: Directories, given: PersonsOrder) -> int:
    until = time.monotonic() + ANSWERS_WITHIN_S
    while time.monotonic() < until:
        answer = (status_of(places) or {}).get("order") or {}
        if answer.get("id") == given.id:
            for name, why in answer["refused"].items():
                print(f"refused: {name + ': ' if name else ''}{why}", file=sys.stderr)
            return REFUSED if answer["refused"] else 0
        time.sleep(LOOK_EVERY_S)
    late = f"within {ANSWERS_WITHIN_S:g} s: see rmf-bridge status {file}"
    print(f"sent, but the daemon of {file} has not answered {late}", file=sys.stderr)
    return os.EX_UNAVAILABLE


def status_of(places: Directories) -> Mapping[str, Any] | None:
    """Return the status of the living daemon. Return None if the daemon has not written a status
    yet."""
    daemon = holder.look(places)
    try:
        with opened(places.runtime):
            status: dict[str, Any] = json.loads(files.read(places.runtime / STATUS, STATUS_MAX))
    except (FileNotFoundError, NotADirectoryError, ValueError):
        return None
    return status if daemon is not None and status.get("pid") == daemon.pid else None


def take(runtime: Path, file: Path) -> list[PersonsOrder]:
    """Return the orders that wait for this process, the oldest first, and remove them. Log and remove
    unreadable orders, and orders to another process. Does not raise."""
    ours, found = holder.ourselves(file, serves=True), list[PersonsOrder]()
    try:
        with opened(runtime):
            for path in sorted(runtime.glob(ORDERS)):
                if order := _taken(path, ours):
                    found.append(order)
    except OSError as error:
        log.error(pairs("order_not_read", file=runtime, reason=error))
    return found


def _taken(path: Path, ours: LockHolder) -> PersonsOrder | None:
    try:
        order = msgspec.json.decode(files.read(path, LONGEST), type=PersonsOrder)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        log.error(pairs("order_not_read", file=path, reason=error))
        order = None
    with suppress(OSError):
        path.unlink(missing_ok=True)
    if order and (order.pid, order.started) != (ours.pid, ours.started):
        log.warning(pairs("order_for_another_process", file=path, pid=order.pid))
        return None
    return order

"""A daemon's files while it runs: its lock, its status and its record.

`lock`          held by the daemon or by `outputs-off`; names the process, its YAML, and whether
                it serves
`status.json`   the state of every device, for people and scripts
`claimed-….json`   see `bridges/serve/record.py`

None of them is vital. A file that cannot be written is logged once and tried again each second, also
after its directory was removed; meanwhile the device is served.
"""

import fcntl
import logging
import os
import time
from contextlib import suppress
from pathlib import Path

import msgspec

from bridges.log import pairs
from bridges.serve.files import replace, show
from bridges.serve.places import (
    SERVICE_RUN,
    SERVICE_STATE,
    Places,
    as_given,
    by_hand,
    everywhere,
    named,
    own,
    owner_of,
    state_base,
)
from bridges.serve.record import Record, Records, paths, read

log = logging.getLogger(__name__)

STATUS = "status.json"
KEPT = "kept.json"
LOCK = "lock"
WAIT_S = 7.0
"""How long a daemon that starts waits for `outputs-off`, which takes less."""
LOOK_EVERY_S = 0.05


class AlreadyRunning(Exception):
    """Another daemon serves this YAML, or uses these directories."""


class Unknown(Exception):
    """This user cannot see whether a daemon runs. The text says what to do."""


class LockHolder(msgspec.Struct, frozen=True):
    """Who holds a lock: its process id, the YAML's path, and whether it serves."""

    pid: int
    file: str
    serves: bool

    def __str__(self) -> str:
        return f"process {self.pid}, for {self.file}" if self.pid else "a running process"


NOBODY_KNOWN = LockHolder(0, "", False)
"""The lock is held, but its holder could not write its name into it."""


def find(file: Path, given: str | None) -> Places:
    """The directories of this file's daemon, by the one rule (`bridges/serve/places.py`).

    Raises Unknown if the service's directory cannot be read.
    """
    told = as_given(given)
    if told:
        return told
    return next((p for p in everywhere(file) if _is_about(p, file)), by_hand(file))


def _is_about(places: Places, file: Path) -> bool:
    found = {_written(folder / LOCK).file for folder in places.folders}
    found |= {record.file for path in paths(places) if (record := read(path))}
    return named(file) in found


def holder(places: Places) -> LockHolder | None:
    """The process that holds the lock now; None if there is none. Raises Unknown.

    The runtime directory's lock names it first: on a read-only root the other one keeps an old name.
    """
    found = [_locked(folder) for folder in reversed(places.folders)]
    return max(filter(None, found), key=lambda each: each.pid != 0, default=None)


def _locked(folder: Path) -> LockHolder | None:
    """Whom the lock of this folder names while it is held. Raises Unknown."""
    try:
        lock = _open(folder / LOCK, os.O_RDONLY)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise Unknown(_what_to_do(folder, error)) from None
    try:
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _written(folder / LOCK)
    finally:
        os.close(lock)
    return None


def _written(path: Path) -> LockHolder:
    """The holder that the lock file names. Raises Unknown."""
    try:
        lock = _open(path, os.O_RDONLY)
    except (FileNotFoundError, NotADirectoryError):
        return NOBODY_KNOWN
    except OSError as error:
        raise Unknown(_what_to_do(path.parent, error)) from None
    try:
        return msgspec.json.decode(os.read(lock, 65536), type=LockHolder)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        return NOBODY_KNOWN
    finally:
        os.close(lock)


def _open(path: Path, flags: int) -> int:
    """Open without following a symbolic link or waiting for a FIFO."""
    return os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o640)


def _what_to_do(folder: Path, error: OSError) -> str:
    owner = owner_of(folder)
    return (
        f"whether a daemon runs there cannot be seen: {folder}: {error.strerror}. It belongs to"
        f" {owner}: use sudo, or give another directory with --runtime-dir"
    )


def _in_use(folder: Path, found: LockHolder) -> str:
    if not found.serves:
        used = "a walk, a kill test or outputs-off" if found.pid else "another program"
        return f"{folder} is in use by {found} ({used}): wait for its end"
    stop = f"Ctrl-C where it runs, or kill {found.pid}"
    if folder.parent in (SERVICE_RUN, SERVICE_STATE):
        stop = f"sudo systemctl stop rmf-bridge@{folder.name}"
    return (
        f"{Path(found.file).name} is already running: {found}; rmf-bridge status shows it."
        f" A device has one daemon. To stop it: {stop}"
    )


def state_file(file: Path) -> Path:
    """The file that outlives a daemon and a reboot: in systemd's state directory, else the user's."""
    given = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    return Path(given or state_base() / file.stem).absolute() / KEPT


class MemoryFile:
    """A file that is replaced as a whole and is on disk when `write` returns.

    `instead`: the path to use while the first cannot be written; a file there is the newer one.
    """

    def __init__(self, path: Path, instead: Path | None = None) -> None:
        self._path = path
        self._instead = instead
        self._once = Once()

    def read(self) -> bytes | None:
        """The file's bytes; None if there is no file. Raises OSError."""
        for path in filter(None, (self._instead, self._path)):
            with suppress(FileNotFoundError, NotADirectoryError):
                return path.read_bytes()
        return None

    def write(self, kept: bytes) -> None:
        """Replace the file. Raises OSError if neither path can be written; the old one then remains."""
        try:
            replace(self._path, kept)
            if self._instead is not None:
                self._instead.unlink(missing_ok=True)
        except OSError as error:
            self._once.failed(str(self._path), error)
            if self._instead is None:
                raise
            replace(self._instead, kept)
        else:
            self._once.works(str(self._path))


class Once:
    """Logs one line when a write fails, and one when it works again; the daemon runs on.

    `fails`, `again`: the two events; `key`: of what is written; `level`: of the first.
    """

    def __init__(
        self,
        fails: str = "not_written",
        again: str = "written_again",
        key: str = "what",
        level: int = logging.WARNING,
    ) -> None:
        self._wrong: dict[str, str] = {}
        self._fails, self._again, self._key, self._level = fails, again, key, level

    def failed(self, what: str, error: Exception) -> None:
        """Note a failed attempt; the caller will try again."""
        if what not in self._wrong:
            log.log(self._level, pairs(self._fails, **{self._key: what}, reason=error))
        self._wrong[what] = str(error)

    def works(self, what: str) -> None:
        """Note a successful attempt."""
        if self._wrong.pop(what, None) is not None:
            log.info(pairs(self._again, **{self._key: what}))


class RuntimeDirectory:
    """One process's lock, status and record.

    `serves`: whether the process is a daemon, to which a reset may be sent.
    """

    def __init__(self, places: Places, file: Path, *, serves: bool, wait_s: float = WAIT_S) -> None:
        """Take the locks; waits for an `outputs-off` that holds them. Raises AlreadyRunning."""
        self.places = places
        self.path = places.runtime
        self.records = Records(places, file)
        self._holder = LockHolder(os.getpid(), named(file), serves)
        self._locks: dict[Path, int] = {}
        self._record: Record | None = None
        self._once = Once()
        deadline = time.monotonic() + wait_s
        for folder in places.folders:
            self._lock_by(folder, deadline)

    def claim(self, record: Record) -> None:
        """Write the record of what this daemon is about to claim; a failure is tried again."""
        self._record = record
        self._write_record()

    def released(self) -> None:
        """Every output is off and released: remove the record."""
        record, self._record = self._record, None
        if record is not None:
            try:
                self.records.release(record)
            except OSError as error:
                self._once.failed("record", error)

    def write_status(self, json: bytes) -> None:
        """Replace the status file; also write again what failed before or was removed."""
        for folder in self.places.folders:
            self._lock(folder)
        self._write_record()
        try:
            show(self.path / STATUS, json)
        except OSError as error:
            self._once.failed(STATUS, error)
        else:
            self._once.works(STATUS)

    def close(self) -> None:
        """Release the locks for another daemon, and remove the status, which is now outdated."""
        with suppress(OSError):
            (self.path / STATUS).unlink(missing_ok=True)
        for lock in self._locks.values():
            os.close(lock)
        self._locks.clear()

    def _lock_by(self, folder: Path, deadline: float) -> None:
        """Take the lock; wait while `outputs-off` holds it."""
        while not self._lock(folder):
            found = holder(self.places) or _written(folder / LOCK)
            if found.serves or time.monotonic() >= deadline:
                self.close()
                raise AlreadyRunning(_in_use(folder, found))
            time.sleep(LOOK_EVERY_S)

    def _lock(self, folder: Path) -> bool:
        """Hold the folder's lock; False while another process holds it."""
        try:
            return self._has(folder) or self._take(folder)
        except OSError as error:
            self._once.failed(f"{folder}/{LOCK}", error)
            return True

    def _has(self, folder: Path) -> bool:
        """Whether the folder's lock file is the one that we hold."""
        lock = self._locks.get(folder)
        try:
            return lock is not None and os.path.samestat(os.fstat(lock), os.lstat(folder / LOCK))
        except (FileNotFoundError, NotADirectoryError):
            return False

    def _take(self, folder: Path) -> bool:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        lock = self._opened(folder / LOCK)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            return False
        if old := self._locks.pop(folder, None):
            os.close(old)
        self._locks[folder] = lock
        self._sign(lock)
        self._once.works(f"{folder}/{LOCK}")
        return True

    def _opened(self, path: Path) -> int:
        """Open for writing, or read-only if that is not permitted: it can still be locked."""
        try:
            return _open(path, os.O_RDWR | os.O_CREAT)
        except OSError:
            return _open(path, os.O_RDONLY)

    def _sign(self, lock: int) -> None:
        """Write our name into the lock; on a full disk an empty file is better than the old name."""
        content = msgspec.json.encode(self._holder)
        with suppress(OSError):
            os.ftruncate(lock, 0)
            os.pwrite(lock, content, 0)

    def _write_record(self) -> None:
        if self._record is None:
            return
        try:
            self.records.write(self._record)
        except OSError as error:
            self._once.failed("record", error)
        else:
            self._once.works("record")


def held(
    file: Path, given: str | None, *, serves: bool, simulated: bool = False
) -> RuntimeDirectory:
    """The directories for this file, locked by us. A simulation never takes a service's.

    Raises AlreadyRunning, Unknown or PermissionError.
    """
    file = file.absolute()
    found = (as_given(given) or by_hand(file)) if simulated else find(file, given)
    own(found)
    return RuntimeDirectory(found, file, serves=serves)

"""The files of a daemon while it runs: its lock, its holder, its status and its record.

- `holder.lock`: the lock. Its holder is the daemon, `outputs-off`, or a walk (a test of the wiring by a
  person). Other users may not open this file, because they could then take the lock and block
  `outputs-off`.
- `holder.json`: names the lock's holder, for other processes (`bridges/runtime/holder.py`)
- `status.json`: the state of every device, for people and scripts
- `claimed-….json`: the record of claimed outputs (`bridges/runtime/record.py`)

The daemon serves even if it cannot write these files. It logs a failed write once and tries again each
second, even after somebody has removed the directory.
"""

import fcntl
import logging
import os
import time
from contextlib import suppress
from pathlib import Path

import msgspec

from bridges.runtime import holder
from bridges.runtime.holder import HOLDER, STATUS, LockHolder
from bridges.runtime.record import ClaimRecord, Records, paths, read
from bridges.system import files
from bridges.system.directories import (
    SERVICE_FILES,
    SERVICE_RUN,
    SERVICE_STATE,
    Directories,
    Distrusted,
    as_given,
    by_hand,
    everywhere,
    named,
    of_service,
    opened,
    state_base,
)
from bridges.system.log import pairs

log = logging.getLogger(__name__)

KEPT = "kept.json"
KEPT_MAX = 64 << 20
LOCK = "holder.lock"
WAIT_S = 7.0
"""The time (s) for which a starting daemon waits for `outputs-off`. `outputs-off` takes less time than
this."""
LOOK_EVERY_S = 0.05


class AlreadyRunning(Exception):
    """The error if another daemon serves this YAML or uses these directories."""


def find(file: Path, given: str | None) -> Directories:
    """Return the directories of this file's daemon, by the rule in `bridges/system/directories.py`.

    Raises PermissionError if the service's directory cannot be read.
    """
    told = as_given(given)
    if told:
        return told
    return next((p for p in everywhere(file) if _is_about(p, file)), by_hand(file))


def _is_about(places: Directories, file: Path) -> bool:
    holders = [holder.shown(places), *map(holder.written, places.folders)]
    found = {one.file for one in holders if one}
    found |= {record.file for path in paths(places) if (record := read(path))}
    return named(file) in found or _is_services(places, file)


def _is_services(places: Directories, file: Path) -> bool:
    """Return whether these are the existing directories of the service whose YAML the file is. The file
    may be a link that led elsewhere when the service started."""
    own = file.parent == SERVICE_FILES and places == of_service(file)
    return own and any(map(os.path.lexists, places.folders))


def in_use(folder: Path, found: LockHolder | None) -> str:
    """Return the error for a directory that another process holds, with a remedy."""
    if found is None:
        return f"{folder / LOCK} is locked by an unnamed program: end that program"
    if not found.serves:
        used = "a walk, a kill test or outputs-off"
        return f"{folder} is in use by {found} ({used}): wait until that process has ended"
    stop = f"Ctrl-C where it runs, or kill {found.pid}"
    if folder.parent in (SERVICE_RUN, SERVICE_STATE):
        stop = f"sudo systemctl stop rmf-bridge@{folder.name}"
    return (
        f"{Path(found.file).name} is already running: {found}; rmf-bridge status shows it."
        f" A device can have only one daemon. To stop this process: {stop}"
    )


def state_file(file: Path) -> Path:
    """Return the path of a file that remains after the daemon's end and after a reboot. The file is in
    systemd's state directory. Without systemd it is in the user's state directory."""
    given = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    return Path(given or state_base() / file.stem).absolute() / KEPT


class MemoryFile:
    """A file that is always replaced as a whole. When `write` returns, the content is on disk.

    `instead`: the path to use if `path` cannot be written. If both files exist, the file at `instead`
    is the newer one.
    """

    def __init__(self, path: Path, instead: Path | None = None) -> None:
        self._path = path
        self._instead = None if instead == path else instead
        self._once = Once()

    def read(self) -> bytes | None:
        """Return the file's bytes. Return None without a file. Raises OSError."""
        for path in filter(None, (self._instead, self._path)):
            with suppress(FileNotFoundError, NotADirectoryError), opened(path.parent):
                return files.read(path, KEPT_MAX)
        return None

    def write(self, kept: bytes) -> None:
        """Replace the file. Raises OSError if no path can be written, and then keeps the old file."""
        try:
            _replace(self._path, kept)
            if self._instead is not None:
                self._instead.unlink(missing_ok=True)
        except OSError as error:
            self._once.failed(str(self._path), error)
            if self._instead is None:
                raise
            _replace(self._instead, kept)
        else:
            self._once.works(str(self._path))


def _replace(path: Path, content: bytes) -> None:
    with opened(path.parent, make=True):
        files.replace(path, content)


class Once:
    """A log filter for an action that is repeated. It logs only the first of successive failures, and
    then the first success.

    - `fails`: the log event for a failure
    - `again`: the log event for the success after it
    - `key`: the log key that names the action
    - `level`: the log level of a failure
    - `wrong`: maps each action that fails now to its error
    """

    def __init__(
        self,
        fails: str = "not_written",
        again: str = "written_again",
        key: str = "what",
        level: int = logging.WARNING,
    ) -> None:
        self.wrong: dict[str, str] = {}
        self._fails, self._again, self._key, self._level = fails, again, key, level

    def failed(self, what: str, error: Exception) -> None:
        """Note a failed attempt. The caller will try again."""
        if what not in self.wrong:
            log.log(self._level, pairs(self._fails, **{self._key: what}, reason=error))
        self.wrong[what] = str(error)

    def works(self, what: str) -> None:
        """Note a successful attempt."""
        if self.wrong.pop(what, None) is not None:
            log.info(pairs(self._again, **{self._key: what}))


class RuntimeDirectory:
    """The lock, the status and the record of one process.

    `serves`: Is the process a daemon, which obeys a person's orders? `process`: this process, as
    `holder.json` names it.
    """

    def __init__(
        self, places: Directories, file: Path, *, serves: bool, wait_s: float = WAIT_S
    ) -> None:
        """Take the locks. If `outputs-off` has the locks, wait for its end.

        Raises AlreadyRunning. Raises PermissionError if a directory cannot be trusted.
        """
        self.places = places
        self.path = places.runtime
        self.records = Records(places)
        self.process = holder.ourselves(file, serves=serves)
        self._locks: dict[Path, int] = {}
        self._record: ClaimRecord | None = None
        self._once = Once()
        deadline = time.monotonic() + wait_s
        for folder in places.folders:
            self._lock_by(folder, deadline)
        self._sign(self.process)

    def claim(self, record: ClaimRecord) -> None:
        """Write the record, before this daemon claims outputs. If writing fails, `write_status` tries
        again."""
        self._record = record
        self._write_record()

    def released(self) -> None:
        """Remove the record, because every output is off and released."""
        record, self._record = self._record, None
        if record is not None:
            try:
                self.records.release(record)
            except OSError as error:
                self._once.failed("record", error)

    def write_status(self, json: bytes) -> None:
        """Replace the status file. Also write the lock, `holder.json` and the record again if they are
        missing."""
        for folder in self.places.folders:
            self._lock(folder)
        self._sign(self.process)
        self._write_record()
        try:
            files.show(self.path / STATUS, json)
        except OSError as error:
            self._once.failed(STATUS, error)
        else:
            self._once.works(STATUS)

    def close(self) -> None:
        """Release the locks for another daemon, and remove the outdated status."""
        with suppress(OSError), opened(self.path):
            (self.path / STATUS).unlink(missing_ok=True)
        self._sign(msgspec.structs.replace(self.process, pid=0))
        self._unlock()

    def _unlock(self) -> None:
        for lock in self._locks.values():
            fcntl.flock(lock, fcntl.LOCK_UN)  # needed, because a child has a copy of `lock`
            os.close(lock)
        self._locks.clear()

    def _lock_by(self, folder: Path, deadline: float) -> None:
        """Take the lock. Wait while `outputs-off` has the lock. A daemon of an older version uses
        another lock, so its fresh status counts as a lock."""
        while holder.shown(self.places) or not self._lock(folder):
            found = holder.look(self.places)
            if (found and found.serves) or time.monotonic() >= deadline:
                self._unlock()
                raise AlreadyRunning(in_use(folder, found))
            time.sleep(LOOK_EVERY_S)

    def _lock(self, folder: Path) -> bool:
        """Take the folder's lock. Return False if another process has the lock. Raises Distrusted.

        If the lock file cannot be written, log this and return True.
        """
        try:
            return self._has(folder) or self._take(folder)
        except Distrusted:
            raise
        except OSError as error:
            self._once.failed(f"{folder}/{LOCK}", error)
            return True

    def _has(self, folder: Path) -> bool:
        """Return whether we have the lock of the lock file that is now in the folder."""
        lock = self._locks.get(folder)
        try:
            return lock is not None and os.path.samestat(os.fstat(lock), os.lstat(folder / LOCK))
        except (FileNotFoundError, NotADirectoryError):
            return False

    def _take(self, folder: Path) -> bool:
        with opened(folder, make=True) as directory:
            lock = _lock_in(directory)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            return False
        if old := self._locks.pop(folder, None):
            os.close(old)
        self._locks[folder] = lock
        self._once.works(f"{folder}/{LOCK}")
        return True

    def _sign(self, name: LockHolder) -> None:
        """Write this holder into `holder.json` beside each lock that we have. Do nothing if it is
        already there."""
        for folder in filter(self._has, self._locks):
            try:
                if holder.written(folder) != name:
                    files.show(folder / HOLDER, msgspec.json.encode(name))
            except OSError as error:
                self._once.failed(f"{folder}/{HOLDER}", error)
            else:
                self._once.works(f"{folder}/{HOLDER}")

    def _write_record(self) -> None:
        if self._record is None:
            return
        try:
            self.records.write(self._record)
        except OSError as error:
            self._once.failed("record", error)
        else:
            self._once.works("record")


def _lock_in(directory: int) -> int:
    """Open the lock file for writing. If this user may not write the file, open it for reading, because
    that is enough for a lock."""
    flags = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    try:
        return os.open(LOCK, flags | os.O_RDWR | os.O_CREAT, 0o600, dir_fd=directory)
    except OSError:
        return os.open(LOCK, flags | os.O_RDONLY, dir_fd=directory)


def held(
    file: Path, given: str | None, *, serves: bool, simulated: bool = False
) -> RuntimeDirectory:
    """Lock the directories for this file, and return them. A simulation never locks the directories of
    a service.

    Raises AlreadyRunning or PermissionError.
    """
    file = file.absolute()
    found = (as_given(given) or by_hand(file)) if simulated else find(file, given)
    return RuntimeDirectory(found, file, serves=serves)

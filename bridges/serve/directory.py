"""The runtime directory of one device: what is claimed, how it is doing, and who is running.

`claimed.yaml`  the device YAML as the running daemon read it, written before the first output is
                claimed, so that `outputs-off` knows them after any death, whatever the YAML says now
`status.json`   the state of every device, for people and scripts
`lock`          held by the running daemon; its process id
"""

import fcntl
import os
from pathlib import Path

CLAIMED = "claimed.yaml"
STATUS = "status.json"
LOCK = "lock"


class AlreadyRunning(Exception):
    """Another daemon holds this runtime directory."""


def directory(file: Path, given: str | None) -> Path:
    """Where it is: as given, else as systemd says, else under the user's runtime directory."""
    if given or (given := os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]):
        return Path(given).absolute()
    base = os.environ.get("XDG_RUNTIME_DIR") or f"/tmp/rmf-bridge-{os.getuid()}"
    return Path(base) / "rmf-bridge" / file.stem


def state_file(file: Path) -> Path:
    """What outlives a daemon and a reboot: where systemd says, else the user's state directory."""
    given = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(given or Path(base) / "rmf-bridge" / file.stem).absolute() / "kept.json"


class KeptFile:
    """One file that is replaced whole and is on the disk before `write` returns."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self) -> bytes | None:
        """What was kept; None when nothing was. Raises OSError."""
        try:
            return self._path.read_bytes()
        except FileNotFoundError:
            return None

    def write(self, kept: bytes) -> None:
        """Replace it. Raises OSError, and then the old one stands."""
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        new = self._path.with_suffix(".new")
        with new.open("wb") as out:
            out.write(kept)
            out.flush()
            os.fsync(out.fileno())
        new.replace(self._path)


def running_pid(path: Path) -> int | None:
    """The process id of the daemon that holds a runtime directory; None when none does."""
    try:
        with (path / LOCK).open("r+") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return int((path / LOCK).read_text() or 0) or None
    except FileNotFoundError:
        return None
    return None


class RuntimeDirectory:
    """Held by one daemon at a time, for as long as the object lives."""

    def __init__(self, path: Path) -> None:
        """Create and lock it. Raises AlreadyRunning, or OSError where it cannot be written."""
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        if path.stat().st_uid != os.getuid():
            raise PermissionError(f"{path} belongs to another user")
        self.path = path
        self._lock = (path / LOCK).open("a+")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._lock.close()
            raise AlreadyRunning(f"{path} is in use by a running daemon") from None
        self._lock.truncate(0)
        self._lock.write(str(os.getpid()))
        self._lock.flush()

    def claim(self, yaml: bytes) -> None:
        """Write down which outputs this daemon is about to claim."""
        self._replace(CLAIMED, yaml)

    def claimed(self) -> Path | None:
        """What a daemon had claimed and not released."""
        path = self.path / CLAIMED
        return path if path.exists() else None

    def released(self) -> None:
        """Every output is off and let go."""
        (self.path / CLAIMED).unlink(missing_ok=True)

    def write_status(self, json: bytes) -> None:
        """Replace the status file in one step."""
        self._replace(STATUS, json)

    def close(self) -> None:
        """Let another daemon have it. The status of a daemon that is gone is nobody's truth."""
        (self.path / STATUS).unlink(missing_ok=True)
        self._lock.close()

    def _replace(self, name: str, content: bytes) -> None:
        new = self.path / f".{name}.new"
        new.write_bytes(content)
        new.replace(self.path / name)

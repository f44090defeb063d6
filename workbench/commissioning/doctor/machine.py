"""The doctor's only access to this machine: files, commands' output, and device files' answers.

In tests, `root` is the directory of a simulated machine. Scripts in `usr/bin` below `root` are the
commands, and the test's `ioctl` answers for the device files.
"""

import fcntl
import importlib.util
import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

COMMAND_S: Final = 3.0
PLACES: Final = ("usr/sbin", "usr/bin", "sbin", "bin")
TEXT_MAX: Final = 1 << 20
TIMEX_MAX: Final = 512
"""The size (bytes) of the buffer for adjtimex(2), greater than any kernel's struct timex. The buffer is
full of zeroes, so the call only reads the clock's state."""
TIME_ERROR: Final = 5


def _ioctl(device: Path, request: int, argument: bytes) -> bytes:
    opened = os.open(device, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    try:
        return fcntl.ioctl(opened, request, argument)
    finally:
        os.close(opened)


def _installed(package: str) -> bool:
    return importlib.util.find_spec(package) is not None


def _synchronised() -> bool | None:
    """Ask adjtimex(2) whether the kernel's clock is synchronised. Return None if the answer is
    unknown."""
    import ctypes

    state: int = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(TIMEX_MAX))
    return None if state < 0 else state != TIME_ERROR


@dataclass(frozen=True, slots=True)
class Machine:
    """The doctor's access to the machine.

    - `ioctl(device, request, argument)` returns the kernel's reply, or raises OSError.
    - `installed(package)` tells whether this Python can import the package.
    - `synchronised()` tells whether the clock is synchronised, or None if unknown.
    - `uid` and `gids` belong to this process. `root_uid` is the user who may change the system.
    """

    root: Path = Path("/")
    ioctl: Callable[[Path, int, bytes], bytes] = _ioctl
    installed: Callable[[str], bool] = _installed
    synchronised: Callable[[], bool | None] = _synchronised
    uid: int = field(default_factory=os.geteuid)
    gids: frozenset[int] = field(default_factory=lambda: frozenset({os.getegid(), *os.getgroups()}))
    root_uid: int = 0

    def at(self, path: str | Path) -> Path:
        """Return the path below `root` that stands for an absolute path."""
        return self.root / str(path).lstrip("/")

    def named(self, found: Path) -> str:
        """Return the absolute path that stands for a path below `root`. Messages and commands for a
        person contain the absolute path."""
        return f"/{found.relative_to(self.root)}"

    def text(self, path: str | Path) -> str | None:
        """Return a file's stripped text. Return None if the file cannot be read."""
        try:
            with self.at(path).open("rb") as source:
                return source.read(TEXT_MAX).decode(errors="replace").strip(" \t\r\n\0")
        except OSError:
            return None

    def folder(self, path: str, pattern: str = "*") -> list[Path]:
        """Return a directory's entries, sorted. Return [] if the directory does not exist."""
        return sorted(self.at(path).glob(pattern))

    def target(self, path: str) -> str:
        """Return the target of a symbolic link such as /dev/serial/by-id/…. Return any other path
        unchanged."""
        found = self.at(path).resolve()
        root = self.root.resolve()
        return f"/{found.relative_to(root)}" if found.is_relative_to(root) else path

    def printed(self, *words: str) -> str | None:
        """Return a command's output. Return None if the command is missing or fails."""
        path = os.pathsep.join(str(self.root / place) for place in PLACES)
        command = shutil.which(words[0], path=path)
        if command is None:
            return None
        try:
            return subprocess.run(
                [command, *words[1:]],
                env={"PATH": path, "LC_ALL": "C"},
                capture_output=True,
                stdin=subprocess.DEVNULL,
                timeout=COMMAND_S,
                check=True,
            ).stdout.decode(errors="replace")
        except (OSError, subprocess.SubprocessError):
            return None

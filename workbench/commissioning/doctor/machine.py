"""This machine as the doctor sees it: its files, its commands' output, its devices' answers.

The doctor reaches the machine only through this module. In tests `root` is the directory of a made-up
machine: scripts in its `usr/bin` are the commands, and `ioctl` answers in place of its devices.
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
"""Size (bytes) greater than any kernel's struct timex. A struct of zeroes only reads the clock's
state."""
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
    """Return whether the kernel's clock is synchronised, from adjtimex(2); None if unknown."""
    import ctypes

    state: int = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(TIMEX_MAX))
    return None if state < 0 else state != TIME_ERROR


@dataclass(frozen=True, slots=True)
class Machine:
    """The doctor's access to the machine.

    `ioctl(device, request, argument)` returns the kernel's reply, or raises OSError.
    `installed(package)`: can this Python import the package? `synchronised()`: is the clock
    synchronised? None if unknown. `uid` and `gids` belong to this process.
    """

    root: Path = Path("/")
    ioctl: Callable[[Path, int, bytes], bytes] = _ioctl
    installed: Callable[[str], bool] = _installed
    synchronised: Callable[[], bool | None] = _synchronised
    uid: int = field(default_factory=os.geteuid)
    gids: frozenset[int] = field(default_factory=lambda: frozenset({os.getegid(), *os.getgroups()}))

    def at(self, path: str | Path) -> Path:
        """Return where an absolute path lies below `root`."""
        return self.root / str(path).lstrip("/")

    def named(self, found: Path) -> str:
        """Return the absolute path that the machine's own programs use for a place below `root`."""
        return f"/{found.relative_to(self.root)}"

    def text(self, path: str | Path) -> str | None:
        """Return a file's stripped text; None if unreadable."""
        try:
            with self.at(path).open("rb") as source:
                return source.read(TEXT_MAX).decode(errors="replace").strip(" \t\r\n\0")
        except OSError:
            return None

    def folder(self, path: str, pattern: str = "*") -> list[Path]:
        """Return a directory's entries, sorted; empty without such a directory."""
        return sorted(self.at(path).glob(pattern))

    def target(self, path: str) -> str:
        """Follow a symbolic link such as /dev/serial/by-id/…; return any other path as it is."""
        found = self.at(path).resolve()
        root = self.root.resolve()
        return f"/{found.relative_to(root)}" if found.is_relative_to(root) else path

    def printed(self, *words: str) -> str | None:
        """Return a command's output; None if the command is missing or fails."""
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

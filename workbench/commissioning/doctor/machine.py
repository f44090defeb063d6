"""This machine as the doctor sees it: its files, what its commands print, what its devices answer.

The doctor has no other access to it. In tests `root` is the directory of a made-up machine; its
commands are scripts in `usr/bin` there, and `ioctl` answers for its devices.
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
"""Longer than any kernel's struct timex. Zeroes only read the clock's state."""
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
    """Whether the kernel's clock is synchronised, read by adjtimex(2)."""
    import ctypes

    state: int = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(TIMEX_MAX))
    return None if state < 0 else state != TIME_ERROR


@dataclass(frozen=True, slots=True)
class Machine:
    """`ioctl(device, request, argument)` gives what the kernel fills in, or raises OSError.

    `installed(package)`: can this Python import it? `synchronised()`: is the clock, None if that is not
    known. `uid`, `gids`: of this process.
    """

    root: Path = Path("/")
    ioctl: Callable[[Path, int, bytes], bytes] = _ioctl
    installed: Callable[[str], bool] = _installed
    synchronised: Callable[[], bool | None] = _synchronised
    uid: int = field(default_factory=os.geteuid)
    gids: frozenset[int] = field(default_factory=lambda: frozenset({os.getegid(), *os.getgroups()}))

    def at(self, path: str | Path) -> Path:
        """Where an absolute path is found."""
        return self.root / str(path).lstrip("/")

    def named(self, found: Path) -> str:
        """The absolute path of what was found."""
        return f"/{found.relative_to(self.root)}"

    def text(self, path: str | Path) -> str | None:
        """What a file says, without the blanks at its ends; None if it cannot be read."""
        try:
            with self.at(path).open("rb") as source:
                return source.read(TEXT_MAX).decode(errors="replace").strip(" \t\r\n\0")
        except OSError:
            return None

    def folder(self, path: str, pattern: str = "*") -> list[Path]:
        """What is in a directory, sorted; nothing if there is none."""
        return sorted(self.at(path).glob(pattern))

    def target(self, path: str) -> str:
        """The path behind a symbolic link such as /dev/serial/by-id/…; itself if it is none."""
        found = self.at(path).resolve()
        root = self.root.resolve()
        return f"/{found.relative_to(root)}" if found.is_relative_to(root) else path

    def printed(self, *words: str) -> str | None:
        """What a command prints; None if there is no such command, or it fails."""
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

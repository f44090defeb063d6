"""Finds the processes that have a GPIO chip open. The kernel itself does not name the process that
holds a line. It only gives the label that the process has chosen ('lg' for lgpio)."""

import os
from collections.abc import Iterator
from pathlib import Path


def holders(chip: Path, proc: Path = Path("/proc")) -> list[str]:
    """Return the other processes that have this device open. The list lacks the processes that this
    user may not see.

    A service appears by its systemd unit. Any other process appears by its id and command.
    """
    found = (_name(p) for p in _processes(proc) if p.name != str(os.getpid()) and _has(p, chip))
    return sorted(set(found))


def _processes(proc: Path) -> Iterator[Path]:
    return (process for process in proc.iterdir() if process.name.isdecimal())


def _has(process: Path, chip: Path) -> bool:
    try:
        return any(os.readlink(fd) == str(chip) for fd in (process / "fd").iterdir())
    except OSError:  # the process has ended, or belongs to another user
        return False


def _name(process: Path) -> str:
    try:
        unit = (process / "cgroup").read_text().strip().rpartition("/")[2]
        command = (process / "cmdline").read_bytes().rstrip(b"\0").replace(b"\0", b" ")
    except OSError:
        return f"process {process.name}"
    if unit.endswith(".service"):
        return unit
    return f"process {process.name} ({command.decode(errors='replace')[:80]})"

"""A made-up machine. A directory tree takes the place of the disk, and scripts take the place of
commands. Prepared replies take the place of GPIO chips."""

import errno
import os
from collections.abc import Collection, Mapping
from pathlib import Path

from tests.workbench.commissioning.doctor.kernel_gpio import (
    GET_CHIPINFO,
    GET_LINEINFO,
    INPUT,
    OUTPUT,
    USED,
    GpiochipInfo,
    LineInfo,
)
from workbench.commissioning.doctor.machine import Machine
from workbench.commissioning.doctor.users import User

OURS = os.getegid()
"""The group of every file on the made-up machine. Users in this group may use the files."""
OTHERS = OURS + 4321


class MadeUp:
    """A machine whose files are inside `root`. The doctor examines the machine through `machine`."""

    def __init__(
        self, root: Path, gids: Collection[int] = (OURS,), installed: Collection[str] = ("lgpio",)
    ) -> None:
        self.root = root
        self._chips: dict[str, tuple[str, Mapping[int, str], Collection[int]]] = {}
        self.hidden: set[str] = set()
        """The chips that the doctor's process may not open."""
        self.synchronised: bool | None = True
        self.machine = Machine(
            root,
            self._ioctl,
            installed.__contains__,
            lambda: self.synchronised,
            os.geteuid() + 1,
            frozenset(gids),
            os.geteuid(),
        )
        self.user = User("pi", self.machine.uid, self.machine.gids, service=False)
        (root / "proc").mkdir()
        self.write("/etc/group", f"root:x:0:\ngpio:x:{OURS}:\ndialout:x:{OURS}:\n")
        self.write("/etc/passwd", f"pi:x:{self.machine.uid}:1000::/home/pi:/bin/bash\n")

    def write(self, path: str, text: str = "", mode: int = 0o660) -> None:
        """Write a file. On the made-up machine, a device file is an ordinary file."""
        place = self.root / path.lstrip("/")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)
        place.chmod(mode)

    def link(self, path: str, to: str) -> None:
        """Make a relative symbolic link, as udev does."""
        place = self.root / path.lstrip("/")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.symlink_to(to)

    def command(self, name: str, prints: str) -> None:
        """Make a command that prints this text."""
        self.write(f"/usr/bin/{name}.out", prints)
        script = f"#!/bin/sh\nexec /bin/cat '{self.root}/usr/bin/{name}.out'\n"
        self.write(f"/usr/bin/{name}", script, 0o755)

    def chip(
        self,
        number: int,
        label: str,
        held: Mapping[int, str] | None = None,
        outputs: Collection[int] = (),
        mode: int = 0o660,
    ) -> None:
        """Make a GPIO chip. `held` maps the number of each used line to the name of the program that
        uses the line. The lines in `outputs` are outputs."""
        self.write(f"/dev/gpiochip{number}", mode=mode)
        self._chips[f"gpiochip{number}"] = (label, held or {}, outputs)

    def _ioctl(self, device: Path, request: int, argument: bytes) -> bytes:
        label, held, outputs = self._chips[device.name]
        if device.name in self.hidden:
            raise PermissionError(errno.EACCES, "Permission denied")
        if request == GET_CHIPINFO:
            return bytes(GpiochipInfo(device.name.encode(), label.encode(), 58))
        assert request == GET_LINEINFO
        offset = LineInfo.from_buffer_copy(argument).offset
        flags = USED * (offset in held) | (OUTPUT if offset in outputs else INPUT)
        consumer = held.get(offset, "").encode()
        return bytes(LineInfo(f"GPIO{offset}".encode(), consumer, offset, 0, flags))

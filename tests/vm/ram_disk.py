"""The initial RAM disk: busybox, modules to reach the root file system, and a script of ten lines.

The archive's format is "newc" in the kernel's
Documentation/driver-api/early-userspace/buffer-format.rst.
"""

import lzma
from collections.abc import Iterator
from pathlib import Path
from typing import Final

WANTED: Final = ("virtio_pci", "virtio_blk", "ext4")
INIT: Final = b"""#!/bin/busybox sh
b=/bin/busybox
$b mount -t devtmpfs dev /dev
for module in /modules/*; do $b insmod $module; done
until [ -e /dev/vda ]; do $b sleep 0.1; done
$b mount -t ext4 /dev/vda /root || exec $b sh
$b mount --move /dev /root/dev
exec $b switch_root /root /sbin/init
"""


def ram_disk(tree: Path, kernel: str) -> bytes:
    """Return the archive for this kernel, with files from the Debian in `tree`."""
    folders = [_entry(name, 0o040755) for name in ("bin", "dev", "modules", "root")]
    busybox = _entry("bin/busybox", 0o100755, (tree / "usr/bin/busybox").read_bytes())
    modules = (
        _entry(f"modules/{place:02}-{path.name.removesuffix('.xz')}", 0o100644, _module(path))
        for place, path in enumerate(_modules(tree / "usr/lib/modules" / kernel))
    )
    parts = [*folders, busybox, *modules, _entry("init", 0o100755, INIT), _entry("TRAILER!!!", 0)]
    return b"".join(parts)


def _modules(folder: Path) -> Iterator[Path]:
    """Yield the wanted modules. Each module comes after the modules that it needs."""
    lines = (folder / "modules.dep").read_text().splitlines()
    needs = {name: rest.split() for name, _, rest in (line.partition(":") for line in lines)}
    told: set[str] = set()
    for wanted in WANTED:
        found = [name for name in needs if name.rpartition("/")[2].split(".")[0] == wanted]
        for name in found:  # in modules.dep, each module comes before the modules that it needs
            for each in (*reversed(needs[name]), name):
                if each not in told:
                    told.add(each)
                    yield folder / each


def _module(path: Path) -> bytes:
    """Return the module's bytes unpacked, because busybox does not unpack them."""
    content = path.read_bytes()
    return lzma.decompress(content) if path.suffix == ".xz" else content


def _entry(name: str, mode: int, content: bytes = b"") -> bytes:
    spelled = name.encode() + b"\0"
    fields = (0, mode, 0, 0, 1, 0, len(content), 0, 0, 0, 0, len(spelled), 0)
    head = b"070701" + b"".join(b"%08x" % field for field in fields) + spelled
    return _padded(head) + _padded(content)


def _padded(part: bytes) -> bytes:
    return part + bytes(-len(part) % 4)

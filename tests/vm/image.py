"""Builds a bootable Debian image. An ordinary user can build the image. In the cache, the image's name
contains the kernel and a hash of the image's packages, kernel modules and files.

`mmdebstrap` makes an archive of Debian, and `mke2fs -d` makes a file system from the archive. Both run
under fakeroot, so nothing is mounted. The image uses our own initial RAM disk (`ram_disk.py`),
because the build could make Debian's RAM disk only with a program of the target system.

For another architecture, the build does not emulate the packages' install scripts. These scripts leave
the same text in /etc and /var on each architecture. So the build first installs the packages of this
machine's architecture. Then the build unpacks the other architecture's packages over them.
"""

import hashlib
import os
import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.vm.ram_disk import ram_disk

KERNEL: Final = "7.3.4+deb13"
"""The kernel's version. The kernel is from trixie-backports, because the kernel of Debian 13 itself
lacks gpio-sim. trixie-backports keeps old versions."""
MIRROR: Final = "http://deb.debian.org/debian"
SUITES: Final = ("trixie", "trixie-backports")
SIZE: Final = "1500M"
PACKAGES: Final = (
    "busybox-static",
    "dbus",
    "iproute2",
    "kmod",
    "procps",
    "python3",
    "systemd",
    "systemd-sysv",
    "udev",
)
MODULES: Final = (
    "crypto",
    "drivers/block/virtio_blk",
    "drivers/char/virtio_console",
    "drivers/gpio",
    "drivers/net/can",
    "drivers/net/dummy",
    "drivers/net/veth",
    "drivers/usb/common",
    "drivers/usb/core",
    "drivers/usb/serial/usbserial",
    "drivers/virtio",
    "fs",
    "lib",
    "net/9p",
    "net/can",
)
"""The kernel modules in the image. All modules together would take 400 MB."""
DPKG: Final = "var/lib/dpkg"
KEPT: Final = ("--exclude=./dev", "--exclude=./etc", "--exclude=./var")
"""Options of tar for unpacking the other architecture's packages. With these options, tar does not
overwrite the folders that this machine's install scripts have filled."""
LEFT_OUT: Final = ("usr/share/doc", "usr/share/locale", "usr/share/man")
TOOLS: Final = {
    "depmod": "kmod",
    "dpkg-deb": "dpkg",
    "fakeroot": "fakeroot",
    "mke2fs": "e2fsprogs",
    "mmdebstrap": "mmdebstrap",
}
"""The Debian package of each program."""
FILES: Final = Path(__file__).parent / "root"
"""Files that are copied into the image. With these files, the machine runs the checks."""


class Unusable(Exception):
    """An error if this machine cannot build or boot the image. The text gives the remedy."""


@dataclass(frozen=True, slots=True)
class Image:
    """The files from which QEMU boots."""

    kernel: Path
    ram_disk: Path
    root: Path


def image(arch: str, cache: Path) -> Image:
    """Return the image of this architecture from the cache, or build it. Raises Unusable."""
    folder = cache / f"{arch}-{KERNEL}-{_key()}"
    made = Image(folder / "vmlinuz", folder / "initrd", folder / "root.ext4")
    if not folder.exists():
        needed(TOOLS)
        print(f"building the image, once: {folder}", flush=True)
        fresh = folder.with_name(f"{folder.name}.new")
        shutil.rmtree(fresh, ignore_errors=True)
        fresh.mkdir(parents=True)
        _build(arch, fresh)
        fresh.rename(folder)
    return made


def needed(tools: dict[str, str]) -> None:
    """Raise Unusable if a tool is missing. The error names the tools' packages."""
    path = f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"
    missing = sorted({deb for tool, deb in tools.items() if not shutil.which(tool, path=path)})
    if missing:
        raise Unusable(f"this machine lacks programs: sudo apt install {' '.join(missing)}")


def _key() -> str:
    files = (p.read_text() for p in sorted(FILES.rglob("*")) if p.is_file())
    words = (KERNEL, *SUITES, *PACKAGES, *MODULES, SIZE, *files)
    return hashlib.sha256("\n".join(words).encode()).hexdigest()[:10]


def _build(arch: str, folder: Path) -> None:
    tree = folder / "tree"
    with (folder / "build.log").open("w") as log:
        steps = [
            f"mkdir {tree}",
            *_filled(arch, folder, log.fileno()),
            f"mkdir {tree}/dev",
            f"cp -R {FILES}/. {tree}/",
            f"chmod -R u+rX {tree}",  # mke2fs is not root here, and cannot read /etc/gshadow
            f"chown -R 0:0 {tree}/etc",
            f"depmod -b {tree} {KERNEL}-{arch}",
            f"mke2fs -q -t ext4 -L root -d {tree} {folder}/root.ext4 {SIZE}",
        ]
        _run(["fakeroot", "sh", "-ec", "\n".join(steps)], log.fileno())
    shutil.copy(tree / f"usr/lib/modules/{KERNEL}-{arch}/vmlinuz", folder / "vmlinuz")
    (folder / "initrd").write_bytes(ram_disk(tree, f"{KERNEL}-{arch}"))
    shutil.rmtree(tree)
    for archive in folder.glob("*.tar"):
        archive.unlink()


def _filled(arch: str, folder: Path, log: int) -> list[str]:
    """Make archives of Debian. Return the shell commands that unpack these archives into the folder
    `tree`."""
    here = subprocess.check_output(["dpkg", "--print-architecture"], text=True).strip()
    kernel = [f"linux-{part}-{KERNEL}-{arch}" for part in ("binary", "modules")]
    tree, ours, other = folder / "tree", folder / "ours.tar", folder / "other.tar"
    if arch == here:
        _run(_mmdebstrap(arch, "apt", [*PACKAGES, *kernel], ours), log)
        return [f"tar -C {tree} -xpf {ours} --exclude=./dev"]
    _run(_mmdebstrap(here, "apt", PACKAGES, ours), log)
    status = subprocess.check_output(["tar", "-xOf", ours, f"./{DPKG}/status"], text=True)
    names = [line.split()[1] for line in status.splitlines() if line.startswith("Package: ")]
    _run(_mmdebstrap(arch, "extract", [*names, *kernel], other), log)
    return [
        f"tar -C {tree} -xpf {ours} --exclude=./dev",
        f"tar -C {tree} -xpf {other} --keep-directory-symlink {' '.join(KEPT)}",
        f"rm {tree}/etc/ld.so.cache",
        f"cd {tree}/{DPKG}",
        f"echo {arch} > arch",
        f"sed -i 's/^Architecture: {here}$/Architecture: {arch}/' status",
        f"for file in info/*:{here}.*; do mv $file ${{file%:*}}:{arch}.${{file##*.}}; done",
    ]


def _run(words: Iterable[str], log: int) -> None:
    path = f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"
    done = subprocess.run([*words], stdout=log, stderr=log, env={**os.environ, "PATH": path})
    if done.returncode:
        name = os.readlink(f"/proc/self/fd/{log}")
        raise Unusable(f"cannot build the image; read the end of {name} for the reason")


def _mmdebstrap(arch: str, variant: str, packages: Iterable[str], archive: Path) -> list[str]:
    """Return the command of mmdebstrap. For a user other than root, the command needs a user namespace
    and the programs of the package uidmap."""
    if os.geteuid() != 0:
        needed({"newuidmap": "uidmap"})
    return [
        "mmdebstrap",
        f"--mode={'unshare' if os.geteuid() else 'root'}",
        f"--architectures={arch}",
        f"--variant={variant}",
        f"--include={','.join(packages)}",
        '--aptopt=Apt::Install-Recommends "false"',
        *(f"--dpkgopt=path-exclude=/{folder}/*" for folder in LEFT_OUT),
        "--dpkgopt=path-exclude=/usr/lib/modules/*/kernel/*",
        *(f"--dpkgopt=path-include=/usr/lib/modules/*/kernel/{name}*" for name in MODULES),
        SUITES[0],
        str(archive),
        *_sources(),
    ]


def _sources() -> list[str]:
    return [f"deb {MIRROR} {suite} main" for suite in SUITES]

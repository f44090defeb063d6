"""Examine the machine itself: its clock, its watchdog, its disks and the daemon's directories."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from bridges.system.directories import Directories
from workbench.commissioning.doctor.finding import Finding, note, ok, warning, wrong
from workbench.commissioning.doctor.machine import Machine
from workbench.commissioning.doctor.users import User

FREE_LEAST: Final = 50 << 20
"""Minimum free space (bytes). With less space, a growing log soon fills the disk."""


def clock(machine: Machine) -> Iterator[Finding]:
    """Examine the clock. The clock must be right, because RMF compares the time stamps in the daemon's
    messages with its own clock."""
    found = "the clock is not synchronised"
    means = "states have wrong time stamps, so RMF may treat them as old; durations are still right"
    do = "timedatectl timesync-status; is the time server reached? A Pi has no clock of its own"
    synchronised = machine.synchronised()
    if synchronised:
        yield ok("clock", "the clock is synchronised")
    elif synchronised is None:
        yield note("clock", "the kernel does not show whether the clock is synchronised", means, do)
    elif "NTP=no" in (machine.printed("timedatectl", "show") or "").splitlines():
        yield warning("clock", f"{found}, and NTP is off", means, "sudo timedatectl set-ntp true")
    else:
        yield warning("clock", found, means, do)


def watchdog(machine: Machine) -> Iterator[Finding]:
    """Examine whether a watchdog restarts this machine when the kernel or systemd hangs."""
    subject = "watchdog"
    means = "when the kernel hangs, relays stay as they are until somebody cuts the supply"
    if not machine.folder("/dev", "watchdog*"):
        do = "dtparam=watchdog=on in /boot/firmware/config.txt, and reboot"
        yield warning(subject, "this machine has no hardware watchdog", means, do)
        return
    words = ("systemctl", "show", "--property=RuntimeWatchdogUSec", "--value")
    fed = (machine.printed(*words) or "").strip()
    if not fed:
        do = "run on the target: systemctl show --property=RuntimeWatchdogUSec"
        yield note(subject, "nobody knows whether systemd feeds the hardware watchdog", means, do)
    elif fed in ("0", "infinity"):
        do = (
            "RuntimeWatchdogSec=10 below [Manager] in /etc/systemd/system.conf.d/watchdog.conf, then"
            " sudo systemctl daemon-reexec (a Raspberry Pi's watchdog permits at most 15 s)"
        )
        yield warning(
            subject, "there is a hardware watchdog, but systemd does not feed it", means, do
        )
    else:
        yield ok(subject, f"the hardware restarts this machine if systemd is silent for {fed}")


def directories(machine: Machine, places: Directories, who: User) -> Iterator[Finding]:
    """Examine whether the daemon can write its files, and whether the disk has enough free space."""
    for folder in places.folders:
        found = existing(machine.at(folder))
        yield disk(str(folder), os.statvfs(found))
        if not who.service and not _may_write(found, machine, who):
            yield wrong(
                "disk",
                f"{who.name} may not write in {machine.named(found)}, where {folder} belongs",
                "there is no status, and after a death nobody knows which outputs were on",
                "start the daemon as a user who may write there, or choose another --runtime-dir",
            )


def disk(what: str, found: os.statvfs_result) -> Finding:
    """Examine the free space of a disk. Warn if less than FREE_LEAST is free.

    A disk may be small because it is in memory. Then the limit is a twentieth of the disk.
    """
    means = "the device is served nevertheless, but status, log and the record of outputs get lost"
    if found.f_flag & os.ST_RDONLY:
        do = "use an overlay or tmpfs for this directory; if the SD card has errors, replace the card"
        return wrong("disk", f"{what} is on a disk that is read-only", means, do)
    free, whole = found.f_bavail * found.f_frsize, found.f_blocks * found.f_frsize
    if found.f_files and not found.f_favail:
        return wrong(
            "disk", f"{what} is on a disk without free inodes", means, "delete small files"
        )
    if free < min(FREE_LEAST, whole // 20):
        do = "df -h; journalctl --vacuum-size=50M; SystemMaxUse=50M in journald.conf"
        text = f"{what} has {_size(free)} free of {_size(whole)}"
        return wrong("disk", text, means, do) if not free else warning("disk", text, means, do)
    return ok("disk", f"{what} has {_size(free)} free")


def existing(folder: Path) -> Path:
    """Return the directory, or the nearest parent directory that exists."""
    return next(place for place in (folder, *folder.parents) if _is_there(place))


def _is_there(folder: Path) -> bool:
    try:
        return folder.is_dir()
    except PermissionError:  # this user may not enter a parent directory
        return False


def _may_write(folder: Path, machine: Machine, who: User) -> bool:
    return who.uid == 0 or who.may(folder.stat())


def _size(octets: int) -> str:
    return f"{octets / (1 << 30):.1f} GiB" if octets >= 1 << 30 else f"{octets / (1 << 20):.1f} MiB"

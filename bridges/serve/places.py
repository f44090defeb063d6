"""Where a daemon keeps its files, found by one rule for every command.

A directory given on the command line; else systemd's, in a unit; else the service's, if its lock or
record names this file; else that of a daemon started by hand, for root also the sudo user's.

`runtime` is lost at a reboot: lock and status. `state` survives it: the record of claimed outputs,
because a Modbus relay outlives a power cut of the Pi. A given directory is both.
"""

import grp
import os
import pwd
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from msgspec import Struct

SERVICE_RUN = Path("/run/rmf-bridge")
SERVICE_STATE = Path("/var/lib/rmf-bridge")
USERS_RUN = Path("/run/user")
TMP = Path("/tmp")
SERVICE_USER = "rmf-bridge"
GROUPS = ("gpio", "dialout")
"""The groups that a drop-in may give this user beside its own (`drop_in.py`)."""


class Places(Struct, frozen=True):
    """The directories of one daemon."""

    runtime: Path
    state: Path

    @property
    def folders(self) -> tuple[Path, ...]:
        """Both, `state` first."""
        return tuple(dict.fromkeys((self.state, self.runtime)))


def named(file: Path) -> str:
    """A file's canonical path, as locks and records name it."""
    return os.path.realpath(file)


def as_given(given: str | None) -> Places | None:
    """The directories that the command line or systemd's unit gives; None if neither does."""
    if given:
        return Places(Path(given).absolute(), Path(given).absolute())
    runtime = os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
    state = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    return Places(Path(runtime), Path(state or runtime)) if runtime else None


def of_service(file: Path) -> Places:
    """The directories of `rmf-bridge@.service`."""
    return Places(SERVICE_RUN / file.stem, SERVICE_STATE / file.stem)


def by_hand(file: Path) -> Places:
    """The directories of a daemon that this user starts by hand."""
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR") or TMP / f"rmf-bridge-{os.getuid()}")
    return Places(runtime / "rmf-bridge" / file.stem, state_base() / file.stem)


def state_base() -> Path:
    """This user's state directory; one below /tmp if there is no home."""
    home = os.path.expanduser("~")
    default = Path(home) / ".local/state" if os.path.isabs(home) else TMP / f"rmf-{os.getuid()}"
    return Path(os.environ.get("XDG_STATE_HOME") or default) / "rmf-bridge"


def everywhere(file: Path) -> Iterator[Places]:
    """Where a daemon of this file may be: in the service's directories, or those of a daemon started by
    hand; for root also those of the user who called sudo.
    """
    yield of_service(file)
    if os.geteuid() == 0 and (uid := os.environ.get("SUDO_UID", "")).isdecimal():
        yield from _of_user(int(uid), file)
    yield by_hand(file)


def _of_user(uid: int, file: Path) -> Iterator[Places]:
    """The directories of this user, if they belong to that user."""
    for base in (USERS_RUN / str(uid), TMP / f"rmf-bridge-{uid}"):
        runtime = base / "rmf-bridge" / file.stem
        try:
            home = Path(pwd.getpwuid(uid).pw_dir)
            his = base.lstat().st_uid == uid and runtime.lstat().st_uid == uid
        except (KeyError, OSError):
            continue
        if his:
            yield Places(runtime, home / ".local/state/rmf-bridge" / file.stem)


def runtimes() -> Iterator[Path]:
    """Every runtime directory on this machine that this user may look for: the services', one's own;
    for root those of all users.
    """
    bases = [SERVICE_RUN, by_hand(Path("any")).runtime.parent]
    if os.geteuid() == 0:
        bases += [*USERS_RUN.glob("*/rmf-bridge"), *TMP.glob("rmf-bridge-*/rmf-bridge")]
    for base in dict.fromkeys(bases):
        with suppress(OSError):
            yield from sorted(base.iterdir())


def distrusted(folder: Path) -> str:
    """Why a directory cannot be trusted; "" if only its owner or root can have made it.

    This holds for each directory above it as well.
    """
    owner = folder.lstat().st_uid
    others = 0o022 if os.geteuid() == 0 else 0o002
    for place in (folder, *folder.parents):
        found = place.lstat()
        link = stat.S_ISLNK(found.st_mode)
        if found.st_uid not in (0, owner):
            return f"{place} belongs to another user"
        if link and (place == folder or found.st_uid != 0):
            return f"{place} is a symbolic link"
        if not link and found.st_mode & others and not found.st_mode & stat.S_ISVTX:
            return f"{place} can be written by others"
    return ""


def own(places: Places) -> None:
    """Raises PermissionError where a directory is there and belongs to another user."""
    for folder in _existing(places):
        if folder.stat().st_uid != os.geteuid():
            raise PermissionError(
                f"{folder} belongs to {owner_of(folder)}: run this with sudo -u {owner_of(folder)}"
            )


def act_as_owner(places: Places) -> None:
    """Root permanently becomes the directories' owner, with the groups that the unit gives.

    Files in them can then do no more than their owner could. Raises PermissionError if somebody else
    could have made them.
    """
    for folder in _existing(places):
        if why := distrusted(folder):
            raise PermissionError(f"{why}, so {folder} cannot be trusted")
        found = folder.lstat()
        if os.geteuid() == 0 and found.st_uid != 0:
            _become(found.st_uid, found.st_gid)
    own(places)


def _existing(places: Places) -> list[Path]:
    return [folder for folder in places.folders if os.path.lexists(folder)]


def _become(uid: int, gid: int) -> None:
    os.setgroups(_groups(uid, gid))
    os.setgid(gid)
    os.setuid(uid)


def _groups(uid: int, gid: int) -> list[int]:
    """The user's groups; for the service's user also those that the unit gives."""
    try:
        user = pwd.getpwuid(uid)
    except KeyError:
        return [gid]
    groups = os.getgrouplist(user.pw_name, gid)
    if user.pw_name == SERVICE_USER:
        groups += [g.gr_gid for g in grp.getgrall() if g.gr_name in GROUPS]
    return groups


def owner_of(path: Path) -> str:
    """The owner's name, for messages."""
    try:
        return pwd.getpwuid(path.lstat().st_uid).pw_name
    except (KeyError, OSError):
        return "another user"


def work_somewhere(places: Places) -> None:
    """Change to a directory where lgpio can make its FIFO: one of these, or a temporary one."""
    for folder in (places.runtime, places.state, TMP, Path("/dev/shm"), Path("/var/tmp")):
        probe = folder / f".rmf-bridge-{os.getpid()}"
        try:
            os.mkfifo(probe)
            probe.unlink()
            os.chdir(folder)
        except OSError:
            continue
        return

"""A daemon's directories. Every command finds them by one rule, in this order:

1. the directory that the command line gives
2. in a systemd unit, the directories that systemd gives
3. the service's directories, if the lock or the record in them names this file. For
   /etc/rmf-bridges/NAME.yaml it is enough that the directories exist, because the file may be a link
   that led elsewhere when the service started
4. the directories of a daemon that a person started by hand. For root, the directories of the user who
   called sudo come before root's own.

`runtime` holds the lock and the status, and is lost at a reboot. `state` holds the record of claimed
outputs. The record must survive a reboot, because a Modbus relay stays on during a power cut of the Pi.
A directory from the command line serves as `runtime` and as `state`.
"""

import grp
import hashlib
import os
import pwd
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from msgspec import Struct

SERVICE_RUN = Path("/run/rmf-bridge")
SERVICE_STATE = Path("/var/lib/rmf-bridge")
SERVICE_FILES = Path("/etc/rmf-bridges")
USERS_RUN = Path("/run/user")
TMP = Path("/tmp")
SERVICE_USER = "rmf-bridge"
"""The name of a user and of a group. The recorder runs as this user, and so does a service whose
drop-in names no user. The group may read the files of every service."""
GROUPS = ("gpio", "dialout")
"""The additional groups that a drop-in may give a service's user (`drop_in.py`)."""
_OF_SERVICE = re.compile(SERVICE_USER + "(-[0-9a-f]{8})?")


def user_of(service: str) -> str:
    """Return the name of a service's own user. A hash makes the name short, and avoids capital
    letters."""
    return f"{SERVICE_USER}-{hashlib.sha256(service.encode()).hexdigest()[:8]}"


class Directories(Struct, frozen=True):
    """The directories of one daemon."""

    runtime: Path
    state: Path

    @property
    def folders(self) -> tuple[Path, ...]:
        """Both directories, with `state` first. The result has one directory if both are the same."""
        return tuple(dict.fromkeys((self.state, self.runtime)))


def named(file: Path) -> str:
    """Return a file's canonical path, which locks and records use."""
    return os.path.realpath(file)


def as_given(given: str | None) -> Directories | None:
    """Return the directories that the command line or systemd's unit gives. Return None if neither
    gives one."""
    if given:
        return Directories(Path(given).absolute(), Path(given).absolute())
    runtime = os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
    state = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    return Directories(Path(runtime), Path(state or runtime)) if runtime else None


def of_service(file: Path) -> Directories:
    """Return the directories of `rmf-bridge@.service`."""
    return Directories(SERVICE_RUN / file.stem, SERVICE_STATE / file.stem)


def by_hand(file: Path) -> Directories:
    """Return the directories of a daemon that this user started by hand."""
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR") or TMP / f"rmf-bridge-{os.getuid()}")
    return Directories(runtime / "rmf-bridge" / file.stem, state_base() / file.stem)


def state_base() -> Path:
    """Return this user's state directory. A user without a home gets a directory below /tmp."""
    home = os.path.expanduser("~")
    default = Path(home) / ".local/state" if os.path.isabs(home) else TMP / f"rmf-{os.getuid()}"
    return Path(os.environ.get("XDG_STATE_HOME") or default) / "rmf-bridge"


def state_base_of(folder: Path) -> Path:
    """Return the state directory of the user who owns this runtime directory. The environment of
    another user cannot be seen, so only that user's home counts."""
    with suppress(OSError, KeyError):
        uid = folder.lstat().st_uid
        if uid != os.geteuid():
            return Path(pwd.getpwuid(uid).pw_dir) / ".local/state/rmf-bridge"
    return state_base()


def everywhere(file: Path) -> Iterator[Directories]:
    """Yield the possible directories of this file's daemon. They depend on who started the daemon:
    systemd, the user who called sudo (only for root), or this user."""
    yield of_service(file)
    if os.geteuid() == 0 and (uid := os.environ.get("SUDO_UID", "")).isdecimal():
        yield from _of_user(int(uid), file)
    yield by_hand(file)


def _of_user(uid: int, file: Path) -> Iterator[Directories]:
    """Yield the directories of the user `uid` for this file. Leave out directories that another user
    owns."""
    for runtime in usual_runtimes(uid, file.stem):
        base = runtime.parents[1]
        try:
            home = Path(pwd.getpwuid(uid).pw_dir)
            his = base.lstat().st_uid == uid and runtime.lstat().st_uid == uid
        except (KeyError, OSError):
            continue
        if his:
            yield Directories(runtime, home / ".local/state/rmf-bridge" / file.stem)


def usual_runtimes(uid: int, name: str) -> Iterator[Path]:
    """Yield the runtime directories in which the user `uid` may have a daemon that was started by hand:
    with a login's XDG_RUNTIME_DIR, and without it."""
    for base in (USERS_RUN / str(uid), TMP / f"rmf-bridge-{uid}"):
        yield base / "rmf-bridge" / name


def runtimes() -> Iterator[Path]:
    """Yield the runtime directories of this machine's services and of this user. For root, yield the
    directories of all users."""
    bases = [SERVICE_RUN, by_hand(Path("any")).runtime.parent]
    if os.geteuid() == 0:
        bases += [*USERS_RUN.glob("*/rmf-bridge"), *TMP.glob("rmf-bridge-*/rmf-bridge")]
    for base in dict.fromkeys(bases):
        with suppress(OSError), opened(base):
            yield from sorted(base.iterdir())


class Distrusted(PermissionError):
    """The error of a directory that another user made or can write. The error's text names the
    directory."""


def cannot_be_seen(folder: Path, error: OSError) -> PermissionError:
    """Return the error for a folder that this user cannot read. The error's text has a remedy."""
    return PermissionError(
        f"cannot see whether a daemon runs in {folder}: {error.strerror or error}. The folder belongs"
        f" to {owner_of(folder)}: use sudo, or give another directory with --runtime-dir"
    )


@contextmanager
def opened(folder: Path, *, ours: bool = False, make: bool = False) -> Iterator[int]:
    """Yield a descriptor of a daemon's directory. If `make`, make a missing directory.

    The directory is checked first. Only its owner or root can have made it, and no other user can write
    it. If `ours`, the owner must be this user. Each parent directory is checked in the same way, from
    the top down. Therefore the caller may use the directory's path as well as the descriptor. Raises
    Distrusted if a check fails, and other OSErrors.
    """
    folder = folder.absolute()
    owner = _owner(folder, ours=ours or make)
    for place in (*reversed(folder.parents), folder):
        if make:
            with suppress(FileExistsError):
                place.mkdir(mode=0o700)
        if why := _distrusted(place, owner, last=place == folder):
            to_do = "give another directory with --runtime-dir"
            raise Distrusted(f"{place} {why}, so {folder} cannot be trusted: {to_do}")
    directory = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        yield directory
    finally:
        os.close(directory)


def _owner(folder: Path, *, ours: bool) -> int:
    """Return a directory's owner. Raises Distrusted if `ours` is set and the owner is another user."""
    try:
        owner = folder.lstat().st_uid
    except FileNotFoundError:
        return os.geteuid()
    except PermissionError as error:
        raise cannot_be_seen(folder, error) from None
    if ours and owner != os.geteuid():
        whose = owner_of(folder)
        raise Distrusted(f"{folder} belongs to {whose}: run this with sudo -u {whose}")
    return owner


def _distrusted(place: Path, owner: int, *, last: bool) -> str:
    """Return the reason for distrust, if another user than root or the owner may have made this
    directory or link. Otherwise return ""."""
    found = place.lstat()
    if found.st_uid not in (Path("/").stat().st_uid, owner):
        return "belongs to another user"
    if stat.S_ISLNK(found.st_mode):
        return "is a symbolic link" if last else ""
    others = 0o022 if os.geteuid() == 0 else 0o002
    if found.st_mode & others and (last or not found.st_mode & stat.S_ISVTX):
        return "can be written by other users"
    return ""


def act_as_owner(places: Directories) -> None:
    """Change permanently from root to the owner of the directories, with the groups that the unit has.

    After that, files in the directories can cause no more harm than their owner could. If this process
    is the owner's already, nothing changes. Raises PermissionError if another user could have made the
    directories, or if this process is neither root's nor the owner's.
    """
    for folder in places.folders:
        with suppress(FileNotFoundError, NotADirectoryError):
            with opened(folder, ours=os.geteuid() != 0) as directory:
                found = os.fstat(directory)
            if found.st_uid != os.geteuid():
                _become(found.st_uid, found.st_gid)


def _become(uid: int, gid: int) -> None:
    os.setgroups(_groups(uid, gid))
    os.setgid(gid)
    os.setuid(uid)


def _groups(uid: int, gid: int) -> list[int]:
    """Return the user's groups. For a service's user, add the groups that a unit may give it."""
    try:
        user = pwd.getpwuid(uid)
    except KeyError:
        return [gid]
    groups = os.getgrouplist(user.pw_name, gid)
    if _OF_SERVICE.fullmatch(user.pw_name):
        groups += [g.gr_gid for g in grp.getgrall() if g.gr_name in GROUPS]
    return groups


def owner_of(path: Path) -> str:
    """Return the owner's name, for messages."""
    try:
        return pwd.getpwuid(path.lstat().st_uid).pw_name
    except (KeyError, OSError):
        return "another user"


def work_somewhere(places: Directories) -> None:
    """Change to a directory in which the library lgpio can make its FIFO. Try the directories in
    `places` first, and then temporary directories."""
    for folder in (places.runtime, places.state, TMP, Path("/dev/shm"), Path("/var/tmp")):
        probe = folder / f".rmf-bridge-{os.getpid()}"
        try:
            os.mkfifo(probe)
            probe.unlink()
            os.chdir(folder)
        except OSError:
            continue
        return

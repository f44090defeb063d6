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
from contextlib import contextmanager, suppress
from pathlib import Path

from msgspec import Struct

SERVICE_RUN = Path("/run/rmf-bridge")
SERVICE_STATE = Path("/var/lib/rmf-bridge")
USERS_RUN = Path("/run/user")
TMP = Path("/tmp")
SERVICE_USER = "rmf-bridge"
GROUPS = ("gpio", "dialout")
"""The groups that a drop-in may give this user beside its own (`drop_in.py`)."""


class Directories(Struct, frozen=True):
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


def as_given(given: str | None) -> Directories | None:
    """The directories that the command line or systemd's unit gives; None if neither does."""
    if given:
        return Directories(Path(given).absolute(), Path(given).absolute())
    runtime = os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
    state = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    return Directories(Path(runtime), Path(state or runtime)) if runtime else None


def of_service(file: Path) -> Directories:
    """The directories of `rmf-bridge@.service`."""
    return Directories(SERVICE_RUN / file.stem, SERVICE_STATE / file.stem)


def by_hand(file: Path) -> Directories:
    """The directories of a daemon that this user starts by hand."""
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR") or TMP / f"rmf-bridge-{os.getuid()}")
    return Directories(runtime / "rmf-bridge" / file.stem, state_base() / file.stem)


def state_base() -> Path:
    """This user's state directory; one below /tmp if there is no home."""
    home = os.path.expanduser("~")
    default = Path(home) / ".local/state" if os.path.isabs(home) else TMP / f"rmf-{os.getuid()}"
    return Path(os.environ.get("XDG_STATE_HOME") or default) / "rmf-bridge"


def everywhere(file: Path) -> Iterator[Directories]:
    """Where a daemon of this file may be: in the service's directories, or those of a daemon started by
    hand; for root also those of the user who called sudo.
    """
    yield of_service(file)
    if os.geteuid() == 0 and (uid := os.environ.get("SUDO_UID", "")).isdecimal():
        yield from _of_user(int(uid), file)
    yield by_hand(file)


def _of_user(uid: int, file: Path) -> Iterator[Directories]:
    """The directories of this user, if they belong to that user."""
    for base in (USERS_RUN / str(uid), TMP / f"rmf-bridge-{uid}"):
        runtime = base / "rmf-bridge" / file.stem
        try:
            home = Path(pwd.getpwuid(uid).pw_dir)
            his = base.lstat().st_uid == uid and runtime.lstat().st_uid == uid
        except (KeyError, OSError):
            continue
        if his:
            yield Directories(runtime, home / ".local/state/rmf-bridge" / file.stem)


def runtimes() -> Iterator[Path]:
    """Every runtime directory on this machine that this user may look for: the services', one's own;
    for root those of all users.
    """
    bases = [SERVICE_RUN, by_hand(Path("any")).runtime.parent]
    if os.geteuid() == 0:
        bases += [*USERS_RUN.glob("*/rmf-bridge"), *TMP.glob("rmf-bridge-*/rmf-bridge")]
    for base in dict.fromkeys(bases):
        with suppress(OSError), opened(base):
            yield from sorted(base.iterdir())


class Distrusted(PermissionError):
    """Somebody else has made a directory, or could put files into it. The text says which."""


def cannot_be_seen(folder: Path, error: OSError) -> PermissionError:
    """What to do where this user cannot look."""
    return PermissionError(
        f"whether a daemon runs there cannot be seen: {folder}: {error.strerror or error}. It belongs"
        f" to {owner_of(folder)}: use sudo, or give another directory with --runtime-dir"
    )


@contextmanager
def opened(folder: Path, *, ours: bool = False, make: bool = False) -> Iterator[int]:
    """A descriptor of a daemon's directory, made if it is missing and `make` says so.

    Only its owner (`ours`: this user) or root can have made it, and nobody else can put anything into
    it; the same holds, from the top down, for each directory above it. So what follows may use its
    path. Raises Distrusted, and other OSErrors.
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
    """Whose a directory is. Raises Distrusted if it is not this user's, but should be."""
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
    """Why others than the owner or root may have made a directory or a link; "" if not."""
    found = place.lstat()
    if found.st_uid not in (Path("/").stat().st_uid, owner):
        return "belongs to another user"
    if stat.S_ISLNK(found.st_mode):
        return "is a symbolic link" if last else ""
    others = 0o022 if os.geteuid() == 0 else 0o002
    if found.st_mode & others and (last or not found.st_mode & stat.S_ISVTX):
        return "can be written by others"
    return ""


def act_as_owner(places: Directories) -> None:
    """Root permanently becomes the directories' owner, with the groups that the unit gives.

    Files in them can then do no more than their owner could. Raises PermissionError if somebody else
    could have made them, or they are not this user's.
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


def work_somewhere(places: Directories) -> None:
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

"""`rmf-bridge backup FILE` saves a machine's configuration in one file. `--restore` brings it back.

The backup contains:

- the device YAMLs, with the profiles and maps beside them
- the options of page, exporter and notify
- the page's users with the hashes of their passwords
- the files in which supervisors and coordinators keep their memory for a restart

Any other file that only its owner may read counts as a secret, even a device YAML. The command leaves
secrets out and names them. It also names each service that has no YAML in the backup.

The backup has the content behind a link, because the file behind the link may be in no backup.

A memory is restored only if it is at most FRESH_S old. An older memory may say that a robot holds a
door, although the robot has left. If the daemon restored that hold, it would open the door. If this
machine's clock is behind the memory's time, the memory's age is unknown, so it is left out too.
"""

import argparse
import errno
import os
import stat
import sys
import tarfile
import time
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePath, PurePosixPath
from typing import Final

from bridges.commands import enable
from bridges.runtime.daemons import UNIT
from bridges.runtime.runtime_directory import KEPT
from bridges.runtime.services import CONFIG, add_root, carry_out, not_possible, unit
from bridges.settings.load import Config, SettingsError, load, understood
from bridges.system import files
from bridges.system.directories import SERVICE_STATE
from drivers.profiles import texts

FRESH_S: Final = 3600.0
AHEAD_S: Final = 60.0
"""The time (s) by which a memory may be newer than this machine's clock. Two clocks differ by less."""
MOST_BYTES: Final = 16 << 20
WANTS: Final = Path("etc/systemd/system/rmf-bridges.target.wants")
PAGE_USERS: Final = Path("var/lib/rmf-bridge-page/passwords")
"""The file of the page's users, where docs/how-to/page.md puts it."""
SECRET: Final = 0o077


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `backup`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the backup, a .tar.gz")
    parser.add_argument(
        "--restore", action="store_true", help="write its files here, and enable its services"
    )
    add_root(parser)


def run(args: argparse.Namespace) -> int:
    """Return 0 if all went well, and 65 if a service has no YAML in the backup. Return 66 if FILE is no
    backup, or if it lacks a file that cannot be read. Return 73 if a file cannot be written, 77 if the
    user is not root, and 78 for an invalid YAML."""
    if code := not_possible(args):
        return code
    if not args.restore:
        return _save(args.file, args.root, dry_run=args.dry_run)
    try:
        saved = dict(_read(args.file))
    except (OSError, EOFError, tarfile.TarError, ValueError, zlib.error) as error:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        print(f"{args.file} cannot be restored: {reason}", file=sys.stderr)
        return os.EX_NOINPUT
    return _restore(saved, args)


def _save(file: Path, root: Path, *, dry_run: bool) -> int:
    lost: list[str] = []
    kept: list[Path] = []
    for path in _found(root, lost):
        if why := _unusable(path, root):
            lost.append(f"{path}: {why}")
        elif _is_secret(path, root):
            print(f"left out, as a secret: /{path.relative_to(root)}; copy this file by hand")
        else:
            kept.append(path)
    for reason in lost:
        print(f"NOT saved: {reason}", file=sys.stderr)
    if not kept:
        print(f"nothing to save: there is no file in {root / CONFIG}", file=sys.stderr)
        return os.EX_NOINPUT
    if not dry_run:
        try:
            _write_archive(file, root, kept)
        except OSError as error:
            print(f"{file} cannot be written: {error.strerror}", file=sys.stderr)
            return os.EX_CANTCREAT
    for path in kept:
        print(f"{'to save' if dry_run else 'saved'}: /{path.relative_to(root)}")
    lacks = [one.name for one in kept if _is_ours(one.name) and root / _yaml(one.name) not in kept]
    for name in lacks:
        text = f"the service {name} cannot be restored from this backup, which lacks /{_yaml(name)}"
        print(f"{text}: copy this file by hand", file=sys.stderr)
    return os.EX_NOINPUT if lost else os.EX_DATAERR if lacks else 0


def _write_archive(file: Path, root: Path, kept: Iterable[Path]) -> None:
    """Write a new archive, or leave none. Raises OSError, even if only the file exists already, because
    it may be another backup."""
    opened = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        with (
            open(opened, "wb") as out,
            tarfile.open(fileobj=out, mode="w:gz", dereference=True) as archive,  # no links
        ):
            for path in kept:
                name = str(path.relative_to(root))
                if path.parent == root / WANTS:
                    archive.addfile(tarfile.TarInfo(name))
                else:
                    archive.add(path, name, recursive=False)
    except BaseException:  # Ctrl-C too: half an archive would block the next try
        file.unlink(missing_ok=True)
        raise


def _is_ours(name: str) -> bool:
    """Return whether a unit with this name serves a YAML."""
    return name.startswith(UNIT)


def _yaml(name: str) -> PurePosixPath:
    """Return the YAML of this unit, relative to the root."""
    return PurePosixPath(CONFIG) / f"{name.removeprefix(UNIT).removesuffix('.service')}.yaml"


def _unusable(path: Path, root: Path) -> str:
    """Return the reason why the content of a file cannot be saved; "" if it can. A secret need not be
    readable."""
    if path.parent == root / WANTS:
        return ""
    try:
        found = path.stat()
        inside = root == Path("/") or path.resolve().is_relative_to(root.resolve())
    except OSError as error:
        return str(error.strerror)
    if not stat.S_ISREG(found.st_mode):
        return "it is no regular file"
    if not inside:
        return f"it is a link that leads out of {root}"
    if found.st_size > MOST_BYTES:
        return f"it is larger than {MOST_BYTES >> 20} MiB"
    readable = os.access(path, os.R_OK) or _is_secret(path, root)
    return "" if readable else os.strerror(errno.EACCES)


def _is_secret(path: Path, root: Path) -> bool:
    """Return whether only the owner may read the file. Return False for the file of the page's users,
    and for a daemon's memory, because the backup must contain both."""
    if path.parent.name.endswith(".wants"):
        return False
    return not path.stat().st_mode & SECRET and not _is_private(path.relative_to(root))


def _is_private(path: PurePath) -> bool:
    """Return whether the file belongs to the owner of its folder, and only that owner may read it."""
    return path == PAGE_USERS or path.name == KEPT


def _found(root: Path, lost: list[str]) -> Iterator[Path]:
    """Yield the files to save. Add to `lost` a reason for each file or folder that cannot be saved."""
    yield from _files(root / CONFIG, lost)
    for folder in _entries(root / SERVICE_STATE.relative_to("/"), lost):
        if os.path.isdir(folder):
            yield from (one for one in _entries(folder, lost) if one.name == KEPT)
    users = root / PAGE_USERS
    yield from (one for one in _entries(users.parent, lost) if one == users)
    yield from (one for one in _entries(root / WANTS, lost) if one.match("rmf-bridge*.service"))


def _files(folder: Path, lost: list[str]) -> Iterator[Path]:
    """Yield everything below a folder that is no folder itself."""
    for path in _entries(folder, lost):
        if os.path.isdir(path) and not path.is_symlink():
            yield from _files(path, lost)
        else:
            yield path


def _entries(folder: Path, lost: list[str]) -> list[Path]:
    """Return the entries of a folder in order. If this user may not read it, add this to `lost`."""
    try:
        return sorted(folder.iterdir())
    except FileNotFoundError:
        return []
    except OSError as error:
        lost.append(f"{folder}: {error.strerror}")
        return []


def _read(file: Path) -> Iterator[tuple[PurePosixPath, tuple[bytes, float]]]:
    """Yield the path, content and time of each file in the backup. Raises ValueError for a path that no
    backup contains."""
    with tarfile.open(file) as archive:
        for member in archive:
            path = PurePosixPath(member.name)
            homes = (CONFIG, SERVICE_STATE.relative_to("/"), PAGE_USERS, WANTS)
            if not any(path.is_relative_to(home) for home in homes) or ".." in path.parts:
                raise ValueError(f"{member.name} is no file of a backup")
            if not member.isreg() or member.size > MOST_BYTES:
                raise ValueError(f"{member.name} is no regular file of at most {MOST_BYTES} bytes")
            content = archive.extractfile(member)
            yield path, (content.read() if content else b"", member.mtime)


def _restore(saved: dict[PurePosixPath, tuple[bytes, float]], args: argparse.Namespace) -> int:
    units = [path.name for path in saved if path.is_relative_to(WANTS)]
    lacks = [
        name
        for name in units
        if _is_ours(name) and _yaml(name) not in saved and not (args.root / _yaml(name)).is_file()
    ]
    try:
        configs = [*_configs(saved, units, args.root)]
    except SettingsError as error:
        print("\n".join(map(str, error.problems)), file=sys.stderr)
        return os.EX_CONFIG
    for path, (content, mtime) in saved.items():
        if path.is_relative_to(WANTS) or (path.name == KEPT and not _is_fresh(path, mtime)):
            continue
        if args.dry_run:
            print(f"write /{path}")
        elif code := _write(args.root / path, content, private=_is_private(path)):
            return code
        else:
            print(f"written: /{path}")
    for config in configs:
        steps = enable.steps(config, args.root, enable.groups(args.root))
        if code := carry_out(steps, args, keeps=unit(config.path.stem)):
            return code
    for name in units:
        if not _is_ours(name):
            print(f"enable this service yourself: systemctl enable --now {name}")
    for name in lacks:
        text = f"the service {name} is NOT restored, because the backup lacks /{_yaml(name)}"
        print(f"{text}: copy this file, then run rmf-bridge enable /{_yaml(name)}", file=sys.stderr)
    return os.EX_DATAERR if lacks else 0


def _configs(
    saved: dict[PurePosixPath, tuple[bytes, float]], units: list[str], root: Path
) -> Iterator[Config]:
    """Yield the YAMLs of the enabled services. If the backup lacks a YAML, take the machine's. Raises
    SettingsError for an invalid YAML, before anything is written."""
    beside = {path: content for path, (content, _) in saved.items()}  # perhaps not on this machine
    texts.give({str(at / path): beside[path] for path in beside for at in (Path("/"), root)})
    for path in map(_yaml, filter(_is_ours, units)):
        if path in saved or (root / path).is_file():
            known = path in saved
            config = understood(root / path, beside[path]) if known else load(root / path)
            if problems := enable.site_problems(config, root):
                raise SettingsError(problems)
            yield config


def _is_fresh(path: PurePosixPath, mtime: float) -> bool:
    """Return whether a daemon's memory is at most FRESH_S old. Otherwise print that it is left out, and
    why."""
    age_s = time.time() - mtime
    if age_s < -AHEAD_S:
        print(
            f"left out, because it is newer than this machine's clock, which may be wrong: /{path}"
        )
    elif age_s > FRESH_S:
        print(f"left out, because it is older than {FRESH_S / 3600:g} h: /{path}")
    return -AHEAD_S <= age_s <= FRESH_S


def _write(path: Path, content: bytes, *, private: bool) -> int:
    """Write a file. A `private` file belongs to the owner of the folder, and only that owner may read
    it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        files.replace(path, content)
        path.chmod(0o600 if private else 0o644)
        if private and os.geteuid() == 0:
            owner = path.parent.stat()
            os.chown(path, owner.st_uid, owner.st_gid)
    except OSError as error:
        print(f"{path} cannot be written: {error.strerror}", file=sys.stderr)
        return os.EX_CANTCREAT
    return 0

"""`rmf-bridge enable FILE` makes a YAML a running service.

The command takes these steps:

1. It validates the file together with the files of this machine's other services.
2. It stops a running instance, which switches the instance's outputs off. It must do so before step 5,
   because the new drop-in (systemd's file of settings for one instance) may forbid access to the old
   relay.
3. It makes a user for the instance, and makes this user the owner of the file's secrets.
4. It copies the file to /etc/rmf-bridges. Step 5 follows at once, because the new file may not fit
   the old drop-in. If the file is there already and not everybody may read it, the instance's user
   becomes its owner.
5. It writes the instance's drop-in (`bridges/runtime/drop_in.py`).
6. It starts the instance.

If a step fails, the results of the earlier steps stay. If the instance ran before, the command then
starts it again.
"""

import argparse
import os
import stat
import sys
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from msgspec.structs import replace

from bridges.runtime import drop_in
from bridges.runtime.daemons import persons_daemons
from bridges.runtime.runtime_directory import in_use
from bridges.runtime.services import (
    CONFIG,
    INSTANCE,
    NO_INSTANCE,
    NOTIFY,
    SYSTEMD,
    GiveSecret,
    Run,
    Step,
    WriteFile,
    add_root,
    carry_out,
    drop_in_file,
    make_user,
    numbers,
    switch_off,
    unit,
)
from bridges.settings.cross_file_checks import shared_secrets, taken
from bridges.settings.load import Config, Problem, SettingsError, load
from bridges.settings.named_files import SECRETS, named_files
from bridges.system.directories import GROUPS, SERVICE_FILES, named, user_of

FLEET: Final = "fleet"
BESIDE: Final = f"a fleet's YAML: write whole paths, or copy both files of RMF to /{CONFIG}"
RESERVED: Final = (
    f"/{CONFIG}/{NOTIFY}.yaml has the recipients of rmf-bridge {NOTIFY}, so no service can have this"
    " name: rename {}"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `enable`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML")
    parser.add_argument(
        "--no-start", action="store_true", help="write and enable the service without starting it"
    )
    parser.add_argument("--drop-in", action="store_true", help="only print the service's drop-in")
    add_root(parser)


def run(args: argparse.Namespace) -> int:
    """Return 0 if the service runs, 78 for an invalid file, and 77 if the user is not root."""
    if not INSTANCE.fullmatch(args.file.stem):
        print(NO_INSTANCE.format(args.file.stem), file=sys.stderr)
        return os.EX_CONFIG
    # An upgrade still renews the drop-in of a service that an older version has enabled.
    if args.file.stem == NOTIFY and not args.drop_in:
        print(RESERVED.format(args.file), file=sys.stderr)
        return os.EX_CONFIG
    try:
        config = load(args.file)
    except SettingsError as error:
        return _wrong(error.problems)
    if problems := list(_taken(config, args.root)):
        return _wrong(problems)
    if of_site := site_problems(config, args.root):
        return _wrong([*of_site, BESIDE])
    if args.drop_in:
        user = user_of(args.file.stem)
        known = user if user in numbers(args.root / "etc/passwd") else ""
        print(drop_in.text(config, groups(args.root), known), end="")
        return 0
    if args.root == Path("/") and (told := runs_by_hand(config)):
        print(told, file=sys.stderr)
        return os.EX_UNAVAILABLE
    for problem in config.warnings:
        print(problem, file=sys.stderr)
    planned = steps(config, args.root, groups(args.root))
    last = "start" if args.no_start else None
    taken = (s for s in planned if not (isinstance(s, Run) and s.words[1] == last))
    return carry_out(taken, args, keeps=unit(config.path.stem))


def steps(config: Config, root: Path, present: Collection[str]) -> Iterator[Step]:
    """Yield the steps that make a service of this file, in order. `present`: the groups that this
    machine has."""
    name = config.path.stem
    user = user_of(name)
    target = root / CONFIG / f"{name}.yaml"
    yield Run(("systemctl", "stop", unit(name)), running_only=True)
    yield switch_off(name)
    yield make_user(name)
    for secret in _secrets(config, root):
        yield GiveSecret(secret, user)
    if not target.exists() or not target.samefile(config.path):
        yield WriteFile(target, config.text, config.path)
    elif not target.is_symlink() and not target.stat().st_mode & stat.S_IROTH:  # it has a secret
        yield GiveSecret(target, user)
    yield WriteFile(root / drop_in_file(name), drop_in.text(config, present, user).encode())
    yield Run(("systemctl", "daemon-reload"), running_only=True)
    yield Run(("systemctl", "enable", "rmf-bridges.target", unit(name)))
    yield Run(("systemctl", "start", unit(name)), running_only=True)


def runs_by_hand(config: Config) -> str:
    """Return an error if a person's daemon serves this file, because a device can have only one daemon.
    Return "" if this user sees no such daemon. A user other than root does not see the daemons of other
    users, and nobody sees a daemon with `--runtime-dir`."""
    files = {named(config.path), named(SERVICE_FILES / f"{config.path.stem}.yaml")}
    return next((in_use(*found) for found in persons_daemons(files)), "")


def groups(root: Path) -> set[str]:
    """Return the groups of this machine that a service may join."""
    return set(numbers(root / "etc/group")) & set(GROUPS)


def _secrets(config: Config, root: Path) -> Iterator[Path]:
    """Yield the secret files that exist. Leave out symbolic links, because a link may later lead to
    another file."""
    for _, secret in named_files(config, SECRETS):
        path = root / secret.lstrip("/")
        if path.is_file() and not path.is_symlink():
            yield path


def _taken(config: Config, root: Path) -> Iterator[Problem | str]:
    """Yield a problem for each resource or secret that this file shares with another service's file.
    Yield advice if that service is disabled."""
    enabled = {link.name for link in (root / SYSTEMD).glob("*.wants/*")}
    for other in _neighbours(root, config.path.stem):
        found = [*taken([other, config]), *shared_secrets([other, config])]
        yield from found
        if found and unit(other.path.stem) not in enabled:
            yield f"{other.path.stem} is disabled: if it is no longer used, move {other.path} away"


def site_problems(config: Config, root: Path) -> list[Problem]:
    """Return the problems of the RMF files that a fleet's YAML names, if the YAML is in
    /etc/rmf-bridges. `enable` copies the YAML there, and relative paths begin at the YAML's folder."""
    if config.kind != FLEET:
        return []
    from bridges.settings.fleet_site import read_site

    def below_root(file: str) -> str:
        return str(root / file.lstrip("/")) if file.startswith("/") else file

    section = config.section
    names = {key: below_root(getattr(section, key)) for key in ("config", "graph")}
    path = root / CONFIG / f"{config.path.stem}.yaml"
    try:
        read_site(replace(config, path=path, section=replace(section, **names)))
    except SettingsError as error:
        return list(error.problems)
    return []


def _neighbours(root: Path, name: str) -> Iterator[Config]:
    """Yield the valid files of the other services."""
    for file in sorted((root / CONFIG).glob("*.yaml")):
        if file.stem != name:
            with suppress(SettingsError):
                yield load(file)


def _wrong(problems: Iterable[Problem | str]) -> int:
    for problem in problems:
        print(problem, file=sys.stderr)
    return os.EX_CONFIG

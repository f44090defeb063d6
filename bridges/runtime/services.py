"""The steps with which `enable` and `disable` change a system. With `--dry-run` the steps are only
printed."""

import argparse
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Final

from bridges.runtime.daemons import UNIT, units
from bridges.runtime.record import PATTERN
from bridges.system.directories import (
    SERVICE_FILES,
    SERVICE_RUN,
    SERVICE_STATE,
    SERVICE_USER,
    user_of,
)
from bridges.system.files import replace

CONFIG: Final = SERVICE_FILES.relative_to("/")
SYSTEMD: Final = Path("etc/systemd/system")
INSTANCE: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
"""The pattern of a service's name. It allows only characters that systemd does not escape."""
NOTIFY: Final = "notify"
"""The name that no new service may have. `/etc/rmf-bridges/notify.yaml` has the recipients of
`rmf-bridge-notify.service`."""
NO_INSTANCE: Final = "{!r} is not a service name: use only letters, digits and _ . -"
NO_SYSTEMD: Final = (
    "{} is missing, and this command needs systemd. Without systemd, start the daemon with"
    " rmf-bridge run FILE"
)
LEFT_ON: Final = (
    "the outputs of {} are not verified off, and a new drop-in may block access to them: mend the"
    " device and try again. If the device will not answer again, cut its relays' supply, then: rm {}"
)


def add_root(parser: argparse.ArgumentParser) -> None:
    """Add the options of `enable` and `disable`."""
    parser.add_argument(
        "--root", type=Path, default=Path("/"), metavar="DIR", help="the folder of a mounted system"
    )
    parser.add_argument("--dry-run", action="store_true", help="only print the steps")


def service_name(text: str) -> str:
    """Return the name of the service that a person means: `my.lift` for `my.lift`, and for the YAML
    `config/my.lift.yaml`."""
    return re.sub(r"\.ya?ml$", "", PurePath(text).name)


def services(root: Path = Path("/")) -> set[str]:
    """Return the names of this machine's services. Each has a YAML in /etc/rmf-bridges (other than the
    recipients of `notify`), a file of systemd, a record of claimed outputs, or, if the system runs, a
    systemd unit."""
    system = root / SYSTEMD
    links = {*system.glob(f"*.wants/{UNIT}*.service"), *system.glob(f"{UNIT}*.service.d")}
    names = {link.name.removesuffix(".d")[len(UNIT) :].removesuffix(".service") for link in links}
    names |= {file.stem for file in (root / CONFIG).glob("*.yaml")} - {NOTIFY}
    records = (root / SERVICE_STATE.relative_to("/")).glob(f"*/{PATTERN}")
    names |= {record.parent.name for record in records}
    return names | set(units()) if root == Path("/") else names


def unit(name: str) -> str:
    """Return the full name of the service's unit."""
    return f"{UNIT}{name}.service"


def drop_in_file(name: str) -> Path:
    """Return the path of the service's drop-in, relative to the root."""
    return SYSTEMD / f"{unit(name)}.d/10-enable.conf"


@dataclass(frozen=True, slots=True)
class Run:
    """A step that runs a command. `running_only`: skip this step if the system is only mounted and does
    not run."""

    words: tuple[str, ...]
    running_only: bool = False


@dataclass(frozen=True, slots=True)
class SwitchOff:
    """A step that runs `outputs-off` for a service. The step does nothing if no dead daemon has left a
    record of claimed outputs."""

    words: tuple[str, ...]
    state: Path


@dataclass(frozen=True, slots=True)
class WriteFile:
    """A step that writes a file, which everybody may read. `source`: the file that this step copies, or
    None."""

    path: Path
    content: bytes
    source: Path | None = None


@dataclass(frozen=True, slots=True)
class GiveSecret:
    """A step that makes this user the owner of a secret file, which only its owner may read."""

    path: Path
    user: str


@dataclass(frozen=True, slots=True)
class Remove:
    """A step that removes a file. The step also removes the file's directory if it is then empty."""

    path: Path


Step = Run | SwitchOff | WriteFile | GiveSecret | Remove


def make_user(name: str) -> Run:
    """Return the step that makes the service's own user, if this user does not exist yet. The user's
    group is common to all services, and its members may read the files of every service."""
    home = SERVICE_STATE / name
    line = f'u {user_of(name)} -:{SERVICE_USER} "Open-RMF bridge {name}" {home} /usr/sbin/nologin'
    return Run(("systemd-sysusers", "--inline", f"g {SERVICE_USER} -", line))


def numbers(table: Path) -> dict[str, int]:
    """Return the id number of each user or group in a system's table; {} without a table."""
    with suppress(OSError):
        rows = (line.split(":") for line in table.read_text("utf-8", "replace").splitlines())
        return {row[0]: int(row[2]) for row in rows if len(row) > 2 and row[2].isdecimal()}
    return {}


def switch_off(name: str) -> SwitchOff:
    """Return the step that switches off the outputs which a dead daemon left on."""
    words = ("-P", "-m", "bridges.cli", "outputs-off", f"/{CONFIG}/{name}.yaml")
    return SwitchOff((sys.executable, *words), SERVICE_STATE / name)


def carry_out(steps: Iterable[Step], args: argparse.Namespace, keeps: str = "") -> int:
    """Carry out or print the steps in order, until a step fails. Return the exit code.

    `keeps`: a systemd unit. If it ran before and a step fails, it is started again.
    """
    if code := not_possible(args):
        return code
    live = args.root == Path("/")
    ran = keeps and live and not args.dry_run and _did(("systemctl", "--quiet", "is-active", keeps))
    for step in steps:
        if not live and (
            isinstance(step, SwitchOff) or (isinstance(step, Run) and step.running_only)
        ):
            continue
        if args.dry_run:
            _show(step)
        elif code := _take(step, args.root):
            print("the steps after the failed step were not taken", file=sys.stderr)
            if ran:
                _did(("systemctl", "start", keeps))
            return code
    return 0


def not_possible(args: argparse.Namespace) -> int:
    """Return 77 if only root may change this system, and 66 if the folder of `--root` is missing.
    Otherwise return 0."""
    if args.root == Path("/") and not args.dry_run and os.geteuid() != 0:
        print("only root may do that: use sudo, or --dry-run to see the steps", file=sys.stderr)
        return os.EX_NOPERM
    if not args.root.is_dir():
        print(f"{args.root} is not a folder: is the card mounted?", file=sys.stderr)
        return os.EX_NOINPUT
    return 0


def _did(words: Sequence[str]) -> bool:
    try:
        return subprocess.run(words).returncode == 0
    except OSError:
        return False


def _show(step: Step) -> None:
    match step:
        case Run(words):
            print(shlex.join(words))
        case SwitchOff(words, state):
            print(f"{shlex.join(words)}   # if a dead daemon left a record in {state}")
        case WriteFile(path, _, source) if source:
            print(shlex.join(["install", "-m", "644", str(source), str(path)]))
        case WriteFile(path, content):
            print(f"write {path}:")
            print("".join(f"    {line}\n" for line in content.decode().splitlines()), end="")
        case GiveSecret(path, user):
            print(shlex.join(["chown", user, str(path)]))
        case Remove(path):
            print(f"rm {path}")


def _take(step: Step, root: Path) -> int:
    """Carry out one step. Return its exit code, which is 0 on success."""
    try:
        return _taken(step, root)
    except OSError as error:  # for example a full disk
        print(error, file=sys.stderr)
        return os.EX_IOERR


def _taken(step: Step, root: Path) -> int:
    match step:
        case Run(words):
            where = [] if root == Path("/") else [f"--root={root}"]
            try:
                return subprocess.run([words[0], *where, *words[1:]]).returncode
            except FileNotFoundError:
                print(NO_SYSTEMD.format(words[0]), file=sys.stderr)
                return 1
        case SwitchOff(words, state):
            return _off(words, state)
        case WriteFile(path, content):
            path.parent.mkdir(parents=True, exist_ok=True)
            replace(path, content)
            path.chmod(0o644)
        case GiveSecret(path, user):
            known = numbers(root / "etc/passwd")
            if user not in known:
                raise OSError(f"{root / 'etc/passwd'} has no user {user}")
            os.chown(path, known[user], -1, follow_symlinks=False)
        case Remove(path):
            path.unlink(missing_ok=True)
            if path.parent.is_dir() and not any(path.parent.iterdir()):
                path.parent.rmdir()
    return 0


def _off(words: tuple[str, ...], state: Path) -> int:
    left = sorted(state.glob(PATTERN))
    places = {"RUNTIME_DIRECTORY": str(SERVICE_RUN / state.name), "STATE_DIRECTORY": str(state)}
    if not left or subprocess.run(words, env=os.environ | places).returncode == 0:
        return 0
    print(LEFT_ON.format(state.name, shlex.join(map(str, left))), file=sys.stderr)
    return os.EX_UNAVAILABLE

"""What `enable` and `disable` do to a system, step by step; `--dry-run` prints the same steps."""

import argparse
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridges.host.directories import SERVICE_STATE
from bridges.host.files import replace
from bridges.runtime.record import PATTERN

CONFIG: Final = Path("etc/rmf-bridges")
INSTANCE: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
"""What a unit's instance may be called without escapes."""
NO_INSTANCE: Final = "{!r} is not a service name: use only letters, digits and _ . -"
LEFT_ON: Final = (
    "what {} had claimed is not verified off, and another drop-in may not let it be reached: mend"
    " that and try again. If that hardware is gone, cut its supply, then: rm {}"
)


def add_root(parser: argparse.ArgumentParser) -> None:
    """The options of `enable` and `disable`."""
    parser.add_argument(
        "--root", type=Path, default=Path("/"), metavar="DIR", help="a system that is not running"
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="print what it would do, and no more"
    )


def unit(name: str) -> str:
    """The service of this name."""
    return f"rmf-bridge@{name}.service"


def drop_in_file(name: str) -> Path:
    """Where the service's drop-in is, below the root."""
    return Path(f"etc/systemd/system/{unit(name)}.d/10-enable.conf")


@dataclass(frozen=True, slots=True)
class Run:
    """A command. `running_only`: it means nothing to a system that is not running."""

    words: tuple[str, ...]
    running_only: bool = False


@dataclass(frozen=True, slots=True)
class SwitchOff:
    """`outputs-off` of a service, if a dead daemon has left a record in its directory."""

    words: tuple[str, ...]
    state: Path


@dataclass(frozen=True, slots=True)
class WriteFile:
    """A file with this content, which everybody may read; a copy of `source` if there is one."""

    path: Path
    content: bytes
    source: Path | None = None


@dataclass(frozen=True, slots=True)
class Remove:
    """A file that is to go, and its directory if it is empty then."""

    path: Path


Step = Run | SwitchOff | WriteFile | Remove


def switch_off(name: str) -> SwitchOff:
    """Switch off what a service has left on."""
    words = ("-P", "-m", "bridges.cli", "outputs-off", f"/{CONFIG}/{name}.yaml")
    return SwitchOff((sys.executable, *words), SERVICE_STATE / name)


def carry_out(steps: Iterable[Step], args: argparse.Namespace, keeps: str = "") -> int:
    """Take the steps in turn, up to the first that fails; or print them. Returns the exit code.

    `keeps`: a unit that is started again after a step that has failed, if it ran before.
    """
    live = args.root == Path("/")
    if live and not args.dry_run and os.geteuid() != 0:
        print("only root may do that: use sudo, or --dry-run to see it", file=sys.stderr)
        return os.EX_NOPERM
    if not args.root.is_dir():
        print(f"{args.root} is not a folder: is the card mounted?", file=sys.stderr)
        return os.EX_NOINPUT
    ran = keeps and live and not args.dry_run and _did(("systemctl", "--quiet", "is-active", keeps))
    for step in steps:
        if not live and (
            isinstance(step, SwitchOff) or (isinstance(step, Run) and step.running_only)
        ):
            continue
        if args.dry_run:
            _show(step)
        elif code := _take(step, args.root):
            print("the steps after that were not taken", file=sys.stderr)
            if ran:
                _did(("systemctl", "start", keeps))
            return code
    return 0


def _did(words: Sequence[str]) -> bool:
    return subprocess.run(words).returncode == 0


def _show(step: Step) -> None:
    match step:
        case Run(words):
            print(shlex.join(words))
        case SwitchOff(words, state):
            print(f"{shlex.join(words)}   # if a record is left in {state}")
        case WriteFile(path, _, source) if source:
            print(shlex.join(["install", "-m", "644", str(source), str(path)]))
        case WriteFile(path, content):
            print(f"write {path}:")
            print("".join(f"    {line}\n" for line in content.decode().splitlines()), end="")
        case Remove(path):
            print(f"rm {path}")


def _take(step: Step, root: Path) -> int:
    """Returns 0 if it succeeded."""
    try:
        return _taken(step, root)
    except OSError as error:  # a full disk
        print(error, file=sys.stderr)
        return os.EX_IOERR


def _taken(step: Step, root: Path) -> int:
    match step:
        case Run(words):
            where = [] if root == Path("/") else [f"--root={root}"]
            return subprocess.run([words[0], *where, *words[1:]]).returncode
        case SwitchOff(words, state):
            return _off(words, state)
        case WriteFile(path, content):
            path.parent.mkdir(parents=True, exist_ok=True)
            replace(path, content)
            path.chmod(0o644)
        case Remove(path):
            path.unlink(missing_ok=True)
            if path.parent.is_dir() and not any(path.parent.iterdir()):
                path.parent.rmdir()
    return 0


def _off(words: tuple[str, ...], state: Path) -> int:
    left = sorted(state.glob(PATTERN))
    if not left or subprocess.run(words).returncode == 0:
        return 0
    print(LEFT_ON.format(state.name, shlex.join(map(str, left))), file=sys.stderr)
    return os.EX_UNAVAILABLE

"""Installs a wheel and its requirements for another machine: python deb/wheels.py --help.

pip can fetch wheels of another platform. But pip evaluates the conditions of requirements (`;
platform_machine == ...`) for the machine on which pip itself runs. Therefore this script works in
rounds. Each round finds the requirements that the target machine still lacks, and fetches them with
pip. The lock file gives the version of each requirement. The SHA-256 of the fetched file must be in the
lock file too.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Collection, Iterable, Iterator
from importlib.metadata import Distribution, distributions
from pathlib import Path

from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}
GLIBC = (34, 31, 28, 27, 24, 17)
"""Minor versions of glibc in manylinux tags. Debian 12 has glibc 2.36. A wheel runs with the glibc
version in its tag, and with newer versions."""

Without = Collection[tuple[str, ...]]
"""Pairs of a distribution and a requirement. The distribution declares this requirement, but does not
need it."""


def main() -> int:
    """Fetch until no requirement is missing. Return 1 if the result does not meet a requirement."""
    args = _arguments()
    machine = {
        **default_environment(),
        "python_version": args.python,
        "python_full_version": f"{args.python}.0",
        "platform_machine": MACHINES[args.arch],
    }
    _fetch([str(args.wheel)], args)
    extras = {canonicalize_name(args.wheel.name.split("-")[0]): tuple(args.extra)}
    without = {tuple(each.split(":")) for each in args.without}
    lock = None if args.lock is None else _locked(args.lock.read_text(), machine)
    while missing := dict(_missing(args.target, machine, extras, without)):
        built = {name: wheel for name in missing for wheel in _built(name, args)}
        left = [name for name in sorted(missing) if name not in built]
        if unknown := [name for name in left if lock is not None and name not in lock]:
            print(f"{args.lock} lacks {', '.join(unknown)}: make lock", file=sys.stderr)
            return 1
        _fetch(map(str, built.values()), args)
        found = missing if lock is None else lock
        _fetch([f"{found[name]}\n" for name in left], args, listed=True)
    wrong = sorted(set(_wrong(args.target, machine, extras, without)))
    print(*wrong, sep="\n", file=sys.stderr)
    return 1 if wrong else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "wheel", type=Path, help="the wheel to begin with, or a distribution's name"
    )
    parser.add_argument("--target", type=Path, required=True, help="the site-packages to fill")
    parser.add_argument(
        "--lock",
        type=Path,
        help="versions and hashes (`make lock`); without a lock, the newest version that fits",
    )
    parser.add_argument("--built", type=Path, help="a directory of wheels that were built here")
    parser.add_argument("--arch", choices=MACHINES, required=True)
    parser.add_argument("--python", required=True, help="such as 3.11")
    parser.add_argument("--extra", action="append", default=[], help="an extra of the wheel")
    parser.add_argument(
        "--without",
        action="append",
        default=[],
        metavar="BY:NEED",
        help="a requirement that a distribution declares, but does not need on the target",
    )
    return parser.parse_args()


def _locked(text: str, machine: dict[str, str]) -> dict[str, str]:
    """Return a mapping from each name to its lines in the lock file, for the target machine."""
    found = {}
    for entry in re.split(r"\n(?=\S)", text):
        if entry and not entry.startswith("#"):
            need = Requirement(entry.partition("\\")[0])
            if need.marker is None or need.marker.evaluate(machine | {"extra": ""}):
                hashes = re.findall(r"--hash=\S+", entry)
                found[canonicalize_name(need.name)] = (
                    f"{need.name}{need.specifier} {' '.join(hashes)}"
                )
    return found


def _built(name: str, args: argparse.Namespace) -> list[Path]:
    """Return the wheel of this distribution that was built on this machine for the target."""
    wheels = [] if args.built is None else sorted(args.built.glob("*.whl"))
    return [
        wheel
        for wheel in wheels
        if canonicalize_name(wheel.name.split("-")[0]) == name
        and wheel.name.endswith(("-any.whl", f"_{MACHINES[args.arch]}.whl"))
    ]


def _fetch(what: Iterable[str], args: argparse.Namespace, listed: bool = False) -> None:
    """Install these distributions without their requirements. `what` has wheel files. With `listed`,
    `what` has lines of a requirements file.

    If one line has a hash, pip demands a hash for every line.
    """
    if not (what := list(what)):
        return
    machine = MACHINES[args.arch]
    platforms = [f"manylinux_2_{minor}_{machine}" for minor in GLIBC] + [f"manylinux2014_{machine}"]
    options = [word for platform in platforms for word in ("--platform", platform)]
    options += ["--python-version", args.python, "--implementation", "cp", "--abi"]
    options += [f"cp{args.python.replace('.', '')}", "--abi", "abi3", "--abi", "none"]
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    with tempfile.TemporaryDirectory() as closed:  # pip skips packages that exist in part
        fresh = f"{closed}/fresh"  # open to all users, because a daemon's user must read the copy
        place = ["--no-deps", "--no-compile", "--only-binary", ":all:", "--target", fresh]
        if listed:
            (lines := Path(closed, "lock.txt")).write_text("".join(what))
            what = ["--requirement", str(lines), *(["--require-hashes"] if args.lock else [])]
        subprocess.run([*pip, *place, *options, *what], check=True)
        shutil.copytree(fresh, args.target, dirs_exist_ok=True)


def _needed(
    target: Path, machine: dict[str, str], extras: dict[str, tuple[str, ...]], without: Without
) -> Iterator[Requirement]:
    """Yield the requirements of the distributions in the target, on the target's machine."""
    for found in distributions(path=[str(target)]):
        asked = extras.get(canonicalize_name(found.name), ())
        for text in found.requires or ():
            need = Requirement(text)
            if (canonicalize_name(found.name), canonicalize_name(need.name)) in without:
                continue
            given = [machine | {"extra": extra} for extra in ("", *asked)]
            if need.marker is None or any(map(need.marker.evaluate, given)):
                extras[canonicalize_name(need.name)] = (
                    *extras.get(canonicalize_name(need.name), ()),
                    *need.extras,
                )
                yield need


def _there(target: Path) -> dict[str, Distribution]:
    return {canonicalize_name(found.name): found for found in distributions(path=[str(target)])}


def _missing(
    target: Path, machine: dict[str, str], extras: dict[str, tuple[str, ...]], without: Without
) -> Iterator[tuple[str, str]]:
    """Yield each missing requirement as its name and version."""
    there = _there(target)
    for need in _needed(target, machine, extras, without):
        if (name := canonicalize_name(need.name)) not in there:
            yield name, f"{need.name}{need.specifier}"


def _wrong(
    target: Path, machine: dict[str, str], extras: dict[str, tuple[str, ...]], without: Without
) -> Iterator[str]:
    """Yield requirements that the installed version does not meet. This happens if two packages want
    different versions of a third."""
    there = _there(target)
    for need in _needed(target, machine, extras, without):
        version = there[canonicalize_name(need.name)].version
        if not need.specifier.contains(version, prereleases=True):
            yield f"{need} is not met by {version}"


if __name__ == "__main__":
    sys.exit(main())

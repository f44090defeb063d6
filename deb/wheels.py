"""Installs a wheel and its requirements for another machine: python deb/wheels.py --help.

pip can fetch wheels of another platform, but judges conditions (`; platform_machine == ...`) by the
machine that it runs on. So each round of this script finds the requirements still missing for the
target machine, and fetches them with pip.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Collection, Iterator
from importlib.metadata import Distribution, distributions
from pathlib import Path

from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}
GLIBC = (34, 31, 28, 27, 24, 17)
"""Minor versions in manylinux tags: Debian 12 has 2.36. A tag means that version or a newer version."""

Without = Collection[tuple[str, ...]]
"""Pairs of a distribution and a requirement that it declares but does not need."""


def main() -> int:
    """Fetch until nothing is missing. Return 1 if the result does not meet a requirement."""
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
    while missing := sorted(set(_missing(args.target, machine, extras, without))):
        _fetch(missing, args)
    wrong = sorted(set(_wrong(args.target, machine, extras, without)))
    print(*wrong, sep="\n", file=sys.stderr)
    return 1 if wrong else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "wheel", type=Path, help="the wheel to begin with, or a distribution's name"
    )
    parser.add_argument("--target", type=Path, required=True, help="the site-packages to fill")
    parser.add_argument("--find-links", type=Path, required=True, help="a directory of more wheels")
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


def _fetch(what: list[str], args: argparse.Namespace) -> None:
    """Install these without their requirements."""
    machine = MACHINES[args.arch]
    platforms = [f"manylinux_2_{minor}_{machine}" for minor in GLIBC] + [f"manylinux2014_{machine}"]
    options = [word for platform in platforms for word in ("--platform", platform)]
    options += ["--python-version", args.python, "--implementation", "cp", "--abi"]
    options += [f"cp{args.python.replace('.', '')}", "--abi", "abi3", "--abi", "none"]
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    with tempfile.TemporaryDirectory() as closed:  # pip leaves out a package that is partly there
        fresh = f"{closed}/fresh"  # open to all users, as a daemon's user must read the copy
        place = ["--no-deps", "--no-compile", "--only-binary", ":all:", "--target", fresh]
        subprocess.run(
            [*pip, "--find-links", str(args.find_links), *place, *options, *what], check=True
        )
        shutil.copytree(fresh, args.target, dirs_exist_ok=True)


def _needed(
    target: Path, machine: dict[str, str], extras: dict[str, tuple[str, ...]], without: Without
) -> Iterator[Requirement]:
    """Yield what the distributions in the target require on the target's machine."""
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
) -> Iterator[str]:
    there = _there(target)
    for need in _needed(target, machine, extras, without):
        if canonicalize_name(need.name) not in there:
            yield f"{need.name}{need.specifier}"


def _wrong(
    target: Path, machine: dict[str, str], extras: dict[str, tuple[str, ...]], without: Without
) -> Iterator[str]:
    """Yield requirements unmet by the installed version: two packages want different versions."""
    there = _there(target)
    for need in _needed(target, machine, extras, without):
        version = there[canonicalize_name(need.name)].version
        if not need.specifier.contains(version, prereleases=True):
            yield f"{need} is not met by {version}"


if __name__ == "__main__":
    sys.exit(main())

"""`make test-vm` boots the machine and prints a line for each check.

The exit code is 1 if a check failed, and 69 if no check ran.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tarfile
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

from tests.vm.image import Unusable, image, needed
from tests.vm.machine import ARCHS, Machine, accelerated
from tests.vm.order import ALSO, CUT, CUT_OFF, NOT_ON, PARTS, REBOOT, WHOLE
from tests.vm.suite import suite

RESTARTS: dict[str, Callable[[Machine], None]] = {
    CUT: Machine.cut_power,
    REBOOT: lambda machine: machine.restarts("boots.reboot"),
    CUT_OFF: lambda machine: machine.restarts(CUT_OFF),
}
ROOT = Path(__file__).parents[2]
CACHE = ROOT / "build/vm"
NEXT = "next"
"""The folder of the next version's packages, below the folder of packages (`guest/upgrades.py`)."""


def main() -> int:
    """Build what is missing, then run the checks. A whole run uses one machine for each part, all at
    once."""
    args = _arguments()
    folder = CACHE / f"last-{args.arch}"
    folder.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    try:
        booted = image(args.arch, CACHE)
        kvm = accelerated(args.arch, booted)
        print(f"{args.arch} on {'KVM' if kvm else 'TCG, a core of 1,000 MIPS'}", flush=True)
        shared = {"checks": Path(__file__).parent, "packages": _packages(args.arch, folder)}
        if any(arch == args.arch for arch, _ in ALSO):
            shared["suite"] = suite(args.arch, ROOT, folder)

        def part(name: str) -> int:
            machine = Machine(args.arch, booted, kvm, shared, folder / name)
            with closing(machine):
                return _run(machine, _steps(args.arch, name), folder / f"{name}.log")

        names = [args.only] if args.only else WHOLE
        with ThreadPoolExecutor(len(names)) as pool:
            failed = sum(pool.map(part, names))
    except Unusable as error:
        print(error, file=sys.stderr)
        return os.EX_UNAVAILABLE
    print(f"{failed} checks failed; {time.monotonic() - began:.0f} s; the logs are in {folder}")
    return 1 if failed else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.vm", description=__doc__)
    parser.add_argument("--arch", choices=ARCHS, default="amd64")
    parser.add_argument("--only", choices=PARTS, default="", help="a part")
    return parser.parse_args()


def _steps(arch: str, part: str) -> list[str]:
    there = [step for step in PARTS[part] if step not in NOT_ON.get(arch, ())]
    return [*there, *ALSO.get((arch, part), ())]


def _packages(arch: str, folder: Path) -> Path:
    """Return a folder with the packages of this architecture for Debian 13. Raises Unusable."""
    found = sorted((ROOT / "dist").glob(f"*+deb13_{arch}.deb"))
    if not found:
        raise Unusable(f"the package is missing; build it: make deb ARCHS={arch} PYTHONS=3.13")
    packages = folder / "packages"
    shutil.rmtree(packages, ignore_errors=True)
    (packages / NEXT).mkdir(parents=True)
    for each in found:
        os.link(each, packages / each.name)
        if not each.name.startswith("rmf-bridges-page_"):
            _as_next(each, packages / NEXT)
    return packages


def _as_next(package: Path, folder: Path) -> None:
    """Make the same package with the next version, for the upgrade. Raises Unusable."""
    needed({"dpkg-deb": "dpkg"})
    tree = folder / "tree"
    subprocess.run(["dpkg-deb", "--raw-extract", str(package), str(tree)], check=True)
    name, version, _ = package.name.split("_")
    for file in (tree / "DEBIAN").iterdir():
        file.write_text(file.read_text().replace(version, f"{version}.1"))
    if name == "rmf-bridges":
        _with_a_new_module(tree / "usr/lib/rmf-bridges/tree.tar.xz", folder / "unpacked")
    else:
        place = tree / "usr/lib" / name / version
        place.rename(f"{place}.1")
    words = ["dpkg-deb", "--root-owner-group", "-Znone", "--build", str(tree), str(folder)]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    shutil.rmtree(tree)


def _with_a_new_module(archive: Path, folder: Path) -> None:
    """Pack the same tree again, with an `outputs-off` that needs a module. The version before lacks
    that module."""
    with tarfile.open(archive) as packed:
        packed.extractall(folder, filter="tar")
    (package,) = folder.glob("lib/python*/site-packages/bridges")
    (package / "added.py").touch()
    command = package / "commands/outputs_off.py"
    command.write_text(
        command.read_text().replace("import os\n", "import os\nimport bridges.added\n")
    )
    subprocess.run(
        ["tar", "-C", folder, "--owner=0", "--group=0", "-cf", archive, "-I", "xz -0", "."],
        check=True,
    )
    shutil.rmtree(folder)


def _run(machine: Machine, steps: Iterable[str], log: Path) -> int:
    """Take every step, and return the number of failed checks."""
    failed = 0
    with log.open("w") as out:
        for step in steps:
            began = time.monotonic()
            if step in RESTARTS:
                RESTARTS[step](machine)
                line = f"      {time.monotonic() - began:6.1f} s  ({step}; the host's time)"
            else:
                result = machine.check(step)
                failed += not result["passed"]
                line = _line(step, result)
                out.write(result["log"])
            print(line, flush=True)
            out.write(f"{line}\n\n")
            out.flush()
    return failed


def _line(step: str, result: dict[str, Any]) -> str:
    mark = "ok" if result["passed"] else "FAIL"
    says = result.get("says", "").rstrip(".")
    return f"{mark:4}  {result.get('took_s', 0.0):6.1f} s  {step}: {says}: {result['found']}"


if __name__ == "__main__":
    sys.exit(main())

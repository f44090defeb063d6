"""`make test-vm` boots the machine and prints a line for each check.

The exit code is 1 if a check failed, and 69 if no check ran.
"""

import argparse
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

from tests.deb.next_version import bridges_in, next_version
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
"""The subfolder for the packages of the next version. It lies in the folder that `_packages`
returns."""


def main() -> int:
    """Build all missing files, then run the checks. A run without `--only` has several parts. Each part
    runs on its own machine, and all parts run at the same time."""
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
    parser.add_argument("--only", choices=PARTS, default="", help="run only this part")
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
    needed({"dpkg-deb": "dpkg"})
    for each in found:
        os.link(each, packages / each.name)
        if not each.name.startswith("rmf-bridges-page_"):
            next_version(each, packages / NEXT, f"{each.stem.split('_')[1]}.1", _with_a_new_module)
    return packages


def _with_a_new_module(tree: Path) -> None:
    """Change the new version so that `outputs-off` imports a module that the old version does not
    have."""
    with bridges_in(tree) as package:
        (package / "added.py").touch()
        command = package / "commands/outputs_off.py"
        text = command.read_text().replace("import os\n", "import os\nimport bridges.added\n")
        command.write_text(text)


def _run(machine: Machine, steps: Iterable[str], log: Path) -> int:
    """Run all steps. Return the number of failed checks."""
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

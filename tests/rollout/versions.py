"""Makes further versions of built packages: one that serves, and one whose daemons cannot start."""

import shutil
import subprocess
import tarfile
from pathlib import Path
from typing import Final

BROKEN: Final = 'raise SystemExit("this version cannot start")\n'
"""The program `run` of the broken version. `check` still works, so that the package installs."""


def another(package: Path, out: Path, old: str, new: str, broken: bool) -> None:
    """Build this package again in the folder `out` with the version `new`."""
    tree = out / "tree"
    subprocess.run(["dpkg-deb", "--raw-extract", str(package), str(tree)], check=True)
    for file in (tree / "DEBIAN").iterdir():
        file.write_text(file.read_text().replace(old, new))
    name = package.name.split("_")[0]
    if name == "rmf-bridges":
        if broken:
            _break(tree / "usr/lib/rmf-bridges/tree.tar.xz", out / "unpacked")
    else:
        (tree / "usr/lib" / name / old).rename(tree / "usr/lib" / name / new)
    deb = out / package.name.replace(old, new)
    words = ["dpkg-deb", "--root-owner-group", "-Znone", "--build", str(tree), str(deb)]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    shutil.rmtree(tree)


def _break(archive: Path, folder: Path) -> None:
    with tarfile.open(archive) as packed:
        packed.extractall(folder, filter="tar")
    (command,) = folder.glob("lib/python*/site-packages/bridges/commands/run.py")
    text = command.read_text()
    start = text.index("def run(")
    body = text.index("\n    ", start) + 1
    command.write_text(text[:body] + "    " + BROKEN + text[body:])
    words = [
        "tar",
        "-C",
        str(folder),
        "--owner=0",
        "--group=0",
        "-cf",
        str(archive),
        "-I",
        "xz -0",
        ".",
    ]
    subprocess.run(words, check=True)
    shutil.rmtree(folder)

"""Makes newer versions of built packages, so that tests can upgrade to them."""

import shutil
import subprocess
import tarfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

Change = Callable[[Path], None]


def next_version(package: Path, out: Path, new: str, change: Change | None = None) -> None:
    """Build this package again in the folder `out` with the version `new`.

    `change(tree)` changes the raw tree of the package rmf-bridges.
    """
    tree = out / "tree"
    subprocess.run(["dpkg-deb", "--raw-extract", str(package), str(tree)], check=True)
    name, old, arch = package.stem.split("_")
    for file in (tree / "DEBIAN").iterdir():
        file.write_text(file.read_text().replace(old, new))
    if name != "rmf-bridges":
        (tree / "usr/lib" / name / old).rename(tree / "usr/lib" / name / new)
    elif change:
        change(tree)
    deb = out / f"{name}_{new}_{arch}.deb"
    words = ["dpkg-deb", "--root-owner-group", "-Znone", "--build", str(tree), str(deb)]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    shutil.rmtree(tree)


@contextmanager
def bridges_in(tree: Path) -> Iterator[Path]:
    """Unpack the daemons' files of a raw tree; yield the folder `bridges`; pack them again."""
    archive, folder = tree / "usr/lib/rmf-bridges/tree.tar.xz", tree.with_name("unpacked")
    with tarfile.open(archive) as packed:
        packed.extractall(folder, filter="tar")
    (bridges,) = folder.glob("lib/python*/site-packages/bridges")
    yield bridges
    owner = ["--owner=0", "--group=0"]
    words = ["tar", "-C", str(folder), *owner, "-cf", str(archive), "-I", "xz -0", "."]
    subprocess.run(words, check=True)
    shutil.rmtree(folder)

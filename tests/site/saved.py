"""A site between two shifts, in a file.

A long day need not be played in one process: after each shift all robots are home, and the whole
site is written to a file. Another process goes on from there. Both ways give the same day.
"""

import copyreg
import multiprocessing
import pickle
import threading
from hashlib import sha256
from pathlib import Path
from queue import SimpleQueue

import cloudpickle

from tests.site.day import Site

ROOT = Path(__file__).parents[2]
PLAYED = ("bridges", "drivers", "hal_fakes", "tests/site", "workbench")
"""The folders whose code plays the day."""

# Made anew, because nobody holds or rings them between two shifts.
copyreg.pickle(type(threading.Lock()), lambda lock: (threading.Lock, ()))
copyreg.pickle(SimpleQueue, lambda bell: (SimpleQueue, ()))


class OtherCode(Exception):
    """The site was saved by another version of the code, so its day would be the day of none."""


def save(site: Site, path: Path) -> None:
    """Write the site to this file, in place of the site there. Raises RuntimeError on failure.

    A child of this process writes the file, so that the memory of this process does not grow.
    """
    child = multiprocessing.get_context("fork").Process(target=_write, args=(site, path))
    child.start()
    child.join()
    if child.exitcode:
        raise RuntimeError(f"{path} was not written: see the traceback above")


def load(path: Path) -> Site:
    """Read a site. Raises OtherCode for a site of another version, and OSError."""
    kept, code = path.read_bytes(), _code()
    if not kept.startswith(code):
        raise OtherCode(f"{path} was saved by another version: check that out, or remove the file")
    site = pickle.loads(kept[len(code) :])
    assert isinstance(site, Site)
    return site


def _write(site: Site, path: Path) -> None:
    new = path.with_suffix(".new")
    with new.open("wb") as file:
        file.write(_code())
        cloudpickle.dump(site, file)
    new.replace(path)


def _code() -> bytes:
    """Return a digest of the code that plays the day."""
    digest = sha256()
    for folder in PLAYED:
        for path in sorted((ROOT / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.digest()

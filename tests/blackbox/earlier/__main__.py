"""A program that writes this version's files to a new folder: `python -m tests.blackbox.earlier DAY`.

Run the program before a change moves or renames recorded types. Older folders stay unchanged.
"""

import gzip
import sys
import tempfile
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import replace

from bridges.blackbox.incident import Incident, Note, part
from bridges.blackbox.mcap_write import write
from bridges.blackbox.ring import RingContent
from bridges.blackbox.value_codec import tree
from bridges.runtime import record
from bridges.settings.load import load
from drivers.profiles import texts
from tests.blackbox.earlier import HERE
from tests.blackbox.kept import keep
from tests.blackbox.recordable import recordable, specimens
from tests.site.daemons import GraphDaemon
from tests.site.day import Site

CONFIG = Path(__file__).parents[3] / "config"
CLAIMED = ("lift_dry_contact", "door_register", "charger_http", "charger_wiferion")
SEED, HOURS = 6, 0.6
CHOSEN = ("Lift1", "store", "bay1", "coordinator", "door_supervisor", "lift_supervisor")
"""The names whose files are saved: one device or node for each kind of daemon."""
LOOK_S = 5.0
RING = 8 * 8192
LAST_S = 10.0


def _values() -> bytes:
    found: dict[str, list[Any]] = {}
    for one in recordable():
        for value in specimens(one):
            told: Any = tree(value)
            found.setdefault(told[""], []).append(told)
    rows = (
        f'"{name}":{msgspec.json.encode(told).decode()}' for name, told in sorted(found.items())
    )
    return "{{\n{}\n}}\n".format(",\n".join(rows)).encode()


def _records(folder: Path) -> None:
    for name in CLAIMED:
        texts.give({})
        claimed = replace(record.of(load(CONFIG / f"{name}.yaml")), file=f"/etc/{name}.yaml")
        (folder / claimed.name).write_bytes(msgspec.json.encode(claimed))


def _day(folder: Path) -> None:
    """Write a day's rings, the recorder's files from these rings, and the largest memory that each node
    had on disk."""
    with tempfile.TemporaryDirectory(dir="/dev/shm") as scratch:
        site = Site(SEED)
        rings = keep(site, Path(scratch), RING)
        kept: dict[str, bytes] = {}

        def look() -> None:
            for node in site.nodes:
                if isinstance(node, GraphDaemon) and node.name in CHOSEN:
                    kept[node.name] = max(kept.get(node.name, b""), node._disk.kept or b"", key=len)

        for number in range(int(HOURS * 3600 / LOOK_S)):
            site.timeline.at(number * LOOK_S, look)
        site.run(HOURS)
        for name in CHOSEN:
            _ring(folder / name, rings[name])
    for name, content in kept.items():
        if content:
            (folder / f"{name}.kept").write_bytes(content)


def _ring(path: Path, ring: Path) -> None:
    path.with_suffix(".ring.gz").write_bytes(gzip.compress(ring.read_bytes(), mtime=0))
    read = RingContent(ring)
    entries = list(read.entries())
    end = entries[-1].at
    last = part(entries, end - LAST_S, end)
    write(path.with_suffix(".mcap"), Incident(read.head, last, (Note(end, "ASKED", "kept"),)))


def main(day: str) -> int:
    """Write the folder for this day."""
    folder = HERE / day
    folder.mkdir()
    (folder / "values.json").write_bytes(_values())
    _records(folder)
    _day(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))

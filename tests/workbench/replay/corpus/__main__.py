"""A program that records incidents of the soak test: `python -m tests.workbench.replay.corpus`.

The program records the first incident of each chosen daemon. Run the program after a deliberate change
of a core's decisions. Then `git diff --stat` shows the incidents whose decisions have changed.
"""

import sys
import tempfile
from pathlib import Path

from bridges.blackbox.incident import Incident, part
from bridges.blackbox.mcap_write import write
from bridges.blackbox.ring import RingContent
from bridges.blackbox.triggers import FAULT, REFUSED, Triggers
from tests.blackbox.kept import keep
from tests.site.day import Site

HERE = Path(__file__).parent
CHOSEN = {
    1: ("Lift1", "Lift2", "store", "bay1", "bay2", "coordinator"),
    3: ("ward", "lift_supervisor"),
}
"""The daemons whose incidents the program records, by the seed of a simulated day. The incidents of
more daemons would be repetitions."""
HOURS = 0.3
BEFORE_S, AFTER_S = 5.0, 12.0


def incident(ring: Path) -> Incident | None:
    """Return a daemon's first fault. Without a fault return the first refusal, or None."""
    read = RingContent(ring)
    entries = list(read.entries())
    triggers = Triggers(60.0)
    notes = [note for entry in entries for note in triggers.take(entry) if note.at > BEFORE_S]
    chosen = [n for n in notes if n.code == FAULT] or [n for n in notes if n.code == REFUSED]
    if not chosen:
        return None
    at = chosen[0].at
    return Incident(read.head, part(entries, at - BEFORE_S, at + AFTER_S), (chosen[0],))


def main() -> int:
    """Write every incident file again."""
    for seed, names in CHOSEN.items():
        with tempfile.TemporaryDirectory(dir="/dev/shm") as scratch:
            site = Site(seed)
            rings = keep(site, Path(scratch), 64_000_000)
            site.run(HOURS)
            for name in names:
                found = incident(rings[name])
                if found is not None:
                    write(HERE / f"{name}_{seed}.mcap", found)
    return 0


if __name__ == "__main__":
    sys.exit(main())

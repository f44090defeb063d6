"""A program that records incidents of simulated days: `python -m tests.workbench.replay.corpus`.

The program records the first incident of each daemon in `CHOSEN`. Run the program after a deliberate
change of a daemon's decisions. Then `git diff --stat` shows the incidents whose decisions have changed.
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
"""The seed of a simulated day, with the daemons whose incidents the program records. The
incidents of other daemons would only repeat these incidents."""
HOURS = 0.3
BEFORE_S, AFTER_S = 5.0, 12.0


def incident(ring: Path) -> Incident | None:
    """Return the incident of a daemon's first fault. If there is no fault, return that of the first
    refusal, or None."""
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

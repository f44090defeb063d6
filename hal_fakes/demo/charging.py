"""`python -m hal_fakes.demo.charging`: the five situations of shared chargers, with real daemons.

Two chargers on HTTP and the coordinator, each a process of its own on real DDS; this one is a fleet
adapter with three robots, an operator and a technician. Exit code 0 when every situation was dealt
with, 1 with the reason, 130 after Ctrl-C. Nothing is left running.
"""

import sys
from pathlib import Path

from bridges.settings.load import load
from hal_fakes.demo import charging_day
from hal_fakes.demo.charging_verdict import problems, summary
from hal_fakes.demo.charging_yard import Yard
from hal_fakes.demo.stage import Stage, play

HERE = Path(__file__).parent
COORDINATOR = HERE.parents[1] / "config" / "charger_coordinator.yaml"
FILES = {
    "charger_a": HERE / "charging_a.yaml",
    "charger_b": HERE / "charging_b.yaml",
    "coordinator": COORDINATOR,
}
READY_WITHIN_S = 20.0


def run(stage: Stage, directory: Path) -> None:
    """Start everybody and live the day. Raises Wrong, Interrupted or TransportError."""
    site = load(COORDINATOR).section
    with stage.up(directory) as transport:
        yard = Yard(transport, stage, site)
        yard.until(yard.is_up, READY_WITHIN_S, "both chargers idle, and a place for each robot")
        stage.journal.begin_day()
        charging_day.live(yard)


def main() -> int:
    """Run the demo."""
    stage = Stage(FILES)
    return play(stage, lambda directory: run(stage, directory), problems, summary)


if __name__ == "__main__":
    sys.exit(main())

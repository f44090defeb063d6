"""Measure the real time of a simulated day. In this day, two robots ride two lifts through our
supervisor."""

import time
from pathlib import Path

from bench.figures import Tables
from tests.kinds.lift_supervisor.world import LiftNode, OurSupervisor, Rider
from tests.runtime.virtual_graph import World
from workbench.rmf_model.phases import EndLiftSession, RequestLift
from workbench.rmf_model.robot import Phase

DAY_S = 86400.0


def measure(scratch: Path) -> Tables:
    """Return the day's duration in real time (s), and the number of rides."""
    began = time.perf_counter()
    world = World()
    for name in ("Lift1", "Lift2"):
        _Lift(world, name)
    OurSupervisor(world)
    trips = [("L1", "L3"), ("L3", "L1")] * 2000  # more trips than fit into a day
    robots = [_Rider(world, f"fleet/{name}", *trips) for name in ("a", "b")]
    while world.now < DAY_S:
        world.run(min(world.now + 3600.0, DAY_S))
        world.sent.clear()
    rides = sum(len(robot.rode) for robot in robots)
    day = {"took s": time.perf_counter() - began, "rides": rides}
    return {"24 simulated hours": {"2 robots, 2 lifts": day}}


class _Lift(LiftNode):
    SCAN_S = 0.9  # s; a scan also comes at each `wake_at`, each request and each edge of an input


class _Rider(Rider):
    """A robot that rides the two lifts in turn, and is busy for a minute between rides."""

    REST_S = 60.0

    def _phase(self) -> Phase:
        lift = f"Lift{1 + len(self.trips) % 2}"
        pickup, target = self.trips[0]
        return [
            RequestLift(lift, pickup, inside=False),
            RequestLift(lift, target, inside=True),
            EndLiftSession(lift),
        ][self._step]

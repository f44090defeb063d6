"""Lifts: how fast a hazard takes the outputs away, what another lift costs, how fast a day goes by."""

import time
from itertools import count
from pathlib import Path
from typing import Any

import yaml

from bench.daemons import ROOT, PlantSocket, daemon, running, wait_for_log
from bench.idle import watch
from bench.latency import DOMAIN, PAUSE_S, Graph, figures, quick_lift
from bridges.rmf.definitions import LiftRequestType
from bridges.settings.load import load
from drivers.hal.gpio import canonical
from drivers.lift.dry_contact import Settings, wires
from hal_fakes.gpio import WiredFactory
from hal_fakes.plants.lift import build
from hal_fakes.rmf.phases import EndLiftSession, RequestLift
from hal_fakes.rmf.robot import Phase
from hal_fakes.wiring import Wiring
from tests.lift_supervisor.world import LiftNode, OurSupervisor, Rider
from tests.serve.virtual_graph import World

ROUNDS = 100
DAY_S = 86400.0


def measure(scratch: Path) -> dict[str, Any]:
    """All three."""
    return {
        "hazard": _hazard(scratch),
        "lifts": {str(n): watch(*_many(scratch, n)) for n in (1, 8)},
        "day": _day(),
    }


def show(measured: dict[str, Any]) -> None:
    """The tables."""
    print(f"\n{'hazard input edge to':28}{'p50 ms':>9}{'p99 ms':>9}{'p50 ratio':>11}")
    for name in ("a bare edge callback", "all outputs off"):
        row = measured["hazard"][name]
        print(f"{name:28}{row['p50_ms']:>9.3f}{row['p99_ms']:>9.3f}{row['p50_ratio']:>10.2f}x")
    print(f"the slowest took {measured['hazard']['slowest_scans']:.2f} scan periods")
    print(f"\n{'lifts in one daemon':28}{'RSS MB':>9}{'threads':>9}{'CPU %':>8}")
    for name, row in measured["lifts"].items():
        print(f"{name:28}{row['rss_mb']:>9.1f}{row['threads']:>9}{row['cpu_percent']:>8.2f}")
    day = measured["day"]
    print(f"\n24 simulated hours, 2 robots, 2 lifts: {day['s']:.1f} s, {day['rides']} rides")


def _hazard(scratch: Path) -> dict[str, Any]:
    """A fire while AGV mode is requested, against an edge callback that does nothing else."""
    bare = _bare_callbacks(scratch)
    log, directory = scratch / "hazard.log", scratch / "hazard"
    file = quick_lift(scratch)
    with running(daemon(file, directory, DOMAIN), log):
        wait_for_log(log, "ready")
        graph = Graph()
        plant, hand = PlantSocket(directory / "plant.sock"), PlantSocket(directory / "plant.sock")
        plant.say("follow")
        off = [_to_outputs_off(graph, plant, hand) for _ in range(ROUNDS)]
        for end in (plant, hand, graph.transport):
            end.close()
    return {
        "a bare edge callback": figures(bare, bare),
        "all outputs off": figures(off, bare),
        "slowest_scans": max(off) / load(file).buses["header"].scan_s,
    }


def _to_outputs_off(graph: Graph, plant: PlantSocket, hand: PlantSocket) -> float:
    graph.send("bench", LiftRequestType.REQUEST_AGV_MODE, "L1")
    plant.edge("agv_mode_request", True)
    hand.say("press Lift1 fire_alarm on")
    at = plant.edge("fire_alarm", True)
    took = plant.edge("agv_mode_request", False) - at
    # While it burns: a session that outlived the fire would have its relay back at once.
    ended_at = graph.send("bench", LiftRequestType.REQUEST_END_SESSION, "")
    graph.state(ended_at, lambda state: not state.session_id)
    hand.say("press Lift1 fire_alarm off")
    plant.edge("fire_alarm", False)
    time.sleep(PAUSE_S)
    return took


def _bare_callbacks(scratch: Path) -> list[float]:
    """From the contact to gpiozero's callback, in a process that does nothing else."""
    settings = load(quick_lift(scratch)).devices["Lift1"]
    assert isinstance(settings, Settings)
    plant = build("Lift1", settings)
    factory = WiredFactory([Wiring(plant, wires(settings), canonical)])
    pin = factory.pin(canonical(settings.inputs.fire_alarm.point))  # type: ignore[union-attr]
    pin.input_with_pull("down")
    pin.edges = "both"
    seen: list[float] = []

    def changed(ticks: Any, state: Any) -> None:
        seen.append(time.monotonic())

    pin.when_changed = changed
    took = []
    for number, on in zip(range(2 * ROUNDS), (i % 2 == 0 for i in count()), strict=False):
        at = time.monotonic()
        plant.press("fire_alarm", on, at)
        factory.show(at)
        if len(seen) > number:
            took.append(seen[-1] - at)
        time.sleep(0.01)
    return took


def _many(scratch: Path, lifts: int) -> tuple[list[str], Path]:
    """The shipped lift so many times over, each on a Modbus module of its own."""
    shipped = yaml.safe_load((ROOT / "config/lift_dry_contact.yaml").read_text())
    one = shipped["lifts"]["Lift1"]
    content = {
        **shipped,
        "buses": {"line": {"type": "modbus", "tcp": {"host": "127.0.0.1", "port": 502}}},
        "lifts": {f"Lift{unit}": _on_module(one, unit) for unit in range(1, lifts + 1)},
    }
    file = scratch / f"lifts_{lifts}.yaml"
    file.write_text(yaml.safe_dump(content, sort_keys=False))
    return daemon(file, scratch / f"lifts_{lifts}", DOMAIN), scratch / f"lifts_{lifts}.log"


def _on_module(lift: Any, unit: int) -> Any:
    coils, inputs = count(), count()

    def moved(part: Any) -> Any:
        if isinstance(part, list):
            return [moved(item) for item in part]
        if not isinstance(part, dict):
            return part
        if "point" not in part:
            return {key: moved(value) for key, value in part.items()}
        place = f"discrete input {next(inputs)}" if "pull" in part else f"coil {next(coils)}"
        return {**{k: v for k, v in part.items() if k != "pull"}, "point": f"unit {unit} {place}"}

    return moved(lift)


class _Lift(LiftNode):
    SCAN_S = 0.9  # and at every wake_at, request and edge: between them nothing can change


class _Rider(Rider):
    """Takes the two lifts in turn, and has something to do for a minute between its rides."""

    REST_S = 60.0

    def _phase(self) -> Phase:
        lift = f"Lift{1 + len(self.trips) % 2}"
        pickup, target = self.trips[0]
        return [
            RequestLift(lift, pickup, inside=False),
            RequestLift(lift, target, inside=True),
            EndLiftSession(lift),
        ][self._step]


def _day(seconds: float = DAY_S) -> dict[str, Any]:
    """Two robots ride two lifts all day, through our supervisor."""
    began = time.perf_counter()
    world = World()
    for name in ("Lift1", "Lift2"):
        _Lift(world, name)
    OurSupervisor(world)
    trips = [("L1", "L3"), ("L3", "L1")] * 2000  # more than fit into a day
    robots = [_Rider(world, f"fleet/{name}", *trips) for name in ("a", "b")]
    while world.now < seconds:
        world.run(min(world.now + 3600.0, seconds))
        world.sent.clear()
    rides = sum(len(robot.rode) for robot in robots)
    return {"s": time.perf_counter() - began, "rides": rides}

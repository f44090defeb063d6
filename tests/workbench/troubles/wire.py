"""The site of `site.py` with real processes on loopback. Our daemons are `rmf-bridge run --simulate`,
and a person types `rmf-bridge explain`. This process plays RMF's nodes on the same graph.

Each wait in a story lasts at most PASSES_S.
"""

import json
import random
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import yaml

from bridges.blackbox.recorder import Recorder
from bridges.blackbox.recordings import Recordings
from bridges.kinds.charger_coordinator import KIND as COORDINATOR
from bridges.kinds.lift_supervisor import KIND as LIFT_SUPERVISOR
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.messages import definitions as d
from bridges.messages.topics import (
    DOOR_REQUESTS,
    DOOR_STATES,
    DOOR_SUPERVISOR_HEARTBEAT,
    LIFT_REQUESTS,
)
from bridges.system.machine_time import machine_s
from bridges.transports.transport import Transport
from hal_fakes.demo.daemons import DaemonProcess, stop_all
from hal_fakes.wire import wire
from tests.blackbox import kept
from tests.site.building import Device
from tests.site.on_dds import DdsPlace, RealTime
from tests.workbench.explain.story import Rider
from tests.workbench.troubles.fleet import Fleet, PartyNode, Robot
from tests.workbench.troubles.site import LIFT, PLACES, coordinator_settings, devices
from workbench.rmf_model.supervisors import DoorSupervisor, LiftSupervisor

PASSES_S: Final = 4.0
WITHIN_S: Final = 90.0
RECORDED_S: Final = 100.0
LEASE_S: Final = 25.0
"""The time (s) within which DDS notices a killed node."""
START_TIMEOUT_S: Final = 40.0


class WireSite:
    """A site with the methods of `site.Site` that the stories use."""

    def __init__(self, folder: Path, domain: int, serves: tuple[str, ...]) -> None:
        self.timeline = RealTime()
        self.daemons: dict[str, DaemonProcess] = {}
        self._folder = folder
        self._domain = domain
        self._before: set[str] = set()
        self.recordings = Recordings(folder / "recordings")
        self._rings: list[Path] = []
        self._recorder = Recorder(lambda: self._rings, self.recordings, machine_s)
        for device in devices(self.timeline).values():
            if device.name in serves:
                self.serve(device, device.name)
        lifts = self._node("rmf_lift_supervisor", LiftSupervisor(), LIFT_REQUESTS)
        both = DOOR_REQUESTS, DOOR_SUPERVISOR_HEARTBEAT
        doors = self._node("rmf_door_supervisor", DoorSupervisor(), *both)
        self.supervisors = {node.name: node for node in (lifts, doors)}
        self.fleet = Fleet(self.timeline, self.join, self.wall, PLACES)
        self.red, self.blue = Robot(self.fleet, "red"), Robot(self.fleet, "blue")
        self.fleet.start()
        self._doors: dict[str, int] = {}
        self._observer = self.join("observer")
        self._observer.subscribe(DOOR_STATES, self._door)
        self._look()
        self._until(self._all_ready, WITHIN_S)

    # ---- the interface of `Site`

    def join(self, name: str) -> Transport:
        return DdsPlace(self.timeline, self._domain, name)

    def wall(self) -> float:
        return time.time()

    def run(self, seconds: float) -> None:
        self.waits(min(seconds, PASSES_S))

    def until(self, rider: Rider) -> None:
        self._until(lambda: rider.robot.done, WITHIN_S)

    def rides(self, rider: Rider, lift: str, start: str, end: str) -> None:
        for floor, inside in ((start, False), (end, True)):
            rider.asks(lift, floor, inside=inside)
            self.until(rider)
        rider.ends(lift)
        self.until(rider)

    def boards(self, robot: Robot, start: str, end: str) -> None:
        robot.asks(LIFT, start)
        self.until(robot)
        robot.asks(LIFT, end, inside=True)

    def passes(self, robot: Robot, door: str) -> None:
        robot.opens(door)
        self.until(robot)
        robot.closes(door)
        self.until(robot)
        shut = d.DoorModeValue.MODE_CLOSED
        self._until(lambda: self._doors.get(door) == shut, WITHIN_S)

    def press(self, device: str, signal: str, on: bool) -> None:
        name = LIFT if device == "lift_north" else device
        self.daemons[device].order(f"press {name} {signal} {'on' if on else 'off'}")

    def fail(self, device: str, part: str, mode: str) -> None:
        self.daemons[device].order(f"fail {device} {part} {mode}")

    def slow(self, name: str) -> None:
        self.fail(name, "unit", random.choice(("slow", "slow", "slow", "ok")))
        self.timeline.after(0.7, lambda: self.slow(name))

    def trouble_begins(self) -> None:
        self._before = {path.name for path in self.recordings.folder.glob("*")}

    def kills(self, name: str) -> None:
        self.daemons.pop(name).end(time.monotonic())

    def retires(self, name: str) -> None:
        stop_all([self.daemons.pop(name)])

    def serve(self, device: Device, node: str) -> None:
        self._start(node.removeprefix("rmf_bridge_"), kept.of_device(device).yaml)

    def takes_over(self, settings: LiftSupervisorSettings) -> None:
        self.supervisors["rmf_lift_supervisor"].kill()
        self._starts("lift_supervisor", kept.of_graph("", LIFT_SUPERVISOR, settings).yaml)

    def coordinates(self) -> None:
        settings = coordinator_settings(START_TIMEOUT_S)
        self._starts("charger_coordinator", kept.of_graph("", COORDINATOR, settings).yaml)

    def close(self) -> None:
        """Stop all processes, and leave the graph."""
        stop_all(self.daemons.values())
        for node in (*self.supervisors.values(), self.fleet):
            node.kill()
        self._observer.close()

    def waits(self, seconds: float) -> None:
        """Let this many seconds pass, but at most PASSES_S."""
        until = time.monotonic() + seconds
        self.timeline.until(lambda: time.monotonic() >= until, lambda: None)

    # ---- commands of a person

    def live(self, device: str) -> str:
        """Return the screen of `explain --live`."""
        return self._typed(
            "explain", "--live", device, "--for", "10", "--localhost", *self._graph()
        )

    def file(self, device: str, daemon: str) -> str:
        """Return the screen of `explain FILE`. If the recorder writes no file, a person asks for one
        with `incident`."""
        name = daemon or device
        self._until(lambda: bool(self._written(name)), RECORDED_S, must=False)
        if not (found := self._written(name)):
            found = [self._folder / "noted.mcap"]
            runtime = str(self.daemons[name].runtime_dir)
            words = ("incident", f"{self._folder / name}.yaml", "--runtime-dir", runtime)
            self._typed(*words, "--after", "0", "--note", "what is wrong?", "-o", str(found[0]))
        return self._typed("explain", str(found[0]), device)

    # ---- private methods

    def _graph(self) -> list[str]:
        return ["--domain-id", str(self._domain), "--transport", wire()]

    def _typed(self, *words: str) -> str:
        command = [sys.executable, "-m", "bridges.cli", *words]
        told = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self._until(lambda: told.poll() is not None, WITHIN_S)
        return told.communicate()[0]

    def _start(self, name: str, content: bytes) -> None:
        told = yaml.safe_load(content) | {"recording": {"waiting_s": 60.0}}
        file = self._folder / f"{name}.yaml"
        file.write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")
        self.daemons[name] = DaemonProcess(file, self._folder, self._domain)
        self._rings.append(self.daemons[name].runtime_dir)

    def _starts(self, name: str, content: bytes) -> None:
        """Start a node without hardware, and wait until it publishes."""
        self._start(name, content)
        self._until(lambda: _status(self.daemons[name]).get("passive") is False, WITHIN_S)

    def _node(self, name: str, party: Any, *says: Any) -> PartyNode:
        node = PartyNode(self.timeline, self.join, self.wall, name, party, says)
        node.start()
        return node

    def _door(self, state: d.DoorState) -> None:
        self._doors[state.door_name] = state.current_mode.value

    def _look(self) -> None:
        self._recorder.look()
        self.timeline.after(1.0, self._look)

    def _until(self, done: Callable[[], bool], within_s: float, *, must: bool = True) -> None:
        end = time.monotonic() + within_s
        self.timeline.until(lambda: done() or time.monotonic() > end, lambda: None)
        assert done() or not must, f"not within {within_s:g} s"

    def _all_ready(self) -> bool:
        return all(_is_ready(daemon) for daemon in self.daemons.values())

    def _written(self, name: str) -> list[Path]:
        files = sorted(self.recordings.folder.glob(f"{name}_2*.mcap"))
        return [path for path in files if path.name not in self._before]


def _is_ready(daemon: DaemonProcess) -> bool:
    return bool(_status(daemon).get("devices"))


def _status(daemon: DaemonProcess) -> dict[str, Any]:
    daemon.check()
    try:
        found: dict[str, Any] = json.loads((daemon.runtime_dir / "status.json").read_bytes())
    except (OSError, ValueError):
        return {}
    return found

"""A whole site in virtual time: our daemons with their event files (rings), RMF's supervisors, one
fleet, and a recorder.

The site is the site of `tests/site` with the names of `expected.toml`.
"""

import dataclasses
import os
import subprocess
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from random import Random
from typing import Any, Final

from msgspec.structs import replace

from bridges.blackbox.entries import Head
from bridges.blackbox.recorder import Recorder
from bridges.blackbox.recordings import Recordings
from bridges.blackbox.ring import Ring
from bridges.kinds.charger_coordinator import KIND as COORDINATOR
from bridges.kinds.charger_coordinator.settings import (
    CoordinatorSettings,
    FleetSettings,
    RobotSettings,
    StationSettings,
    Waypoint,
)
from bridges.kinds.lift_supervisor import KIND as LIFT_SUPERVISOR
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.kinds.shared.graph_kind import AnyGraphKind
from bridges.messages import topics
from bridges.messages.stamps import stamp
from bridges.runtime import diagnostics
from bridges.runtime.clock import Clock
from bridges.runtime.ring_writer import RingWriter
from bridges.runtime.subject import Status
from bridges.transports.transport import Transport
from drivers.door import dry_contact as door_dry_contact
from drivers.lift import dry_contact as lift_dry_contact
from hal_fakes.plants.lift import LiftPace
from tests.blackbox import kept
from tests.site import building
from tests.site.building import Device
from tests.site.daemons import DeviceDaemon, GraphDaemon
from tests.site.network import Place
from tests.site.timeline import EPOCH, Timeline
from tests.workbench.explain.story import Scene
from tests.workbench.troubles.fleet import FLEET, ROBOTS, Fleet, Robot
from tests.workbench.troubles.module import ModuleFar

RING: Final = 1_000_000
LIFT, OTHER_LIFT, DOOR, OTHER_DOOR = "Lift1", "Lift2", "ward_door", "lab_door"
CHARGER, OTHER_CHARGER = "charger_a", "charger_b"
KINDS: Final = {"lift": LIFT, "door": DOOR, "charger": CHARGER}
TIMEOUT_S: Final = 0.5
START_TIMEOUT_S: Final = 300.0
TOO_LATE: Final = "modbus unit 1 at 192.168.1.50:502, read inputs: no reply within 0.5 s, tried 2x"
PACE: Final = LiftPace(floor_s=8.0, door_s=3.0)
PLACES: Final = {
    CHARGER: ("L1", 10.0, 2.0),
    OTHER_CHARGER: ("L1", 10.0, 6.0),
    "wait_red": ("L1", 0.0, 2.0),
    "wait_blue": ("L1", 0.0, 4.0),
    "wait_green": ("L1", 0.0, 6.0),
}


class Site(Scene):
    """A site and its recorder.

    - `folder` holds the rings and the recordings.
    - `mortal` names the daemon that a story kills; "" for none. For this daemon there is a real
      process.
    - `latest_s`: a slow Modbus unit replies within this time (s).
    - `slow_s`: time (s) between two requests to a slow unit.
    """

    def __init__(self, folder: Path, mortal: str = "") -> None:
        super().__init__(rmf=True, diagnoses=False)
        self.devices = devices(self.timeline)
        self.recordings = Recordings(folder / "recordings")
        self._before: set[str] = set()
        self.process = subprocess.Popen(["sleep", "600"]) if mortal else None
        self._mortal = mortal
        self.random = Random(31)
        self.latest_s, self.slow_s = 4.0, TIMEOUT_S
        self._folder = folder
        self._rings: dict[str, Path] = {}
        self._recorder = Recorder(
            lambda: [*self._rings.values()], self.recordings, lambda: self.timeline.now
        )
        for device in [*self.devices.values()]:
            self.serve(device, f"rmf_bridge_{device.name}")
        self.fleet = Fleet(self.timeline, self.join, self.wall, PLACES)
        self.red, self.blue = Robot(self.fleet, "red"), Robot(self.fleet, "blue")
        self.fleet.start()
        self._each_second()
        self.run(10.0)

    def join(self, name: str) -> Transport:
        """Join the graph as a node with this name."""
        return Place(self.air, name, lambda: None)

    def wall(self) -> float:
        """The wall clock (s since the epoch)."""
        return EPOCH + self.timeline.now

    def serve(self, device: Device, node: str) -> None:
        """Start a daemon of ours for this device."""
        name = node.removeprefix("rmf_bridge_")
        self.devices[name] = device
        self.daemons[name] = daemon = DeviceDaemon(self.timeline, self.air, device, node)
        daemon.writer = self._writer(name, kept.of_device(device))
        daemon.start()

    def takes_over(self, settings: LiftSupervisorSettings) -> None:
        """Replace RMF's lift supervisor with ours."""
        self.supervisors.pop("rmf_lift_supervisor").kill()
        self._ours("lift_supervisor", LIFT_SUPERVISOR, settings)

    def coordinates(self) -> None:
        """Start our charger coordinator for the fleet's robots and both chargers."""
        self._ours("charger_coordinator", COORDINATOR, coordinator_settings(START_TIMEOUT_S))

    def trouble_begins(self) -> None:
        """Let `file` return only files that the recorder writes from now on."""
        self._before = {path.name for path in self.recordings.folder.glob("*")}

    def kills(self, name: str) -> None:
        """Kill the daemon's process. Then the daemon's service switches the outputs off."""
        if name == self._mortal and self.process:
            self.process.kill()
            self.process.wait()
        self.daemons[name].kill()

    def retires(self, name: str) -> None:
        """Stop the daemon cleanly, and do not start it again."""
        daemon = self.daemons.pop(name)
        daemon.kill()
        daemon.writer.ended(safe=True)

    def slow(self, name: str) -> None:
        """Make the device's unit slow from now on. The unit answers after 0.1 s to `latest_s`, so that
        most replies are too late."""
        far = self.devices[name].far
        assert isinstance(far, ModuleFar)
        far.silent(TOO_LATE if self.random.uniform(0.1, self.latest_s) > TIMEOUT_S else "")
        self.daemons[name].scan()
        self.timeline.after(self.slow_s, lambda: self.slow(name))

    def close(self) -> None:
        """End the process of the daemon `mortal`."""
        if self.process:
            self.process.kill()
            self.process.wait()

    def boards(self, robot: Robot, start: str, end: str) -> None:
        """Let the robot board Lift1 at `start`. Then the robot asks for `end`."""
        robot.asks(LIFT, start)
        self.until(robot)
        self.run(6.0)
        robot.asks(LIFT, end, inside=True)

    def passes(self, robot: Robot, door: str) -> None:
        """Let the robot pass a door."""
        robot.opens(door)
        self.until(robot)
        self.run(5.0)
        robot.closes(door)
        self.until(robot)
        self.run(10.0)

    def file(self, name: str, within_s: float = 260.0) -> Path | None:
        """Return the first file of this daemon that the recorder writes after the trouble began."""
        until = self.timeline.now + within_s
        while not (found := self._written(name)) and self.timeline.now < until:
            self.run(1.0)
        return found[0] if found else None

    def ring(self, name: str) -> Path:
        """Return the runtime directory with this daemon's ring."""
        return self._rings[name]

    # ---- private methods

    def _ours(self, name: str, kind: AnyGraphKind, settings: Any) -> None:
        node = f"rmf_bridge_{name}"
        ours = GraphDaemon(self.timeline, self.air, node, kind, settings=settings)
        ours.writer = self._writer(name, kept.of_graph(name, kind, settings))
        self.supervisors[node] = ours
        ours.start()
        self.run(6.0)

    def _each_second(self) -> None:
        """Publish each daemon's diagnostics, as `_tell` in `bridges/runtime/daemon.py` does. Then let
        the recorder read the rings."""
        for daemon in self.daemons.values():
            if daemon.alive:
                told = {daemon.name: daemon.status()}
                self._tell(daemon, daemon.node, daemon.device.kind.name, {}, told)
        for node in self.supervisors.values():
            if isinstance(node, GraphDaemon) and node.alive:
                self._tell(node, node.name, node.kind.name, node.node.status(), node.summary())
        self._recorder.look()
        self.timeline.after(1.0, self._each_second)

    def _tell(
        self, daemon: Any, node: str, kind: str, own: Status, of: Mapping[str, Status]
    ) -> None:
        at = stamp(EPOCH + self.timeline.now)
        found = diagnostics.diagnosis(node, kind, own, of, at)
        daemon.says(topics.DIAGNOSTICS, found)
        daemon.writer.look()
        daemon.writer.spoken(topics.DIAGNOSTICS.name, found, sent=True)

    def _written(self, name: str) -> list[Path]:
        files = sorted(self.recordings.folder.glob(f"{name}_2*.mcap"), key=os.path.getmtime)
        return [path for path in files if path.name not in self._before]

    def _writer(self, name: str, head: Head) -> RingWriter:
        pid = self.process.pid if self.process and name == self._mortal else os.getpid()
        head = replace(head, run=f"{len(self._rings) + 1:08x}", pid=pid)
        self._rings[name] = folder = self._folder / name
        folder.mkdir()
        clock = Clock(lambda: self.timeline.now, lambda: EPOCH + self.timeline.now)
        return RingWriter(partial(Ring, folder, head, RING), clock, lambda: self.air.release)


def devices(timeline: Timeline) -> dict[str, Device]:
    """Return two devices of each kind. Lift1 and both doors are at Modbus modules. Lift1 has two door
    contacts."""
    content = {**building._lift2(), "fire_reset": "auto", "alarm": "fire_alarm_trigger"}
    settings = building._convert(lift_dry_contact, content)
    other = building._shipped("lift_dry_contact", LIFT)
    lab, _ = building._dry_doors()[1]
    found = [
        _at_module(timeline, building._lift(timeline, LIFT, settings, "modbus"), lift_dry_contact),
        building._lift(timeline, OTHER_LIFT, other, "gpio"),
        _at_module(timeline, _door(timeline, DOOR, lab), door_dry_contact),
        _door(timeline, OTHER_DOOR, lab),
        building._charger(timeline, CHARGER, 0),
        building._charger(timeline, OTHER_CHARGER, 0),
    ]
    for device in found[:2]:
        device.plant._pace = PACE  # type: ignore[attr-defined]
    return {device.name: device for device in found}


def _door(timeline: Timeline, name: str, content: dict[str, Any]) -> Device:
    settings = building._convert(door_dry_contact, content)
    return building._dry_door(timeline, name, settings, "modbus")


def _at_module(timeline: Timeline, device: Device, driver: Any) -> Device:
    """Return the device behind a Modbus module, with the real rules of the HAL between driver and
    module."""
    far = ModuleFar(timeline, device.plant, driver.wires(device.settings))
    made = partial(driver.create, device.name, device.settings, far)
    return dataclasses.replace(device, far=far, driver=made)


def coordinator_settings(start_timeout_s: float) -> CoordinatorSettings:
    """Return settings in which the fleet's robots may use both chargers."""
    waypoints = {name: Waypoint(level=at[0], x=at[1], y=at[2]) for name, at in PLACES.items()}
    chargers = [CHARGER, OTHER_CHARGER]
    robots = {name: RobotSettings(stations=chargers, waits_at=f"wait_{name}") for name in ROBOTS}
    return CoordinatorSettings(
        stations={name: StationSettings() for name in chargers},
        fleets={FLEET: FleetSettings(waypoints=waypoints, robots=robots)},
        start_timeout_s=start_timeout_s,
    )

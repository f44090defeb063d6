"""A day at the site, with all daemons and robots, all troubles, and the rules of `laws.py`."""

import logging
import random as the_random
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from random import Random

from bridges.kinds.charger_coordinator import KIND as COORDINATOR
from bridges.kinds.door_supervisor import KIND as DOOR_SUPERVISOR
from bridges.kinds.lift_supervisor import KIND as LIFT_SUPERVISOR
from bridges.messages import definitions as d
from bridges.messages.releases import JAZZY, KILTED
from bridges.messages.topics import FLEET_STATES
from hal_fakes.plants.charger import ChargerPlant
from hal_fakes.plants.door import DoorPlant
from hal_fakes.plants.lift import FAILS, LiftPlant
from tests.site import charging
from tests.site.building import FLOORS, SITE, Device, Size, devices
from tests.site.daemons import (
    RIVAL,
    DeviceDaemon,
    GraphDaemon,
    RmfsSupervisor,
    rmfs_door_supervisor,
    rmfs_lift_supervisor,
)
from tests.site.fire_panels import FirePanels
from tests.site.growth import Look, look
from tests.site.laws import BOUND_S, Broken, Laws
from tests.site.network import CLEAR, Air, Place, Weather
from tests.site.robots import Places, Resident
from tests.site.storeroom import Storeroom
from tests.site.timeline import HOUR_S, NEVER, Alarm, Timeline
from tests.site.trouble import BY_RESET_S, Ill, Ills, Mortal, Trouble, breakable, pressable

WIND_DOWN_S = BOUND_S + 90.0
"""The length of the wind-down (s). In this time no new trouble begins, and every robot ends its
tour."""
ADOPTS_S = 5.0
"""The time (s) that a restarted supervisor of RMF needs to end the session that it sees. Then it
accepts the next requester.

The robot in the car may not be the first requester. Then RMF lets another robot into the same car. Only
RMF can mend that defect.
"""
SWEEP_S = 45.0
"""The time (s) before the end of the day at which RMF's supervisors restart. By then every robot has
ended its tour."""
LOOK_EVERY_S = 5.0
LAG_S = 0.1
"""The time (s) between the rounds of a supervisor in a hospital, whose machine is busy. In 0.1 s it
gets twenty messages."""
JUDGED_S = 900.0
"""How long (s) the judges listen in each hour of a hospital."""


SUPERVISORS = ("ours", "kilted", "jazzy")
"""The possible supervisors of a day: ours, or RMF's own with the rules of its release Kilted or
Jazzy."""


class Site:
    """A day at the site, which the seed determines. `run` raises `laws.Broken` when a law is broken. A
    day may have several shifts, one `run` after the other. `saved.py` keeps a site between two of them.

    `rmf` is one of SUPERVISORS. Without `rmf` the seed decides. With our supervisors the seed also
    decides the release of the fleet adapters. With `kill_every_s` the only trouble is the death of
    RMF's lift supervisor. The supervisor dies every `kill_every_s` seconds and restarts within 5 s.
    """

    def __init__(
        self,
        seed: int,
        rmf: str | None = None,
        kill_every_s: float | None = None,
        size: Size = SITE,
    ) -> None:
        self.seed = seed
        self.size = size
        self.rmf = rmf or SUPERVISORS[seed % len(SUPERVISORS)]
        self.jazzy = self.rmf == "jazzy" or (self.rmf == "ours" and seed % 2 == 1)
        self.random = Random(seed)
        self.timeline = timeline = Timeline()
        self.ills = Ills(timeline)
        self.air = Air(timeline, Random(self.random.random()))
        self.laws = Laws(timeline, self.ills, HOUR_S if size is SITE else JUDGED_S)
        self.air.watch = self.laws.heard
        self.air.sorts = size is not SITE
        self.devices = devices(timeline, size)
        self.daemons = {n: DeviceDaemon(timeline, self.air, d) for n, d in self.devices.items()}
        self._lag_s = 0.0 if size is SITE else LAG_S
        self.supervisors = self._rmfs() if self.rmf != "ours" else self._ours()
        self.air.release = JAZZY if self.jazzy else KILTED
        self.charging = charging.settings(size.chargers, size.robots)
        self.coordinator = GraphDaemon(
            timeline,
            self.air,
            "coordinator",
            COORDINATOR,
            settings=self.charging,
            lag_s=self._lag_s,
        )
        self.coordinated = seed // len(SUPERVISORS) % 2 == 0
        self.nodes = [*self.supervisors, *([self.coordinator] if self.coordinated else [])]
        self.robots = [self._robot(f"fleet/{name}") for name in size.robots]
        self._fleet = Alarm(timeline, self._tell_fleet)
        self.trouble = Trouble(
            timeline, self.ills, Random(self.random.random()), self._draw, self.laws.note
        )
        self.kill_every_s = kill_every_s
        self.kills = {"supervisor kills": 0, "of them with a robot in a car": 0}
        self.storeroom = Storeroom(timeline, Random(f"storeroom {seed}"), self.laws.require)
        self.fire_panels = FirePanels(timeline, Random(f"fire {seed}"), self.laws.require)
        self.looks: list[Look] = []
        self._people = Random(self.random.random())
        self._people_at: dict[str, float] = {}

    def _ours(self) -> list[GraphDaemon | RmfsSupervisor]:
        made = partial(GraphDaemon, self.timeline, self.air, lag_s=self._lag_s)
        return [
            made("lift_supervisor", LIFT_SUPERVISOR, wall_skew=1.5),
            made("lift_standby", LIFT_SUPERVISOR),
            made("door_supervisor", DOOR_SUPERVISOR),
        ]

    def _rmfs(self) -> list[GraphDaemon | RmfsSupervisor]:
        lifts = rmfs_lift_supervisor(self.timeline, self.air, jazzy=self.jazzy)
        return [lifts, rmfs_door_supervisor(self.timeline, self.air)]

    def run(self, hours: float, told: Callable[[Look], None] = lambda look: None) -> None:
        """Run the whole day, or its next shift. After each hour `told` gets the resources in use."""
        began = self.timeline.now
        end = began + hours * HOUR_S
        # Fix also the random time for which a supervisor waits when it meets a rival.
        the_random.seed(self.seed)
        if began:
            self._next_shift()
        else:
            self._open()
        self.timeline.after(30.0, self._live)
        if self.kill_every_s is None:
            self.trouble.begin(until=end - WIND_DOWN_S)
        else:
            self.trouble.over_at = end - WIND_DOWN_S
            self.timeline.after(60.0, self._kill)
        self.timeline.at(end - WIND_DOWN_S, self._wind_down)
        self.timeline.at(end - SWEEP_S, self._sweep)
        with _defects_end_the_day():
            hour = int(began / HOUR_S)
            while (hour := hour + 1) * HOUR_S < end:
                self.timeline.run(hour * HOUR_S)
                self._look(hour, told)
            self.timeline.run(end)
        self._look(end / HOUR_S, told)
        self._close()

    def counts(self) -> dict[str, int]:
        """Return the counts of events in this day."""
        done: dict[str, int] = {}
        for robot in self.robots:
            for what, count in robot.done.items():
                done[what] = done.get(what, 0) + count
        done["scans"] = sum(daemon.scans for daemon in self.daemons.values())
        done["dispensings"] = sum(self.storeroom.done.values())
        done["drills and alarms"] = sum(self.fire_panels.done.values())
        kills = self.kills if self.kill_every_s else {}
        return {**done, **kills, "checks": self.laws.checks, **self.air.counts}

    # ---- the hours

    def _open(self) -> None:
        for name, daemon in self.daemons.items():
            self.laws.add(daemon)
            self.timeline.after(self.random.uniform(0.0, 2.0), daemon.start)
            assert name == daemon.name
        self.laws.speakers = self._speakers
        self.storeroom.open()
        self.fire_panels.open()
        parties: list[Mortal] = [*self.nodes, *self.robots]
        for party in parties:
            self.timeline.after(self.random.uniform(2.0, 6.0), party.start)
        self.timeline.after(LOOK_EVERY_S, self._watch)
        if self.size is not SITE and self.coordinated:
            place = Place(self.air, "fleet", lambda: None)
            self._fleet_states = place.publisher(FLEET_STATES)
            self._tell_fleet()

    def _tell_fleet(self) -> None:
        """Publish the state of a hospital's fleet each second: of each robot whose adapter lives."""
        robots = (robot.reported() for robot in self.robots if robot.alive)
        known = tuple(one for one in robots if one is not None)
        self._fleet_states.publish(d.FleetState(charging.FLEET, known))
        self._fleet.set(self.timeline.now + 1.0)

    def _next_shift(self) -> None:
        """Let the robots leave their homes again, with the weather of a new day."""
        self.air.weather = Weather()
        for robot in self.robots:
            robot.goes_out()

    def _look(self, hour: float, told: Callable[[Look], None]) -> None:
        self.air.forget_links()
        self.looks.append(look(hour))
        told(self.looks[-1])

    def _watch(self) -> None:
        """Check that no robot waits for too long."""
        for robot in self.robots:
            if robot.alive and robot.waits_for:
                self.laws.waits(robot.name, robot.waits_for, robot.since)
        self._mend_queue()
        self.timeline.after(LOOK_EVERY_S, self._watch)

    def _mend_queue(self) -> None:
        """Reset the coordinator, as a technician does after the repair of robots and stations."""
        if not (self.coordinated and self.coordinator.alive):
            return
        calm = self.ills.calm_since() + BY_RESET_S < self.timeline.now
        if calm and any(s["faults"] for s in self.coordinator.summary().values()):
            self.coordinator.reset()

    def _live(self) -> None:
        """Let people use lifts and doors. This does not count as trouble."""
        people = self._people
        name = people.choice([*self.size.lifts, *self.size.doors])
        signal = f"hall_{people.choice(FLOORS)}" if name in self.size.lifts else "push"
        self._press(name, signal, True)
        self.timeline.after(people.uniform(0.2, 2.0), lambda: self._press(name, signal, False))
        if self.timeline.now < self.trouble.over_at:
            self.timeline.after(people.expovariate(1 / 45.0), self._live)

    def _wind_down(self) -> None:
        self.air.weather = CLEAR
        self.laws.note("--- the day ends")
        for robot in self.robots:
            robot.homing = True

    def _sweep(self) -> None:
        """Restart RMF's supervisors, because they still hold lifts and doors for robots whose adapters
        died."""
        for supervisor in self.supervisors:
            if isinstance(supervisor, RmfsSupervisor):
                supervisor.kill()
                supervisor.start()

    def _close(self) -> None:
        for robot in self.robots:
            self.laws.require(robot.at_rest, f"{robot.name} is not home: {robot.waits_for}")
        self.laws.at_rest()
        for supervisor in self.supervisors:
            for name, said in supervisor.summary().items():
                waiting = {k: v for k, v in said.items() if k in ("holder", "waiting", "holders")}
                empty = all(value == "-" for value in waiting.values())
                self.laws.require(empty, f"{supervisor.name}: {name} {waiting} at the end")

    def _speakers(self, topic: str) -> int:
        """Return the number of supervisors that publish on the topic. If RMF's rival runs beside our
        supervisor, return 1, because that trouble is intended."""
        speaking = [end.node.name for end in self.air.memory.publishers[topic]]
        if RIVAL in speaking and self.rmf == "ours":
            return 1
        return len(speaking)

    # ---- the places of the robots (methods of `robots.Ground`)

    def may_enter_lift(self, robot: Resident, lift: str, floor: str) -> bool:
        return self.laws.lift_is_open(lift, floor)

    def boards(self, robot: Resident, lift: str, floor: str) -> None:
        self.laws.boards(robot.name, lift, floor)

    def leaves(self, robot: Resident, lift: str, floor: str) -> None:
        self.laws.leaves(robot.name, lift, floor)

    def crossed(self, robot: Resident) -> None:
        self.laws.crossed(robot.name)
        doorways = {robot.doorway for robot in self.robots}
        for door in self.size.doors:
            if self.devices[door].plant.contact("obstruction") and self._people.random() < 0.2:
                self._follows(door)  # a person walks in behind the robot
            self._obstruct(door, there=door in doorways)

    def _follows(self, door: str) -> None:
        self._people_at[door] = self.timeline.now + self._people.uniform(1.0, 8.0)
        self.timeline.at(self._people_at[door], lambda: self._obstruct(door))

    def is_out(self, robot: Resident, lift: str) -> None:
        self.laws.is_out(robot.name, lift)

    def may_enter_door(self, robot: Resident, door: str) -> bool:
        return self.laws.door_is_open(door)

    def in_doorway(self, robot: Resident, door: str) -> None:
        self.laws.in_doorway(robot.name, door)
        self._obstruct(door)

    def may_enter_pad(self, charger: str) -> bool:
        return all(robot.pad != charger for robot in self.robots)

    def on_pad(self, robot: Resident, charger: str) -> None:
        self.laws.on_pad(robot.name, charger)
        self._press(charger, "robot", True)

    def off_pad(self, robot: Resident, charger: str) -> None:
        self.laws.off_pad(robot.name, charger)
        self._press(charger, "robot", False)

    def charged(self, charger: str) -> bool:
        self.daemons[charger].advance()
        plant = self.devices[charger].plant
        assert isinstance(plant, ChargerPlant)
        return plant.battery >= 1.0

    def _obstruct(self, door: str, there: bool | None = None) -> None:
        """Set the light curtain. It sees robots, people and obstructions in the doorway. `there` tells
        whether a robot is in the doorway; None if the caller does not know."""
        if there is None:
            there = any(robot.doorway == door for robot in self.robots)
        there = there or self.ills.has(door, "press obstruction")
        there = there or self.timeline.now < self._people_at.get(door, 0.0)
        if there != self.devices[door].plant.contact("obstruction"):
            if there:
                self.ills.obstruct(door)
            self._press(door, "obstruction", there)

    def _press(self, device: str, signal: str, on: bool) -> None:
        self.daemons[device].advance()
        self.devices[device].plant.press(signal, on, self.timeline.now)
        self.daemons[device].look()

    # ---- possible troubles

    def _robot(self, name: str) -> Resident:
        self.air.best_effort.add(name)
        size = self.size
        places = Places(FLOORS, [*size.lifts], [*size.doors], [*size.chargers])
        own = Random(self.random.random())
        charge = charging.Charge(name.split("/")[1], self.charging) if self.coordinated else None
        return Resident(
            self.timeline,
            self._join,
            self,
            name,
            own,
            places,
            jazzy=self.jazzy,
            charge=charge,
            tells=size is SITE,
        )

    def _join(self, name: str) -> Place:
        place = Place(self.air, name, lambda: None, choosy=True)
        next(robot for robot in self.robots if robot.name == name).heeds = place.heed
        return place

    def _draw(self, random: Random) -> Ill:
        sorts = (
            self._break,
            self._act,
            self._lose_bus,
            self._restart,
            self._cut,
            self._rival if self.rmf == "ours" else self._restart_rmfs,
        )
        (draw,) = random.choices(sorts, (6, 4, 2, 4, 2, 0.5 if self.rmf == "ours" else 8))
        return draw(random)

    def _device(self, random: Random) -> Device:
        return self.devices[
            random.choice(random.choice((self.size.lifts, self.size.doors, self.size.chargers)))
        ]

    def _rival(self, random: Random) -> Ill:
        """Return a trouble: RMF's own lift supervisor runs beside ours for some time."""
        rival = rmfs_lift_supervisor(self.timeline, self.air, jazzy=self.jazzy)

        def begin() -> None:
            rival.start()
            self._distrust(self.size.lifts, "rival")

        def end() -> None:
            rival.kill()
            self._trust(self.size.lifts, "rival")

        return Ill("rival", rival.name, "rival", begin, end, most_s=40.0)

    def _restart_rmfs(self, random: Random) -> Ill:
        """Return a trouble: RMF's supervisor forgets everything. After its restart it may publish
        requests of other robots."""
        supervisor = random.choice([s for s in self.supervisors if isinstance(s, RmfsSupervisor)])
        devices = self.size.lifts if supervisor.name == RIVAL else self.size.doors

        why = f"supervisor {random.random()}"  # unique, because two restarts may be close together

        def begin() -> None:
            supervisor.kill()
            self._distrust(devices, why)

        def end() -> None:
            supervisor.start()
            self._distrust((), "")
            self.timeline.after(ADOPTS_S, again)

        def again() -> None:
            self._distrust((), "")
            self._trust(devices, why)

        return Ill("supervisor", supervisor.name, "daemon", begin, end, least_s=0.2, most_s=20.0)

    def _kill(self) -> None:
        """Kill RMF's lift supervisor and start a new one. All other parties go on."""
        if self.timeline.now > self.trouble.over_at:
            return
        supervisor = next(s for s in self.supervisors if s.name == RIVAL)
        riders = [robot.name for robot in self.robots if robot.in_car]
        self.laws.note(f"--- the lift supervisor is killed; in cars: {riders}")
        self.kills["supervisor kills"] += 1
        self.kills["of them with a robot in a car"] += bool(riders)
        supervisor.kill()
        self.timeline.after(self.random.uniform(0.2, 5.0), supervisor.start)
        self.timeline.after(self.kill_every_s or NEVER, self._kill)

    def _distrust(self, devices: Sequence[str], why: str) -> None:
        """Note that from now on a supervisor may send requests in a robot's name that the robot did not
        send."""
        for name in devices:
            self.ills.begin(name, why)
        for robot in self.robots:
            self.laws.abandoned(robot.name)

    def _trust(self, devices: Sequence[str], why: str) -> None:
        for name in devices:
            self.ills.end(name, why)

    def _break(self, random: Random) -> Ill:
        device = self._device(random)
        wires, parts = breakable(device)
        part, modes = random.choice(random.choice((wires, parts)) or parts)
        mode, daemon = random.choice(modes), self.daemons[device.name]

        def fail(how: object) -> None:
            daemon.advance()
            device.plant.fail(part, how)  # type: ignore[arg-type]
            daemon.look()

        return Ill(
            "part",
            device.name,
            part,
            lambda: fail(mode),
            lambda: fail(None),
            mode=mode,
            reset=daemon.reset,
            heals_s=90.0 if part in FAILS else 0.0,
        )

    def _act(self, random: Random) -> Ill:
        device = self._device(random)
        signal = random.choice(pressable(device))
        name = device.name
        hazard = isinstance(device.plant, LiftPlant) or signal == "fire"
        what = f"hazard {signal}" if hazard else f"press {signal}"
        if signal == "obstruction":
            return Ill("person", name, what, lambda: self._obstruct(name), lambda: None, most_s=40)
        latches = not isinstance(device.plant, DoorPlant) and device.poll_s > 0.0
        return Ill(
            "hazard",
            name,
            what,
            lambda: self._press(name, signal, True),
            lambda: self._press(name, signal, False),
            reset=self.daemons[name].reset if latches else None,
        )

    def _lose_bus(self, random: Random) -> Ill:
        device = self._device(random)
        while device.poll_s == 0.0:
            device = self._device(random)
        return Ill(
            "bus",
            device.name,
            "bus",
            lambda: self._bus_down(device),
            lambda: self._bus_up(device),
            least_s=0.1,
        )

    def _bus_down(self, device: Device) -> None:
        device.far.down = "the module does not answer"
        self.timeline.after(2.0, device.far.watchdog)

    def _bus_up(self, device: Device) -> None:
        device.far.down = ""
        self.daemons[device.name].look()

    def _restart(self, random: Random) -> Ill:
        """Return a trouble: a daemon or a robot's adapter dies, and starts again with a changed clock.

        If RMF's own door supervisor runs, no adapter's clock is set back. Otherwise that supervisor
        would ignore the adapter's CLOSE as too old, and would send a heartbeat. The adapter would
        answer each heartbeat with another CLOSE, as fast as the network allows.
        """
        ours = [node for node in self.nodes if isinstance(node, GraphDaemon)]
        sorts: list[list[Mortal]] = [[*self.daemons.values()], [*self.robots], [*ours]]
        sorts = [parties for parties in sorts if parties]
        party = random.choice(random.choice(sorts))
        skew_s = random.choice((0.0, 0.0, 0.0, 5.0, -5.0, 3600.0, -3600.0))

        def end() -> None:
            if isinstance(party, Resident):
                party.skew += skew_s if self.rmf == "ours" else max(0.0, skew_s)
            elif isinstance(party, DeviceDaemon):
                party.wall_step_s = skew_s
            party.start()

        def begin() -> None:
            party.kill()
            if isinstance(party, Resident):
                self.laws.abandoned(party.name)

        return Ill("restart", party.name, "daemon", begin, end, least_s=0.2, most_s=20.0)

    def _cut(self, random: Random) -> Ill:
        parties: list[Mortal] = [*self.daemons.values(), *self.nodes, *self.robots]
        name = random.choice(parties).name
        lasts_s = random.choice((random.uniform(0.5, 9.0), random.uniform(11.0, 60.0)))

        def begin() -> None:
            self.air.cut_off(name, self.timeline.now + lasts_s)

        return Ill("cut", name, "cut off", begin, lambda: None, lasts_s, lasts_s, exact=True)


class _Defects(logging.Handler):
    """A log handler that ends the day when a daemon logs a defect. Without this handler the daemon
    would contain the defect and go on serving."""

    def emit(self, record: logging.LogRecord) -> None:
        if "defect" in (text := record.getMessage()):
            raise Broken(text)


@contextmanager
def _defects_end_the_day() -> Iterator[None]:
    """End the day if a daemon logs a defect.

    Log nothing below an error, because a whole day's log would fill the memory of a test's process.
    """
    before, defects = logging.root.manager.disable, _Defects(logging.ERROR)
    logging.disable(logging.WARNING)
    logging.root.addHandler(defects)
    try:
        yield
    finally:
        logging.root.removeHandler(defects)
        logging.disable(before)

"""Laws that hold at every moment of the day. They use neither a core's memory nor a daemon's reports.

The laws of `rmf-bridge judge` (`workbench/judge/`) judge all messages that reach the node. The laws
here also use the driven relays at the terminal block, and the true state of cars, doors, robots and
current.

A sensor lies if its wire is stuck or noisy. A node cannot know that. So no law judges the states that
depend on a lying sensor, until a short time after its repair. A cut wire is no excuse, because a node
must notice it.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

from bridges.kinds.charger.signals import CURRENT_FLOWS
from bridges.kinds.lift.signals import Side
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from drivers.lift.table import group
from hal_fakes.plants.charger import ChargerPlant
from hal_fakes.plants.door import DoorPlant
from hal_fakes.plants.lift import LiftPlant
from hal_fakes.plants.plant import Edge
from tests.site.daemons import DeviceDaemon
from tests.site.timeline import EPOCH, HOUR_S, NEVER, Timeline
from tests.site.trouble import Ills
from workbench.judge.judge import LAWS, Judge, JudgedKind
from workbench.judge.law import Verdict
from workbench.judge.lift_history import GRACE_S as RESUMES_S

AT_ONCE_S = 0.3
"""The longest debounce plus one poll plus one scan (s)."""
SENSED_S = 0.3
SETTLES_S = 2.0
STALE_S = 1.0 + AT_ONCE_S
DEAD_TIME_S = 0.29
GRACE_S = 3.0 + AT_ONCE_S
"""The time (s) for which lift outputs may stay on after the session has vanished from the states."""
BOUND_S = 300.0
"""The longest permitted wait (s) of any robot after all repairs."""
LATEST_S = 2.1
LATE_S = 5.0
"""A time (s) above the longest delay of a message. Messages to a node that is cut off may take
longer."""

ARRIVED_S = 3.5
"""The longest time (s) for which the daemon may release a door after RMF has told a robot to enter.

RMF may use a door state that is older than the robot's request. So the request may arrive only after an
earlier CLOSE has taken effect. The limit is the delay of a late message, plus the time until our
supervisor repeats the request.
"""

STATED = (d.LiftState, d.DoorState, d.ChargerState)
NO_DWELL = "D2.people"
"""A law that this test does not judge, because the plants' doors close at once after each push."""
SHOWN = ("floor", "door", "motion")
"""The groups of a lift's input lines from which the daemon derives the door state."""


class Broken(BaseException):
    """A broken law. The text names the law and the time.

    Broken is a BaseException, because a relay's edge may raise it inside a driver's call. A daemon
    catches every ordinary Exception of a driver (`bridges/runtime/contained.py`).
    """


@dataclass
class LiftTruth:
    """The true state of one lift. `open_at` has the last time at which the door was open at each floor.

    `session` is the session in the last published state. `last` is the session before it. If `last`
    returns within RESUMES_S, it counts as resumed, and `offered` stays. `offered` means that the lift
    has shown OPEN at the session's destination.

    `crossing` has the robots on the threshold, and `inside` the robots in the car, each with its time
    of arrival. `ended` has the time of each session's last END.
    """

    open_at: dict[str, float] = field(default_factory=dict)
    session: str = ""
    last: str = ""
    since: float = 0.0
    offered: bool = False
    crossing: dict[str, tuple[str, float]] = field(default_factory=dict)
    inside: dict[str, float] = field(default_factory=dict)
    ended: dict[str, float] = field(default_factory=dict)


class Judges:
    """The judges of one daemon. They do not apply laws about sensors while the device has a trouble
    (ill), and for LATE_S afterwards."""

    def __init__(self, daemon: DeviceDaemon) -> None:
        kind = cast(JudgedKind, daemon.device.kind.name)
        self._name = daemon.name
        self._kind = kind
        self._always = Judge(kind, daemon.name, (law.id for law in LAWS[kind] if not law.sensed))
        self._sensed: Judge | None = None

    def hear(self, heard: Heard, well: bool) -> str:
        """Return the laws that this message breaks, with the evidence."""
        self._always.hear(heard)
        if not well:
            self._sensed = None
        elif self._sensed is None:
            sensed = (law.id for law in LAWS[self._kind] if law.sensed and law.id != NO_DWELL)
            self._sensed = Judge(self._kind, self._name, sensed)
        if self._sensed is not None:
            self._sensed.hear(heard)
        judges = [judge for judge in (self._always, self._sensed) if judge and judge.broken]
        return "; ".join(
            f"{self._name} breaks {judged.law.id}: {judged.evidence[0].text}"
            for judge in judges
            for judged in judge.verdicts()
            if judged.verdict is Verdict.BROKEN
        )


class Laws:
    """All laws of the site. `log` keeps the latest events, to report a failure. `judged_s`: for how
    long the judges of the devices listen in each hour (s). The other laws always hold."""

    def __init__(self, timeline: Timeline, ills: Ills, judged_s: float = HOUR_S) -> None:
        self.log: deque[tuple[float, str]] = deque(maxlen=600)
        self.checks = 0
        self._timeline = timeline
        self._ills = ills
        self._judged_s = judged_s
        self._lifts: dict[str, LiftTruth] = {}
        self._doors: dict[str, float] = {}
        self._currents: dict[str, float] = {}
        self._pads: dict[str, str] = {}
        self._judges: dict[str, Judges] = {}
        self._doorways: dict[str, dict[str, float]] = {}
        self._daemons: dict[str, DeviceDaemon] = {}
        self._relays: dict[str, set[str]] = {}
        self._on_since: dict[str, float] = {}
        self._off_at: dict[tuple[str, str], float] = {}
        self._told: dict[str, str] = {}
        self.speakers: Callable[[str], int] = lambda topic: 1

    def add(self, daemon: DeviceDaemon) -> None:
        """Watch this device."""
        name, plant = daemon.name, daemon.device.plant
        self._daemons[name] = daemon
        self._relays[name] = set()
        if isinstance(plant, LiftPlant):
            self._lifts[name] = LiftTruth()
        elif isinstance(plant, DoorPlant):
            self._doors[name] = -NEVER
            self._doorways[name] = {}
        else:
            self._currents[name] = -NEVER
        daemon.looks, daemon.scanned = self._see, self.scanned
        daemon.relayed = self._relay
        daemon.started, daemon.hears = self._started, self._hears

    def note(self, what: str) -> None:
        """Add a line to the report of a failure."""
        self.log.append((self._timeline.now, what))

    def require(self, holds: bool, law: str) -> None:
        """Fail with the law's text if the law does not hold."""
        self.checks += 1
        if not holds:
            raise Broken(f"at {self._timeline.now:.3f} s: {law}")

    # ---- messages

    def _started(self, daemon: DeviceDaemon) -> None:
        self._judges.pop(daemon.name, None)

    def _hears(self, daemon: DeviceDaemon, topic: topics.Topic[Any], message: Any) -> None:
        """Give a message that has reached the node to the node's judges, if they listen now. Each time
        they begin anew."""
        now = self._timeline.now
        if now % HOUR_S >= self._judged_s:
            self._judges.pop(daemon.name, None)
            return
        if daemon.name not in self._judges:
            self._judges[daemon.name] = Judges(daemon)
        well = self._ills.well_since(daemon.name) + LATE_S < now
        broken = self._judges[daemon.name].hear(Heard(now, EPOCH + now, topic.name, message), well)
        self.require(not broken, broken)

    def heard(self, speaker: str, topic: topics.Topic[Any], message: Any) -> None:
        """Check a message that a party publishes."""
        if speaker in self._daemons and isinstance(message, STATED):
            self._hears(self._daemons[speaker], topic, message)
        match message:
            case d.LiftState():
                self._lift_state(speaker, message)
            case d.DoorState():
                self._door_state(speaker, message)
            case d.ChargerState():
                self._charger_state(speaker, message)
            case d.LiftRequest() if topic == topics.LIFT_REQUESTS:
                self.require(self.speakers(topic.name) == 1, "two supervisors on lift_requests")
                if message.request_type == d.LiftRequestType.REQUEST_END_SESSION:
                    self._lifts[message.lift_name].ended[message.session_id] = self._timeline.now
                self._note_request(message.lift_name, f"{speaker}: {_words(message)}")
            case d.LiftRequest() if message.request_type == d.LiftRequestType.REQUEST_END_SESSION:
                self._lifts[message.lift_name].inside.pop(message.session_id, None)
            case d.DoorRequest() if topic == topics.DOOR_REQUESTS:
                self.require(self.speakers(topic.name) == 1, "two supervisors on door_requests")
                self._note_request(message.door_name, f"{speaker}: {_words(message)}")

    def _note_request(self, name: str, words: str) -> None:
        if self._told.get(f"to {name}") != words:
            self._told[f"to {name}"] = words
            self.note(words)

    def _note_state(self, name: str, words: str) -> None:
        if self._told.get(name) != words:
            self._told[name] = words
            self.note(f"{name} shows {words}")

    def _lift_state(self, name: str, state: d.LiftState) -> None:
        self._note_state(
            name,
            f"{d.LiftMode(state.current_mode).name[5:]} {state.session_id or '-'}"
            f" to {state.destination_floor or '-'}: {state.current_floor or '?'}"
            f" {d.LiftDoor(state.door_state).name[5:]}",
        )
        self.require(name == state.lift_name, f"{name} speaks for {state.lift_name}")
        truth, now = self._lifts[name], self._timeline.now
        before = truth.session
        if state.session_id != before:
            resumed = state.session_id == truth.last and now - truth.since <= RESUMES_S
            truth.offered = truth.offered and (resumed or not state.session_id)
            truth.last = before or truth.last
            truth.session, truth.since = state.session_id, now
            others = sorted(set(truth.inside) - {state.session_id}) if state.session_id else []
            self.require(
                not others, f"{name} is given to {state.session_id} while {others} is in the car"
            )
        if state.door_state != d.LiftDoor.DOOR_OPEN:
            return
        self._open_is_true(name, state)
        sick = self._hazard_since(name)
        admits = state.session_id and not truth.offered
        self.require(
            not (admits and sick + AT_ONCE_S < now), f"{name} lets a robot in under a hazard"
        )
        if state.session_id and state.current_floor == state.destination_floor:
            truth.offered = True

    def _open_is_true(self, name: str, state: d.LiftState) -> None:
        truth, now = self._lifts[name], self._timeline.now
        stale = self._ills.since(name, "bus") + STALE_S < now
        self.require(not stale, f"{name} shows OPEN without a fresh reading")
        lied = any(group(wire) in SHOWN for wire in self._ills.lying(name, SETTLES_S))
        true_at = truth.open_at.get(state.current_floor, -NEVER)
        self.require(
            lied or now - true_at <= self._sensed_s(name),
            f"{name} shows OPEN at {state.current_floor} but is not open there",
        )

    def _sensed_s(self, name: str) -> float:
        """Return the greatest permitted age of a shown state (s). While the bus is down, the daemon may
        show the last reading until that reading is stale."""
        return STALE_S if self._ills.since(name, "bus") <= self._timeline.now else SENSED_S

    def _door_state(self, name: str, state: d.DoorState) -> None:
        mode = d.DoorModeValue(state.current_mode.value)
        self._note_state(name, mode.name[5:])
        self.require(name == state.door_name, f"{name} speaks for {state.door_name}")
        if mode is not d.DoorModeValue.MODE_OPEN:
            return
        now = self._timeline.now
        stale = self._ills.since(name, "bus") + STALE_S < now
        self.require(not stale, f"{name} shows OPEN without a fresh reading")
        lied = {"opened", "closed"} & set(self._ills.lying(name, SETTLES_S))
        true = bool(lied) or now - self._doors[name] <= self._sensed_s(name)
        self.require(true, f"{name} shows OPEN but is not open")

    def _charger_state(self, name: str, state: d.ChargerState) -> None:
        word = d.ChargerStateValue(state.state).name[8:]
        self._note_state(name, f"{word} {state.request_id} {state.error_message}")
        self.require(name == state.charger_name, f"{name} speaks for {state.charger_name}")
        if state.state != d.ChargerStateValue.CHARGER_CHARGING:
            return
        unsure_s = 4.0 if self._ills.any(name) else 1.5
        lied = {"server", "body"} & set(self._ills.lying(name, SETTLES_S))
        true = bool(lied) or self._timeline.now - self._currents[name] <= unsure_s
        self.require(true, f"{name} is CHARGING without current")

    # ---- outputs, and the true state of cars, doors and robots

    def scanned(self, daemon: DeviceDaemon) -> None:
        """Check the laws after a scan of a device."""
        name = daemon.name
        self._see(daemon, self._timeline.now)
        if name in self._lifts:
            self._lift_outputs(name)
            self._thresholds(name)
        elif name in self._doors:
            self._door_outputs(name)
            self._doorway(name)

    def _see(self, daemon: DeviceDaemon, at: float) -> None:
        """Note the true state of a lift or door up to this time."""
        name, plant = daemon.name, daemon.device.plant
        if isinstance(plant, LiftPlant):
            if plant.car.standing and plant.doors[Side.FRONT].opened:
                floor = daemon.device.settings.levels()[plant.car.floor]
                self._lifts[name].open_at[floor] = at
        elif isinstance(plant, DoorPlant):
            if plant.contact("opened"):
                self._doors[name] = at
        elif isinstance(plant, ChargerPlant) and plant.activity in CURRENT_FLOWS:
            self._currents[name] = at

    def _relay(self, edge: Edge) -> None:
        """Check an edge of a relay. Ignore a charger's edges, because they are only the pulses that
        clear errors."""
        name, now = edge.device, self._timeline.now
        plant = self._daemons[name].device.plant
        if isinstance(plant, ChargerPlant):
            return
        self.note(f"{name}: {edge.signal} {'on' if edge.value else 'off'}")
        on = self._relays[name]
        if edge.value and not on:
            self._on_since[name] = now
        (on.add if edge.value else on.discard)(edge.signal)
        if not edge.value:
            self._off_at[name, edge.signal] = now
        if isinstance(plant, LiftPlant):
            self._lift_relay(name, edge)
        elif isinstance(plant, DoorPlant) and not edge.value:
            self._door_lets_go(name, plant)

    def _lift_relay(self, name: str, edge: Edge) -> None:
        on, calls = self._relays[name], edge.signal.startswith("call_")
        called = [signal for signal in on if signal.startswith("call_")]
        self.require(len(called) <= 1, f"{name} drives calls for two floors at once")
        self.require(
            not (called and "door_open" in on), f"{name} is called while its door is held open"
        )
        if calls and edge.value:
            rested_s = self._timeline.now - self._off_at.get((name, "door_open"), -NEVER)
            self.require(
                rested_s > DEAD_TIME_S, f"{name} is called too soon after its door is let go"
            )
        if edge.signal == "door_open" and not edge.value:
            self._lets_nobody_go(name, {r: at for r, (_, at) in self._lifts[name].crossing.items()})

    def _door_lets_go(self, name: str, plant: DoorPlant) -> None:
        daemon = self._daemons[name]
        if not daemon.device.settings.pulse:
            self._lets_nobody_go(name, self._doorways[name])
            self._not_onto_an_obstruction(name, plant)

    def _lets_nobody_go(self, name: str, crossing: dict[str, float]) -> None:
        """Require that a healthy door stays held while a robot is in its doorway or on its threshold.

        In the first ARRIVED_S of the crossing the door may still be released.
        """
        for robot, since in crossing.items():
            just = self._timeline.now - since < ARRIVED_S
            excused = just or self._excused(name, robot, since)
            self.require(excused, f"{name} is released with {robot} in it")

    def _not_onto_an_obstruction(self, name: str, plant: DoorPlant) -> None:
        if not self._daemons[name].alive or "obstruction" not in plant._sensors:
            return
        seen = plant.contact("obstruction") and plant.sense("obstruction")
        since = max(self._ills.well_since(name), self._ills.obstructed_since(name))
        if seen and not plant.contact("closed"):
            early = since + AT_ONCE_S > self._timeline.now
            self.require(early, f"{name} releases its door onto an obstruction")

    def _hazard_since(self, name: str) -> float:
        """Return the time at which the node could first see a hazard, or inf without a hazard."""
        return max(self._ills.hazard_since(name), self._ills.since_over(name, "bus", "daemon"))

    def _lift_outputs(self, name: str) -> None:
        on, now, truth = self._relays[name], self._timeline.now, self._lifts[name]
        if not on:
            return
        sighted = not self._ills.has(name, "bus")
        sick = self._hazard_since(name) + AT_ONCE_S < now
        self.require(not (sighted and sick), f"{name} drives {sorted(on)} under a hazard")
        # A session may end before a state shows its end, and a request or END may arrive late, above
        # all after the lift was cut off. So the grace period begins at the latest of these times.
        found_again = self._ills.since_over(name, "cut off")
        ended = (at + LATEST_S for at in (found_again, *truth.ended.values()))
        since = max(truth.since, self._ills.since_over(name, "bus"), *ended)
        over = max(since + GRACE_S, self._on_since[name] + AT_ONCE_S) < now
        self.require(
            not (sighted and over and not truth.session),
            f"{name} drives {sorted(on)} without a request",
        )
        self.require(on == {"agv_mode_request"} or "agv_mode_request" in on, f"{name}: {on}")

    def _door_outputs(self, name: str) -> None:
        """Require that a fire ends the hold of a door with `on_fire: release`, even if RMF requests
        OPEN."""
        releases = self._daemons[name].device.settings.on_fire == "release"
        sick = self._hazard_since(name) + AT_ONCE_S < self._timeline.now
        held = releases and sick and self._relays[name] and not self._ills.has(name, "bus")
        self.require(not held, f"{name} holds its door in a fire that must release it")

    # ---- robots

    def boards(self, robot: str, lift: str, floor: str) -> None:
        """Let a robot enter the car over its threshold, with RMF's permission."""
        truth = self._lifts[lift]
        self.note(f"{robot} goes into {lift} at {floor}")
        if self._by_old_states(robot, lift):
            return
        others = sorted(set(truth.inside) - {robot})
        self.require(not others, f"{robot} is let into {lift}, where {others} is")
        truth.inside[robot] = self._timeline.now
        truth.crossing[robot] = (floor, self._timeline.now)

    def leaves(self, robot: str, lift: str, floor: str) -> None:
        """Let a robot leave the car over its threshold."""
        self.note(f"{robot} goes out of {lift} at {floor}")
        if self._by_old_states(robot, lift):
            return
        self._lifts[lift].crossing[robot] = (floor, self._timeline.now)

    def in_doorway(self, robot: str, door: str) -> None:
        """Let a robot stand in the doorway."""
        self.note(f"{robot} is in the doorway of {door}")
        self._doorways[door][robot] = self._timeline.now

    def crossed(self, robot: str) -> None:
        """Forget the robot's crossing. The robot has crossed, or its place is unknown."""
        for truth in self._lifts.values():
            truth.crossing.pop(robot, None)
        for doorway in self._doorways.values():
            doorway.pop(robot, None)

    def is_out(self, robot: str, lift: str) -> None:
        """Note that the robot is out of the car."""
        self._lifts[lift].inside.pop(robot, None)

    def abandoned(self, robot: str) -> None:
        """Forget the robot's crossing and ride. From now on a supervisor may send requests in the
        robot's name that the robot did not send."""
        self.crossed(robot)
        for truth in self._lifts.values():
            truth.inside.pop(robot, None)

    def _thresholds(self, name: str) -> None:
        """Require that the car of a healthy lift stands open for each robot on its threshold."""
        truth = self._lifts[name]
        for robot, (floor, since) in truth.crossing.items():
            if self._excused(name, robot, since):
                continue
            open_now = truth.open_at.get(floor) == self._timeline.now
            self.require(open_now, f"{name} is not open for {robot} on its threshold at {floor}")

    def _excused(self, name: str, robot: str, since: float) -> bool:
        """Return whether an ill of the device or old states explain a crossing since this time."""
        return self._ills.well_since(name) + LATE_S > since or self._sees_old(robot, since)

    def _sees_old(self, robot: str, at: float) -> bool:
        """Return whether the robot's adapter had just been cut off at this time.

        Such an adapter gets the old states in one burst, and RMF's phases do not read their stamps.
        """
        return self._ills.since_over(robot, "cut off") + LATE_S > at

    def _by_old_states(self, robot: str, lift: str) -> bool:
        """Return whether the robot crosses the threshold although the lift does not serve it now.

        RMF's phase ended at an old state, and the robot has then waited for the open car. The lift may
        have ended this session long ago, and may serve another robot.
        """
        shown = self._lifts[lift].session
        return shown not in ("", robot) or self._sees_old(robot, self._timeline.now)

    def _doorway(self, name: str) -> None:
        for robot, since in self._doorways[name].items():
            if self._excused(name, robot, since):
                continue
            open_now = self._doors[name] == self._timeline.now
            self.require(open_now, f"{name} is not open for {robot} in its doorway")

    def lift_is_open(self, lift: str, floor: str) -> bool:
        """Return whether the lift really stands open at this floor now."""
        self._daemons[lift].advance()
        self._see(self._daemons[lift], self._timeline.now)
        return self._lifts[lift].open_at.get(floor) == self._timeline.now

    def door_is_open(self, door: str) -> bool:
        """Return whether the door is really open now."""
        self._daemons[door].advance()
        self._see(self._daemons[door], self._timeline.now)
        return self._doors[door] == self._timeline.now

    def on_pad(self, robot: str, charger: str) -> None:
        """Note a robot's arrival on a pad."""
        before = self._pads.get(charger)
        self.require(before is None, f"{robot} drives onto {charger}, where {before} is")
        self._pads[charger] = robot
        self.note(f"{robot} is on the pad of {charger}")

    def off_pad(self, robot: str, charger: str) -> None:
        """Note that the robot has left the pad."""
        del self._pads[charger]
        self.note(f"{robot} has left the pad of {charger}")

    # ---- the longest wait, and the end of the day

    def waits(self, robot: str, what: str, since: float) -> None:
        """Require a robot's wait to be short enough."""
        calm_since = self._ills.calm_since()
        waited = self._timeline.now - max(since, calm_since)
        self.require(
            waited <= BOUND_S,
            f"{robot} has waited for {what} since {since:.0f} s, and"
            f" everything has been well since {calm_since:.0f} s",
        )

    def at_rest(self) -> None:
        """Require at the end of the day that no output is on, no lift shows a session, every door is
        closed and no daemon has a fault."""
        for name, on in self._relays.items():
            self.require(not on, f"{name} drives {sorted(on)} at the end of the day")
        for name, truth in self._lifts.items():
            self.require(not truth.session, f"{name} shows {truth.session} at the end of the day")
        for name in self._doors:
            closed = self._daemons[name].device.plant.contact("closed")
            self.require(closed, f"{name} is not closed at the end of the day")
        for name, daemon in self._daemons.items():
            self.require(not daemon.faults(), f"{name}: {daemon.faults()} at the end of the day")


def _words(request: d.LiftRequest | d.DoorRequest) -> str:
    if isinstance(request, d.DoorRequest):
        mode = d.DoorModeValue(request.requested_mode.value).name[5:]
        return f"{request.door_name} is to be {mode}"
    word = d.LiftRequestType(request.request_type).name[8:]
    return f"{request.lift_name}: {word} {request.session_id} to {request.destination_floor or '-'}"

"""The site's two fire panels and three fleet adapters. Once a day they run drills and alarms, with
troubles.

The panels have their own part of the network. Each panel has its own daemon, which may die and start
again. A fleet adapter stops or releases its robots as the last message on `fire_alarm_trigger` says. An
adapter may also restart or lose its network. Between the exercises no daemon runs, so they cost no
time.

Laws:
- Every reachable fleet hears of an alarm within TOLD_S, once the panel's daemon can see the alarm's
  cause.
- A daemon publishes `false` only after all of its causes have ended and a person has reset it. At that
  time no other panel may have an alarm.
- A daemon calls a drill a drill in its state. The drill ends at its time, without a reset.
- After each exercise every robot may drive again. `rmf-bridge judge alarm` finds no broken law of any
  panel.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from random import Random
from typing import Any

from msgspec.structs import replace

from bridges.kinds.alarm import KIND
from bridges.kinds.shared.decision import DrillOrdered, OperatorReset
from bridges.kinds.shared.fleet_alarm_memory import (
    FleetAlarmLimits,
)
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.runtime.clock import Clock
from bridges.runtime.diagnostics import diagnosis
from bridges.runtime.fleet_alarm import ALARM, FleetAlarmNode
from bridges.settings.load import load
from drivers.alarm import dry_contact
from hal_fakes.plants.alarm import PanelPlant
from tests.drivers.far import PointsFar
from tests.runtime.virtual_graph import Disk
from tests.site.building import CONFIG, Device
from tests.site.daemons import LEAST_GAP_S, DeviceDaemon
from tests.site.network import Air, Place, Weather
from tests.site.timeline import EPOCH, NEVER, Alarm, Timeline
from workbench.judge.judge import Judge
from workbench.judge.law import Verdict

FIRST_S, EVERY_S = 40.0, 86400.0
CASE_S = 150.0
"""The length of one exercise (s)."""
TOLD_S = 3.0
"""The longest time (s) until a reachable fleet hears of an alarm. It is the sum of the debounce time,
the delay of a late message, and a scan."""
KNOWN_S = 4.0
"""The time (s) after which every panel knows another panel's alarm. It is the delay of a late message
plus the period of the states."""
DRILL_S = 40.0
PANELS, FLEETS = ("north", "south"), ("tiny", "deliver", "clean")
SOURCES = ("fire_panel", "code_blue")

Require = Callable[[bool, str], None]


class Panel:
    """A panel, and its daemon, which tells the panel's alarm to the fleets.

    `cause_at`: the time from which the daemon could see an alarm's cause. It is NEVER without a cause,
    and again after a person's reset. `drills_until`: the planned end of a drill.
    """

    def __init__(self, timeline: Timeline, air: Air, name: str) -> None:
        self.name = name
        self.cause_at = NEVER
        self.drills_until = -NEVER
        self._timeline = timeline
        self._air = air
        shipped: Any = load(CONFIG / "alarm_panel.yaml").devices["Main panel"]
        settings = replace(shipped, drill_s=DRILL_S)
        wires = dry_contact.wires(settings)
        self.plant = PanelPlant(name, wires)
        self.far = PointsFar(timeline, self.plant, wires)
        self.silent_s: float = settings.silent_alarm_after_s
        device = Device(
            name,
            KIND,
            settings,
            self.plant,
            self.far,
            "dry_contact",
            lambda: dry_contact.create(name, settings, self.far),
            dry_contact.debounce(settings),
            0.0,
        )
        self.daemon = DeviceDaemon(timeline, air, device, f"device {name}")
        self.daemon.scanned = self._scanned
        self._disk = Disk()
        self._clock = Clock(lambda: timeline.now, lambda: EPOCH + timeline.now)
        self._alarm = Alarm(timeline, self._round)
        self._place: Place
        self.node: FleetAlarmNode

    def start(self) -> None:
        """Start a new daemon, which remembers only what is on its disk."""
        self._place = Place(self._air, self.name, self._round)
        limits = FleetAlarmLimits(topics.FIRE_ALARM_TRIGGER, devices=frozenset({self.name}))
        self.node = FleetAlarmNode(
            limits, self._place, self._clock, lambda topic: topic, self._disk
        )
        self._states = self._place.publisher(topics.DIAGNOSTICS)
        self.node.subscribe()
        self.daemon.start()
        self._tell()

    def kill(self) -> None:
        """Kill the daemon."""
        self._alarm.set(NEVER)
        self._place.close()
        self.daemon.kill()

    def press(self, signal: str, on: bool) -> None:
        """Set or release a contact of the panel, as an alarm or a person does."""
        self.plant.press(signal, on, self._timeline.now)
        self.daemon.look()

    def orders(self, for_s: float) -> None:
        """Order a drill, as `rmf-bridge drill` does."""
        self.node.obey(DrillOrdered(for_s))
        self._round()

    def resets(self) -> str:
        """Reset the daemon. Return why the reset was refused."""
        self.node.obey(OperatorReset())
        self.daemon.reset()
        self._round()
        return self.node.subjects[ALARM].ordered[1]

    def state(self) -> str:
        """Return the alarm's state as the daemon reports it."""
        return str(self.status()["alarm"]["state"])

    def status(self) -> Any:
        """Return the daemon's part of the status file."""
        return self.node.beside({"faults": [], "heard_by": {}, "hears": {}})

    def _scanned(self, daemon: DeviceDaemon) -> None:
        decision = daemon._node.subject.decision
        assert decision is not None
        assert KIND.alarm_inputs is not None
        self.node.tell(self.name, KIND.alarm_inputs(decision.report))
        self._round()

    def _round(self) -> None:
        if self.daemon.alive:
            self.node.round()
            self._alarm.set(max(self.node.wake_at, self._timeline.now + LEAST_GAP_S))

    def _tell(self) -> None:
        """Publish the alarm's state on `/diagnostics`, each second."""
        if self.daemon.alive:
            self.node.look()
            told = diagnosis(self.name, "alarm", self.status(), {}, stamp(self._clock.wall()))
            self._states.publish(told)
            self._timeline.after(1.0, self._tell)


class FleetAdapter:
    """A fleet adapter. `stands`: whether the last message told its robots to stand still. `since`: the
    time from which the adapter can be reached."""

    def __init__(self, timeline: Timeline, air: Air, name: str) -> None:
        self.name = name
        self.stands = False
        self.since = NEVER
        self._timeline = timeline
        self._air = air
        self._place: Place | None = None

    def restart(self) -> None:
        """Start a new fleet adapter, which hears the retained messages."""
        if self._place is not None:
            self._place.close()
        self.stands, self.since = False, self._timeline.now
        self._place = Place(self._air, self.name, lambda: None)
        self._place.subscribe(topics.FIRE_ALARM_TRIGGER, self._hear)

    def cut_off(self, for_s: float) -> None:
        """Cut the fleet adapter off the graph."""
        self.since = self._timeline.now + for_s
        self._air.cut_off(self.name, self.since)

    def _hear(self, message: d.Bool) -> None:
        self.stands = message.data


@dataclass
class FirePanels:
    """All panels and fleet adapters. `done` counts the exercises by name."""

    timeline: Timeline
    random: Random
    require: Require
    done: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.air = Air(self.timeline, self.random)
        self.air.weather = Weather(lost=0.0, states_lost=0.0)  # RELIABLE loses nothing
        self.air.watch = self._said
        self._judges = {name: Judge("alarm", name) for name in PANELS}
        ear = Place(self.air, "judge", lambda: None)
        for topic in (topics.FIRE_ALARM_TRIGGER.live(), topics.DIAGNOSTICS):
            ear.subscribe(topic, partial(self._hears, ear, topic))
        self.panels = {name: Panel(self.timeline, self.air, name) for name in PANELS}
        self.fleets = [FleetAdapter(self.timeline, self.air, name) for name in FLEETS]
        self._cases = [
            self._key,
            self._order,
            self._fire_in_a_drill,
            self._two_panels,
            self._death,
            self._death_in_a_drill,
            self._silence,
            self._cut_loop,
            self._late_fleet,
            self._fleet_out_of_reach,
        ]
        self._case = ""
        self._open = False

    def open(self) -> None:
        """Plan the first day's exercises."""
        self.timeline.after(FIRST_S, self._exercise)

    def _exercise(self) -> None:
        self._open = True
        for panel in self.panels.values():
            panel.start()
        for fleet in self.fleets:
            fleet.restart()
        cases = self.random.sample(self._cases, len(self._cases))
        for number, case in enumerate(cases):
            self.timeline.after(10.0 + number * CASE_S, partial(self._begin, case))
        self.timeline.after(10.0 + len(cases) * CASE_S, self._close)
        self.timeline.after(EVERY_S, self._exercise)
        self._watch()

    def _close(self) -> None:
        self._open = False
        for panel in self.panels.values():
            panel.kill()

    def _begin(self, case: Callable[[Panel, Panel], None]) -> None:
        self._case = case.__name__.strip("_").replace("_", " ")
        one, other = self.random.sample([*self.panels.values()], 2)
        case(one, other)
        self.timeline.after(CASE_S - 1.0, self._end)

    def _end(self) -> None:
        """Require that the exercise is over."""
        for panel in self.panels.values():
            self._law(panel.state() == "quiet", f"{panel.name} is {panel.state()}")
        for fleet in self.fleets:
            self._law(not fleet.stands, f"{fleet.name} stands without an alarm")
        self.done[self._case] = self.done.get(self._case, 0) + 1

    def _hears(self, ear: Place, topic: topics.AnyTopic, message: Any) -> None:
        now = self.timeline.now
        for name, judge in self._judges.items():
            judge.hear(Heard(now, EPOCH + now, topic.name, message, ear.sender()))
            found = [one for one in judge.verdicts() if one.verdict is Verdict.BROKEN]
            self._law(not found, f"{name} breaks {[(one.law.id, one.evidence) for one in found]}")

    def _law(self, holds: bool, law: str) -> None:
        self.require(holds, f"exercise '{self._case}': {law}")

    # ---- the laws

    def _watch(self) -> None:
        """Check that each reachable fleet stands still during an alarm or drill. Check also that each
        daemon reports a drill as a drill."""
        if not self._open:
            return
        now = self.timeline.now
        for panel in self.panels.values():
            drills = now < panel.drills_until - 1.0 and panel.cause_at == NEVER
            if panel.daemon.alive and drills and not self._begun(panel):
                self._law(panel.state() == "drill", f"{panel.name} calls a drill {panel.state()}")
            if panel.cause_at + TOLD_S > now and not drills:
                continue
            for fleet in self.fleets:
                told = fleet.since + TOLD_S > now or fleet.stands or self._begun(panel)
                self._law(told, f"{fleet.name} drives during an alarm of {panel.name}")
        self.timeline.after(0.5, self._watch)

    def _begun(self, panel: Panel) -> bool:
        """Has the drill only just begun?"""
        return self.timeline.now < panel.drills_until - DRILL_S + TOLD_S

    def _said(self, speaker: str, topic: topics.Topic[Any], message: Any) -> None:
        """Check that a panel does not publish `false` while the alarm of any panel lasts."""
        if topic != topics.FIRE_ALARM_TRIGGER or message.data:
            return
        for panel in self.panels.values():
            known_s = TOLD_S if panel.name == speaker else KNOWN_S
            stands = panel.cause_at + known_s < self.timeline.now
            self._law(not stands, f"{speaker} publishes false in an alarm of {panel.name}")

    # ---- what people and the building do

    def _in(self, seconds: float, what: Callable[[], Any]) -> None:
        self.timeline.after(seconds + self.random.uniform(0.0, 2.0), what)

    def _burns(self, panel: Panel, signal: str = "") -> Callable[[], None]:
        """Activate one of the panel's contacts. Return the function that releases the contact."""
        signal = signal or self.random.choice(SOURCES)
        panel.press(signal, True)
        self._sees(panel)
        return lambda: panel.press(signal, False)

    def _sees(self, panel: Panel, after_s: float = 0.0) -> None:
        panel.cause_at = min(panel.cause_at, self.timeline.now + after_s)
        panel.drills_until = -NEVER

    def _reset(self, panel: Panel) -> None:
        """Reset a panel whose causes are over."""
        panel.cause_at = NEVER
        why = panel.resets()
        self._law(not why, f"{panel.name} refuses its reset: {why}")

    def _refused(self, panel: Panel) -> None:
        """Reset a panel whose cause is not over."""
        self._law("not over" in panel.resets(), f"{panel.name} is reset during its alarm")

    def _restart(self, panel: Panel, after_s: float) -> None:
        panel.kill()
        for fleet in self.fleets:  # a fleet hears `true` again only from the new daemon
            fleet.since = max(fleet.since, self.timeline.now + after_s)
        self.timeline.after(after_s, panel.start)

    def _drill(self, panel: Panel) -> None:
        panel.orders(DRILL_S)
        panel.drills_until = self.timeline.now + DRILL_S

    # ---- the exercises: each gets the two panels in random order

    def _key(self, one: Panel, other: Panel) -> None:
        one.press("drill", True)
        one.drills_until = self.timeline.now + DRILL_S
        self._in(DRILL_S + 20.0, lambda: one.press("drill", False))

    def _order(self, one: Panel, other: Panel) -> None:
        self._drill(one)

    def _fire_in_a_drill(self, one: Panel, other: Panel) -> None:
        self._drill(one)
        burning = self.random.choice((one, other))
        self._in(10.0, lambda: self._in(30.0, self._burns(burning)))
        self._in(20.0, lambda: self._refused(burning))
        self._in(60.0, lambda: self._reset(burning))

    def _two_panels(self, one: Panel, other: Panel) -> None:
        self._in(0.0, lambda: self._in(30.0, self._burns(one)))
        self._in(5.0, lambda: self._in(60.0, self._burns(other)))
        self._in(40.0, lambda: self._reset(one))
        self._in(50.0, lambda: self._refused(other))
        self._in(80.0, lambda: self._reset(other))

    def _death(self, one: Panel, other: Panel) -> None:
        self._in(20.0, self._burns(one))
        self._in(self.random.uniform(3.0, 40.0), lambda: self._restart(one, 5.0))
        self._in(60.0, lambda: self._reset(one))

    def _death_in_a_drill(self, one: Panel, other: Panel) -> None:
        self._drill(one)

        def dies() -> None:
            one.drills_until = -NEVER
            self._restart(one, 5.0)

        self._in(20.0, dies)

    def _silence(self, one: Panel, other: Panel) -> None:
        one.far.down = "the module does not answer"
        self._sees(one, one.silent_s + 1.0)

        def comes_back() -> None:
            one.far.down = ""
            one.daemon.look()

        self._in(one.silent_s + 20.0, comes_back)
        self._in(one.silent_s + 40.0, lambda: self._reset(one))

    def _cut_loop(self, one: Panel, other: Panel) -> None:
        signal = self.random.choice(SOURCES)
        one.plant.fail(signal, "off")
        one.daemon.look()
        self._sees(one)

        def is_mended() -> None:
            one.plant.fail(signal, None)
            one.daemon.look()

        self._in(20.0, is_mended)
        self._in(40.0, lambda: self._reset(one))

    def _late_fleet(self, one: Panel, other: Panel) -> None:
        self._in(60.0, self._burns(one))
        self._in(10.0, self.random.choice(self.fleets).restart)
        self._in(80.0, lambda: self._reset(one))

    def _fleet_out_of_reach(self, one: Panel, other: Panel) -> None:
        self.random.choice(self.fleets).cut_off(self.random.uniform(5.0, 30.0))
        self._in(2.0, lambda: self._in(60.0, self._burns(one)))
        self._in(90.0, lambda: self._reset(one))

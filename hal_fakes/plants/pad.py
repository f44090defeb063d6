"""A wireless charger with a receiver that is switched: its pad, the robot on it, battery and heat.

To press: `robot` (one stands on the pad), or a `stranger` with a receiver of its own, `misparked`
(beside the middle), `foreign_object` (something lies on the pad), `transmitter_fault`. To drive:
`enable` (may it charge?), `check_range`, `clear_error`.

A robot comes with its battery 40 % full. The pad rises to it; where gap and position are right and it
is enabled, the two shake hands and charge until the battery is full. Current warms the coil, and a fan
cools it. What goes wrong is an error until its cause has gone and `enable` is off, or it is cleared.

Failing parts and what `off`, `stuck`, `slow`, `garbage` and `wrong` do to them:

|          | off              | stuck            | slow         | garbage          | wrong         |
| pad      | stays down       | stays as it is   | rises slowly | stops half way   | rises too far |
| receiver | never answers    | in the handshake | 10 x as long | contact is lost  | wrong answer  |
| battery  | draws no current | never fills      | fills slowly | draws no current | comes full    |

A failing `fan` lets the coil heat up, and a failing `thermometer` is an error, whatever the mode.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from bridges.charger.signals import CURRENT_FLOWS, Activity
from hal_fakes.plants.machine import Machine
from hal_fakes.plants.plant import FailureMode

HANDSHAKE_S: Final = 1.0
RANGE_S: Final = 0.4
SLOWNESS: Final = 10.0
FILL_S: Final = 60.0
ARRIVES_WITH: Final = 0.4
LOST_AFTER_S: Final = 1.0
RAMP_DOWN_S: Final = 0.5
RESTART_DELAY_S: Final = 1.0
NEVER: Final = float("inf")

CLEARANCE_MM: Final = 60.0
"""Between a robot's receiver and the pad when it is down."""
RISE_MM: Final = 40.0
TOO_FAR_MM: Final = 52.0
"""How high the pad rises, and how high it does when it does not stop where it should."""
RISE_S: Final = 0.4
GAP_MM: Final = (10.0, 30.0)
"""Where the two can couple."""
OFFSET_MM: Final = {False: 5.0, True: 80.0}
"""How far a robot stands from the middle of the pad, parked well and misparked."""
OFFSET_MAX_MM: Final = 40.0

AMBIENT_C: Final = 25.0
COOLED_C: Final = 60.0
UNCOOLED_C: Final = 140.0
TRIP_C: Final = 95.0
WARMS_IN_S: Final = 20.0
FULL_V, EMPTY_V, CURRENT_A = 29.2, 24.0, 30.0

LINKS: Final = ("node", "heartbeat", "bus", "unit", "server")
"""Parts of the wire, on CAN and on Modbus: its far side has those."""
PARTS: Final = ("pad", "receiver", "fan", "battery", "thermometer", *LINKS)
ROBOTS: Final = ("robot", "stranger")
BUTTONS: Final = ("foreign_object", "misparked", *ROBOTS, "transmitter_fault")
STATION_CAUSES: Final = ("foreign_object", "transmitter_fault")


@dataclass(frozen=True, slots=True)
class PadReading:
    """What the controllers know at one instant. `progress`: of the activity, 0-1. `faults`: by name.

    `range_result`: of the last range check: `none`, `ongoing`, `in`, `out` or `failed`.
    """

    activity: Activity
    progress: float
    faults: frozenset[str]
    robot: bool
    stranger: bool
    gap_mm: float
    offset_mm: float
    in_range: bool
    at_height: bool
    range_result: str
    enabled: bool
    volts: float
    amps: float
    battery: float
    coil_c: float
    failures: Mapping[str, FailureMode]


class PadPlant(Machine):
    """`battery`: 0-1, of the robot on the pad; nobody's when there is none.

    `pace`: how many times as fast as a real one it shakes hands, moves and stops.
    """

    def __init__(self, name: str, pace: float = 1.0) -> None:
        super().__init__(name, parts=PARTS, buttons=BUTTONS)
        self._pace = pace
        self.activity = Activity.IDLE
        self.faults: frozenset[str] = frozenset()
        self.battery = 0.0
        self.height_mm = 0.0
        self.enabled = False
        self._occupied = False
        self._since, self._until = 0.0, NEVER
        self._rising_until = NEVER
        self._range, self._range_until = "none", NEVER
        self._coil_c, self._coil_at = AMBIENT_C, 0.0

    # ---- what a controller sees and does

    def sense(self, signal: str) -> bool:
        """Is what can be pressed there?"""
        return self.contact(signal)

    def reading(self) -> PadReading:
        """Everything at once."""
        lasts = self._until - self._since
        progress = 0.0 if lasts in (0.0, NEVER) else (self.now - self._since) / lasts
        flows = self.activity in CURRENT_FLOWS
        draws = flows and self.failures.get("battery") not in ("off", "garbage")
        return PadReading(
            activity=self.activity,
            progress=progress,
            faults=self.faults,
            robot=self._there(),
            stranger=self.pressed["stranger"],
            gap_mm=CLEARANCE_MM - self.height_mm,
            offset_mm=OFFSET_MM[self.pressed["misparked"]],
            in_range=self.in_range(),
            at_height=self.height_mm == RISE_MM,
            range_result=self._range,
            enabled=self.enabled,
            volts=EMPTY_V + (FULL_V - EMPTY_V) * self._filled() if self._there() else 0.0,
            amps=CURRENT_A if draws else 0.0,
            battery=self._filled(),
            coil_c=self._warmth(),
            failures=dict(self.failures),
        )

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        """`enable` is a level, the others are asked for by True."""
        if signal not in ("enable", "check_range", "clear_error"):
            raise KeyError(signal)
        self.advance(now)
        if signal == "enable" and asserted == self.enabled:
            return
        self.note("relay", signal, asserted)
        if signal == "enable":
            self.enabled = asserted
        elif signal == "check_range":
            self._range, self._range_until = "ongoing", self.now + RANGE_S / self._pace
        elif not self._causes():
            self._recover()
        self._settle()

    def in_range(self) -> bool:
        """Can the two coils couple?"""
        gap = CLEARANCE_MM - self.height_mm
        near = OFFSET_MM[self.pressed["misparked"]] <= OFFSET_MAX_MM
        return self._there() and near and GAP_MM[0] <= gap <= GAP_MM[1]

    # ---- physics

    def contact(self, signal: str) -> bool:
        """Is the robot, or what is pressed, there?"""
        return self.pressed[signal]

    def event_at(self) -> float:
        """When something under way ends by itself."""
        return min(self._until, self._rising_until, self._range_until, self._trips_at())

    def act(self, signal: str, asserted: bool) -> None:
        """A robot comes or leaves."""
        if self._there() != self._occupied:
            self._occupied = asserted
            full = self.failures.get("battery") == "wrong"
            self.battery = (1.0 if full else ARRIVES_WITH) if asserted else 0.0
            self._move(asserted)

    def _there(self) -> bool:
        return any(self.pressed[robot] for robot in ROBOTS)

    def run(self) -> None:
        """What is due ends, and what the pad, the heat and the causes demand begins."""
        self._warm()
        if self.now >= self._rising_until:
            self._rising_until = NEVER
            self.height_mm = self._target_mm()
            self.note("sensor", "gap_mm", CLEARANCE_MM - self.height_mm)
        if self.now >= self._range_until:
            self._range_until = NEVER
            lost = self.failures.get("receiver") == "off"
            self._range = "failed" if lost else "in" if self.in_range() else "out"
        if self.now >= self._until:
            self._end()
        self._react()

    def _react(self) -> None:
        busy = self.activity in (*CURRENT_FLOWS, Activity.HANDSHAKE)
        causes = self._causes()
        if busy and causes:
            self._fault(causes)
        elif busy and not self._there():
            self._enter(Activity.RELEASED, RESTART_DELAY_S / self._pace)
        elif self.activity in (Activity.CHARGING, Activity.HANDSHAKE) and not self.enabled:
            self._stop()
        elif self.activity is Activity.ERROR and not causes and not self.enabled:
            self._recover()
        elif self.activity is Activity.IDLE and self._wants():
            slow = self.failures.get("receiver") == "slow"
            self._enter(Activity.HANDSHAKE, HANDSHAKE_S / self._pace * (SLOWNESS if slow else 1.0))

    def _wants(self) -> bool:
        there = self._there() and self.failures.get("receiver") != "off"
        return there and self.enabled and self._filled() < 1.0 and not self._causes()

    def _causes(self) -> frozenset[str]:
        found = {name for name in STATION_CAUSES if self.pressed[name]}
        if self._warmth() >= TRIP_C:
            found.add("over_temperature")
        if "thermometer" in self.failures:
            found.add("thermometer")
        return frozenset(found)

    def _stop(self) -> None:
        if self.activity is Activity.CHARGING:
            self.battery = self._filled()
            self._enter(Activity.STOPPING, RAMP_DOWN_S / self._pace)
        else:
            self._enter(Activity.RELEASED, RESTART_DELAY_S / self._pace)

    def _recover(self) -> None:
        if self.activity is Activity.ERROR:
            self.faults = frozenset()
            self._enter(Activity.IDLE)

    def _end(self) -> None:
        """The activity under way has run its time."""
        receiver = self.failures.get("receiver")
        match self.activity:
            case Activity.HANDSHAKE if receiver == "stuck":
                self._until = NEVER
            case Activity.HANDSHAKE if receiver == "wrong":
                self._fault(frozenset({"authentication"}))
            case Activity.HANDSHAKE if not self.in_range():
                wide = CLEARANCE_MM - self.height_mm > GAP_MM[1]
                off = self.pressed["misparked"]
                self._fault(frozenset({"too_far" if wide or off else "too_near"}))
            case Activity.HANDSHAKE:
                lost = receiver == "garbage"
                self._enter(Activity.CHARGING, LOST_AFTER_S if lost else self._fills_in_s())
            case Activity.CHARGING if receiver == "garbage":
                self._fault(frozenset({"contact_lost"}))
            case Activity.CHARGING:
                self.battery = 1.0
                self._enter(Activity.STOPPING, RAMP_DOWN_S / self._pace)
            case Activity.STOPPING:
                self._enter(Activity.RELEASED, RESTART_DELAY_S / self._pace)
            case _:
                self._enter(Activity.IDLE)

    def _fault(self, faults: frozenset[str]) -> None:
        self.battery = self._filled()
        self.faults = faults
        self._enter(Activity.ERROR)

    def _enter(self, activity: Activity, lasts_s: float = NEVER) -> None:
        self._warm()
        self._since, self._until = self.now, self.now + lasts_s
        if activity is not self.activity:
            self.activity = activity
            self.note("sensor", "state", str(activity))

    # ---- pad, battery, heat

    def _move(self, robot: bool) -> None:
        """The pad rises to a robot that comes, and sinks when it leaves."""
        mode = self.failures.get("pad")
        if not robot:
            self.height_mm, self._rising_until = 0.0, NEVER
        elif mode not in ("off", "stuck"):
            self._rising_until = self.now + RISE_S / self._pace * (
                SLOWNESS if mode == "slow" else 1.0
            )

    def _target_mm(self) -> float:
        mode = self.failures.get("pad")
        return {"wrong": TOO_FAR_MM, "garbage": RISE_MM / 2, "off": 0.0}.get(mode or "", RISE_MM)

    def _fills_in_s(self) -> float:
        mode = self.failures.get("battery")
        if mode in ("stuck", "off", "garbage"):
            return NEVER
        return (1.0 - self.battery) * FILL_S * (SLOWNESS if mode == "slow" else 1.0)

    def _filled(self) -> float:
        """The battery now."""
        if self.activity is not Activity.CHARGING or self._until == NEVER:
            return self.battery
        done = (self.now - self._since) / max(self._until - self._since, 1e-9)
        return self.battery + (1.0 - self.battery) * min(done, 1.0)

    def _tends_to_c(self) -> float:
        if self.activity not in CURRENT_FLOWS:
            return AMBIENT_C
        return UNCOOLED_C if "fan" in self.failures else COOLED_C

    def _warmth(self) -> float:
        """The coil's temperature now: it approaches what heat and cooling make of it."""
        goal = self._tends_to_c()
        rest = math.exp(-(self.now - self._coil_at) / WARMS_IN_S)
        return goal + (self._coil_c - goal) * rest

    def _warm(self) -> None:
        self._coil_c, self._coil_at = self._warmth(), self.now

    def _trips_at(self) -> float:
        """When it becomes too hot, or cool enough again."""
        goal = self._tends_to_c()
        if (goal > TRIP_C) == (self._coil_c >= TRIP_C):
            return NEVER
        rest = (goal - TRIP_C) / (goal - self._coil_c)
        return self._coil_at - WARMS_IN_S * math.log(rest) + 1e-6

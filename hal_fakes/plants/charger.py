"""A simulated wireless charger on any bus: its pad, the robot on the pad, battery and heat.

The order `press` sets these signals, as a person or the building would:

- `robot`: a robot stands on the pad. If the YAML has `receivers`, press a robot's name (`tiny/AMR02`)
  instead, or `stranger` for an unknown robot. If several robots stand there, the station sees the robot
  that came last.
- `misparked`: the robot stands off centre.
- `foreign_object`: an object lies on the pad.
- `over_temperature`, `transmitter_fault`: errors of the station.

A robot comes with its battery 40 % full. The pad rises to the robot, and the station shakes hands and
charges. When the battery is full, the station ramps down and waits. It is idle again until another
robot comes. Current warms the coil, and a fan cools the coil.

An error stays until its cause is gone and the error is cleared. If the station has no command that
clears errors, switching the power off clears an error. A robot's error (ROBOTS_FAULTS) stays until the
robot leaves.

The daemon drives the signal `clear_error`. A commanded station also has `power`, which must be on for a
charge. It also has `range_check`, whose result comes a moment later. A station without range checks
knows the range at once. A station on contacts has the relay `enable`. Its contacts are `charging`
(current flows), `ready` (current could flow) and `fault` (an error). The pad adds the contacts
`at_height` and `range_ok`.

These parts can fail in the modes `off`, `stuck`, `slow`, `garbage` and `wrong`. `pad.py` describes the
failures of `pad`.

|          | off              | stuck            | slow         | garbage          | wrong         |
| receiver | never answers    | in the handshake | 10 x as long | contact is lost  | wrong answer  |
| battery  | draws no current | never fills      | fills slowly | draws no current | comes full    |

In any failure mode, a failing `fan` lets the coil heat up, and a failing `thermometer` is an error. The
parts of the wire (`server`, `node`, ...) fail at its far side.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import CURRENT_FLOWS, Activity
from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.plants.machine import WiredPlant
from hal_fakes.plants.pad import AMBIENT_C, GAP_MM, NEVER, SLOWNESS, TRIP_C, Coil, LiftingPad
from hal_fakes.plants.plant import FailureMode

LASTS_S: Final = {Activity.HANDSHAKE: 2.0, Activity.STOPPING: 1.0, Activity.RELEASED: 1.5}
FILL_S: Final = 60.0
ARRIVES_WITH: Final = 0.4
LOST_AFTER_S: Final = 1.0
RANGE_CHECK_S: Final = 0.3
EMPTY_V, FULL_V, CURRENT_A = 24.0, 29.2, 30.0
HOT_C, COOLED_C, UNCOOLED_C = 97.0, 60.0, 140.0
FIRST, STRANGER = "4711", "815"
"""The ids of two receivers. FIRST is the id of a `robot` if the YAML lists no receivers. STRANGER is
the id of a `stranger`."""

PARTS: Final = ("pad", "receiver", "fan", "battery", "thermometer")
CAUSES: Final = ("foreign_object", "over_temperature", "transmitter_fault")
ROBOTS_FAULTS: Final = frozenset({"authentication", "too_far", "too_near", "contact_lost"})
TEXTS: Final = {
    "foreign_object": "foreign object detected",
    "over_temperature": "over temperature",
    "transmitter_fault": "transmitter fault",
    "thermometer": "temperature sensor broken",
    "authentication": "authentication timeout",
    "too_far": "the gap is too wide",
    "too_near": "the gap is too narrow",
    "contact_lost": "communication lost while charging",
}
NOT_READY: Final = (Activity.ERROR, Activity.RELEASED)
RANGES: Final = {"in": True, "out": False, "failed": False}


@dataclass(frozen=True, slots=True)
class Reading:
    """The controller's knowledge at one instant.

    - `progress` is the activity's progress, 0 to 1.
    - `faults` are keys of TEXTS.
    - `here` is True while a robot is on the pad.
    - `receiver` is the id of the robot's receiver, or "".
    - `couples` is True if current could flow now.
    - `range_result` is the result of the last range check: `none`, `ongoing`, `in`, `out` or `failed`.
    - `in_range` is True if the result is `in`. For a station without range checks it equals `couples`.
    - `range_ok` is True if the robot is well placed.
    - `battery` is the charge of the battery, 0 to 1.
    - `time_to_full_s` is the time (s) until the battery is full, if current flows.
    """

    activity: Activity
    progress: float = 0.0
    faults: frozenset[str] = frozenset()
    failures: Mapping[str, FailureMode] = field(default_factory=dict)
    here: bool = False
    receiver: str = ""
    couples: bool = False
    range_result: str = "none"
    in_range: bool | None = None
    range_ok: bool = False
    at_height: bool = False
    celsius: float = AMBIENT_C
    battery: float | None = None
    volts: float = 0.0
    amps: float = 0.0
    time_to_full_s: float | None = None

    @property
    def error_text(self) -> str:
        """Return the faults in the station's words."""
        return ", ".join(text for fault, text in TEXTS.items() if fault in self.faults)

    @property
    def robots(self) -> bool:
        """Is at least one of the faults a fault of the robot?"""
        return bool(self.faults & ROBOTS_FAULTS)

    @property
    def number(self) -> float:
        """Return the receiver's number. Return 0 for a receiver without a number."""
        return float(self.receiver) if self.receiver.isdecimal() else 0.0


class ChargerPlant(WiredPlant):
    """One charger. `battery` is the charge of the robot on the pad, 0 to 1. Without a robot `battery`
    has no meaning.

    - `receivers` maps the id of each receiver to its robot.
    - `commanded` means that the station charges only while `power` is on.
    - `asked` means that only a range check shows whether a robot is in range.
    - `cleared` means that an error stays until a command clears it.
    - `pace` is a factor: how many times faster than a real charger the handshake, movements and
      stopping are.
    - `wires` are the station's contacts, if it has any.
    - `links` are the parts of the wire that can fail.
    """

    def __init__(
        self,
        name: str,
        receivers: Mapping[str, str] = MappingProxyType({}),
        *,
        commanded: bool = False,
        asked: bool = False,
        cleared: bool = True,
        wires: Iterable[Wire] = (),
        links: Iterable[str] = (),
    ) -> None:
        robots = {robot: receiver for receiver, robot in receivers.items()}
        first = next(iter(receivers), FIRST)
        self._receivers = {"robot": first, "stranger": STRANGER, **robots}
        buttons = sorted((*CAUSES, "misparked", *self._receivers))
        super().__init__(name, wires, (*PARTS, *links), buttons)
        self._commanded, self._asked, self._cleared = commanded, asked, cleared
        self.pace = 1.0
        self.activity = Activity.IDLE
        self.faults: frozenset[str] = frozenset()
        self.battery = 0.0
        self.power = not commanded
        self.pad = LiftingPad()
        self._coil = Coil()
        self._here: list[str] = []
        self._since, self._until = 0.0, NEVER
        self._range, self._range_until = "none", NEVER

    # ---- the controller's readings and commands

    def reading(self) -> Reading:
        """Return the whole reading."""
        lasts = self._until - self._since
        flows = self.activity in CURRENT_FLOWS
        draws = flows and self.failures.get("battery") not in ("off", "garbage")
        here, filled, rate = bool(self._here), self._filled(), self._fills()
        silent = self.failures.get("receiver") == "off"
        return Reading(
            activity=self.activity,
            progress=0.0 if lasts in (0.0, NEVER) else (self.now - self._since) / lasts,
            faults=self.faults,
            failures=dict(self.failures),
            here=here,
            receiver=self._receivers[self._here[-1]] if here and not silent else "",
            couples=self._couples(),
            range_result=self._range,
            in_range=RANGES.get(self._range) if self._asked else self._couples(),
            range_ok=self._parked_well(),
            at_height=self.pad.at_height(),
            celsius=self._celsius(),
            battery=filled if here else None,
            volts=EMPTY_V + (FULL_V - EMPTY_V) * filled if here else 0.0,
            amps=CURRENT_A if draws else 0.0,
            time_to_full_s=(1.0 - filled) / rate if flows and rate else None,
        )

    def contact(self, signal: str) -> bool:
        """Is this contact asserted at the station? The contact's wire may show another value."""
        return {
            "charging": self.activity in CURRENT_FLOWS,
            "fault": self.activity is Activity.ERROR,
            "ready": self.activity not in NOT_READY,
            "at_height": self.pad.at_height(),
            "range_ok": self._parked_well(),
        }[signal]

    def actuate(self, signal: str, energised: bool) -> None:
        """React to a change of the relay `enable`."""
        self.power = energised

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        """Obey a command or the relay. `power` is a level. For any other command, True triggers it."""
        if signal in self._relays:
            super().drive(signal, asserted, now)
            return
        if signal not in ("clear_error", "power", "range_check"):
            raise KeyError(signal)
        self.advance(now)
        if signal == "power" and asserted == self.power:
            return
        self.note("relay", signal, asserted)
        if signal == "power":
            self.power = asserted
        elif signal == "range_check":
            self._range, self._range_until = "ongoing", self.now + RANGE_CHECK_S / self.pace
        elif not self._causes():
            self._recover()
        self._settle()

    # ---- physics

    def event_at(self) -> float:
        """Return the time at which a running activity ends by itself."""
        return min(self._until, self.pad.rises_until, self._range_until, self._coil.trips_at())

    def act(self, signal: str, asserted: bool) -> None:
        """Let a robot come or leave."""
        if signal not in self._receivers:
            return
        if asserted and signal not in self._here:
            self._here.append(signal)
            self.battery = 1.0 if self.failures.get("battery") == "wrong" else ARRIVES_WITH
        elif not asserted and signal in self._here:
            self._here.remove(signal)
            self.battery = self.battery if self._here else 0.0

    def run(self) -> None:
        """End the activities that are due. Begin the activities that follow from the pad, the heat and
        the causes of errors."""
        if self.pad.follow(self.now, bool(self._here), self.failures.get("pad"), self.pace):
            self.note("sensor", "gap_mm", self.pad.gap_mm())
        if self.now >= self._range_until:
            self._range_until = NEVER
            lost = self.failures.get("receiver") == "off"
            self._range = "failed" if lost else "in" if self._couples() else "out"
        if self.now >= self._until:
            self._end()
        before = None
        while before is not self.activity:
            before = self.activity
            self._react()
        heat = UNCOOLED_C if "fan" in self.failures else COOLED_C
        self._coil.tend(self.now, heat if self.activity in CURRENT_FLOWS else AMBIENT_C)

    def _react(self) -> None:
        busy = self.activity in (*CURRENT_FLOWS, Activity.HANDSHAKE)
        causes = self._causes()
        if causes and (busy or self._wants()):
            self._fault(*causes)
        elif busy and not (self._here and self.power):
            self._stop()
        elif self.activity is Activity.ERROR and not causes and self._forgets():
            self._recover()
        elif self._wants():
            self._shake_hands()

    def _wants(self) -> bool:
        """Is there a robot to charge?"""
        there = bool(self._here) and self.failures.get("receiver") != "off"
        return self.activity is Activity.IDLE and there and self.power and self._filled() < 1.0

    def _causes(self) -> list[str]:
        found = {cause for cause in CAUSES if self.pressed[cause]}
        found |= {"over_temperature"} if self._celsius() >= TRIP_C else set()
        return [*found, *({"thermometer"} & self.failures.keys())]

    def _forgets(self) -> bool:
        """Does an error end by itself when its cause is gone?"""
        left = self.faults <= ROBOTS_FAULTS and not self._here
        return left or not (self._cleared or (self._commanded and self.power))

    def _recover(self) -> None:
        if self.activity is Activity.ERROR:
            self.faults = frozenset()
            self._enter(Activity.IDLE)

    def _fault(self, *faults: str) -> None:
        self.battery = self._filled()
        self.faults = frozenset(faults)
        self._enter(Activity.ERROR)

    def _enter(self, activity: Activity, lasts_s: float | None = None) -> None:
        if lasts_s is None:
            lasts_s = LASTS_S.get(activity, NEVER) / self.pace
        self._since, self._until = self.now, self.now + lasts_s
        if activity is not self.activity:
            self.activity = activity
            self.note("sensor", "state", str(activity))

    def _stop(self) -> None:
        """Stop the present activity, because the robot or the power is gone. End a handshake at once.
        If the robot has left, the station releases it. If only the power is off, ramp the current
        down."""
        if self.activity is Activity.HANDSHAKE:
            self._enter(Activity.IDLE)
        elif not self._here:
            self._enter(Activity.RELEASED)
        elif self.activity is Activity.CHARGING:
            self.battery = self._filled()
            self._enter(Activity.STOPPING)

    def _shake_hands(self) -> None:
        slowness = {"slow": SLOWNESS, "stuck": NEVER}.get(self.failures.get("receiver", ""), 1.0)
        self._enter(Activity.HANDSHAKE, LASTS_S[Activity.HANDSHAKE] / self.pace * slowness)

    def _end(self) -> None:
        """End the present activity, whose time is over."""
        receiver = self.failures.get("receiver")
        match self.activity:
            case Activity.HANDSHAKE if receiver == "wrong":
                self._fault("authentication")
            case Activity.HANDSHAKE if not self._couples():
                near = self._parked_well() and self.pad.gap_mm() < GAP_MM[0]
                self._fault("too_near" if near else "too_far")
            case Activity.HANDSHAKE:
                rate = self._fills()
                full_s = (1.0 - self.battery) / rate if rate else NEVER
                self._enter(Activity.CHARGING, LOST_AFTER_S if receiver == "garbage" else full_s)
            case Activity.CHARGING if receiver == "garbage":
                self._fault("contact_lost")
            case Activity.CHARGING:
                self.battery = 1.0
                self._enter(Activity.STOPPING)
            case Activity.STOPPING:
                self._enter(Activity.RELEASED)
            case _:
                self._enter(Activity.IDLE)

    def _parked_well(self) -> bool:
        return bool(self._here) and not self.pressed["misparked"]

    def _couples(self) -> bool:
        return self._parked_well() and self.pad.couples()

    def _celsius(self) -> float:
        return HOT_C if self.pressed["over_temperature"] else self._coil.celsius(self.now)

    def _fills(self) -> float:
        """Return the share of the battery that a second of charging fills."""
        mode = self.failures.get("battery")
        slowness = SLOWNESS if mode == "slow" else 1.0
        return 0.0 if mode in ("stuck", "off", "garbage") else 1.0 / FILL_S / slowness

    def _filled(self) -> float:
        """Return the battery's present charge."""
        if self.activity is not Activity.CHARGING:
            return self.battery
        return min(1.0, self.battery + (self.now - self._since) * self._fills())


def build(name: str, settings: ChargerSettings, wires: Iterable[Wire]) -> ChargerPlant:
    """Build a station on these contacts."""
    return ChargerPlant(name, commanded=True, cleared=False, wires=wires)


FAKE = Fake(plant=build)

"""A wireless charging station with its pad: it charges whoever is parked on it, if it can.

To press: `robot` (one stands on the pad), or a robot of the YAML's `receivers` by its name
(`tiny/AMR02`), or a `stranger`; whoever comes pushes nobody away, and the last one to come is seen.
`out_of_range`: whoever stands there stands badly. `pad_down`: the pad, which otherwise rises to
whoever comes, stays down or sinks. `foreign_object` (something lies on the pad),
`over_temperature`. A robot comes with its battery 40 % full; the station shakes hands, charges, ramps
down when it is full, waits, and is idle again until another robot comes. An error stays until it is
cleared after its cause has gone, one of the robot's (ROBOTS_FAULTS) until the robot leaves.

To drive: `clear_error`, and where the station can be commanded `power` (without it, it charges nobody)
and `range_check` (its result is there a moment later; a station that needs none knows at once).

Failing part `receiver` (on the robot): `off` never answers, `stuck` hangs in the handshake, `slow`
takes ten times as long for it, `wrong` fails it, `garbage` loses contact while charging. The parts
`server`, `headers` and `body` fail on the wire (`hal_fakes/http.py`).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from bridges.charger.signals import CURRENT_FLOWS, Activity
from drivers.hal.points import Wire
from hal_fakes.plants.machine import Machine
from hal_fakes.plants.plant import FailureMode

HANDSHAKE_S: Final = 2.0
SLOWNESS: Final = 10.0
FILL_S: Final = 60.0
ARRIVES_WITH: Final = 0.4
LOST_AFTER_S: Final = 1.0
RAMP_DOWN_S: Final = 1.0
RESTART_DELAY_S: Final = 1.5
RANGE_CHECK_S: Final = 0.3
VOLTS_EMPTY: Final = 44.0
VOLTS_FULL: Final = 54.0
AMPS: Final = 12.0
AMBIENT_C: Final = 25.0
WARM_C: Final = 48.0
HOT_C: Final = 97.0
NEVER: Final = float("inf")

CAUSES: Final = {
    "foreign_object": "foreign object detected",
    "over_temperature": "over temperature",
}
ROBOTS_FAULTS: Final = ("authentication timeout", "communication lost while charging")
PARTS: Final = ("receiver", "server", "headers", "body")


@dataclass(frozen=True, slots=True)
class Reading:
    """What a controller without contacts can tell at one instant. `progress`: of the handshake, 0-1.

    `receiver`: whom it sees, "" for nobody. `battery`: 0-1. `time_to_full_s`: while current flows.
    """

    activity: Activity
    progress: float
    error_text: str
    failures: Mapping[str, FailureMode]
    receiver: str = ""
    in_range: bool | None = None
    range_ok: bool = False
    at_height: bool = False
    celsius: float = AMBIENT_C
    battery: float | None = None
    volts: float = 0.0
    amps: float = 0.0
    time_to_full_s: float | None = None


class ChargerPlant(Machine):
    """`battery`: 0-1, of the robot on the pad; nobody's when there is none.

    `receivers`: id -> robot. `commanded`: it charges only while `power` is on. `asked`: it knows
    whether a robot is in range only by a range check. `pace`: how many times as fast it is.
    `wires`: its contacts, where it has any (`contact_charger.py`). `parts`: what of it can fail.
    """

    def __init__(
        self,
        name: str,
        receivers: Mapping[str, str] = MappingProxyType({}),
        commanded: bool = False,
        asked: bool = False,
        pace: float = 1.0,
        wires: Iterable[Wire] = (),
        parts: Iterable[str] = PARTS,
    ) -> None:
        self._receivers = {robot: receiver for receiver, robot in receivers.items()}
        buttons = sorted(
            ("out_of_range", "pad_down", *CAUSES, "robot", "stranger", *self._receivers)
        )
        super().__init__(name, wires, parts, buttons)
        self._pace = pace
        self.activity = Activity.IDLE
        self.error_text = ""
        self.battery = 0.0
        self.power = not commanded
        self._asked = asked
        self._checked_at = NEVER
        self._here: list[str] = []
        self._since = 0.0
        self._until = NEVER

    def sense(self, signal: str) -> bool:
        """Is `robot` or a cause there?"""
        return self.contact(signal)

    def reading(self) -> Reading:
        """Everything at once."""
        lasts = self._until - self._since
        progress = 0.0 if lasts == NEVER else (self.now - self._since) / lasts
        flows = self.activity in CURRENT_FLOWS
        battery = self._battery()
        return Reading(
            self.activity,
            progress,
            self.error_text,
            dict(self.failures),
            self._receiver(),
            self._in_range(),
            self.coupled(),
            self.risen(),
            HOT_C if self.pressed["over_temperature"] else WARM_C if flows else AMBIENT_C,
            battery if self._here else None,
            VOLTS_EMPTY + battery * (VOLTS_FULL - VOLTS_EMPTY) if self._here else 0.0,
            AMPS if flows else 0.0,
            (1.0 - battery) * FILL_S if flows else None,
        )

    def _receiver(self) -> str:
        """The id of who came last, unless the receiver is silent."""
        if not self._here or self.failures.get("receiver") == "off":
            return ""
        first = next(iter(self._receivers.values()), "1")
        return {"robot": first, "stranger": "9999"}.get(
            self._here[-1], self._receivers.get(self._here[-1], "")
        )

    def _in_range(self) -> bool | None:
        """None while a check is under way, or where nobody has asked for one."""
        if self._asked and not self._checked_at <= self.now:
            return None
        return self.coupled()

    def coupled(self) -> bool:
        """Does whoever is there stand where it can be charged?"""
        return bool(self._here) and not self.pressed["out_of_range"]

    def risen(self) -> bool:
        """Is the pad where it charges?"""
        return bool(self._here) and not self.pressed["pad_down"]

    def _battery(self) -> float:
        if self.activity is not Activity.CHARGING or self._until == NEVER:
            return self.battery
        return min(1.0, 1.0 - (self._until - self.now) * self._pace / FILL_S)

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        """A command reaches the station. `clear_error`: it looks again whether the cause has gone."""
        if signal not in ("clear_error", "power", "range_check"):
            raise KeyError(signal)
        self.advance(now)
        if signal != "power" or asserted != self.power:
            self.note("relay", signal, asserted)
        if signal == "power":
            self.power = asserted
        elif signal == "range_check":
            self._checked_at = self.now + RANGE_CHECK_S / self._pace
        elif self.activity is Activity.ERROR and not any(self.pressed[c] for c in CAUSES):
            self.error_text = ""
            self._enter(Activity.IDLE)
        self._settle()

    def contact(self, signal: str) -> bool:
        """Is the robot, or what is pressed, there?"""
        return self.pressed[signal]

    def event_at(self) -> float:
        """When the activity under way ends by itself."""
        return self._until

    def act(self, signal: str, asserted: bool) -> None:
        """A robot comes or leaves."""
        if signal in ("out_of_range", *CAUSES):
            return
        if asserted and signal not in self._here:
            self._here.append(signal)
            self.battery = ARRIVES_WITH
        elif not asserted and signal in self._here:
            self._here.remove(signal)

    def run(self) -> None:
        """What is due ends, and what the pad and the causes demand begins."""
        if self.now >= self._until:
            self._end()
        if self.error_text in ROBOTS_FAULTS and not self._here:
            self.error_text = ""
            self._enter(Activity.IDLE)
        cause = next((c for c in CAUSES if self.pressed[c]), None)
        busy = self.activity in (*CURRENT_FLOWS, Activity.HANDSHAKE)
        if cause and busy:
            self._fault(CAUSES[cause])
        elif busy and not self._here:
            self._leave()
        elif busy and not self.power:
            self._ramp_down()
        elif self.activity is Activity.IDLE and self._here and self.power and self.battery < 1.0:
            self._shake_hands()

    def _enter(self, activity: Activity, lasts_s: float = NEVER) -> None:
        self._since, self._until = self.now, self.now + lasts_s / self._pace
        if activity is not self.activity:
            self.activity = activity
            self.note("sensor", "state", str(activity))

    def _fault(self, text: str) -> None:
        self.error_text = text
        self._enter(Activity.ERROR)

    def _ramp_down(self) -> None:
        """The power is off: a current ramps down, any other activity ends."""
        if self.activity is Activity.CHARGING:
            self.battery = self._battery()
            self._enter(Activity.STOPPING, RAMP_DOWN_S)
        elif self.activity is Activity.HANDSHAKE:
            self._enter(Activity.IDLE)

    def _leave(self) -> None:
        charged = self.activity in CURRENT_FLOWS
        self._enter(*((Activity.RELEASED, RESTART_DELAY_S) if charged else (Activity.IDLE,)))

    def _shake_hands(self) -> None:
        receiver = self.failures.get("receiver")
        slowness = {"slow": SLOWNESS, "stuck": NEVER}.get(receiver or "", 1.0)
        if receiver != "off":
            self._enter(Activity.HANDSHAKE, HANDSHAKE_S * slowness)

    def _end(self) -> None:
        """The activity under way has run its time."""
        receiver = self.failures.get("receiver")
        match self.activity:
            case Activity.HANDSHAKE if receiver == "wrong":
                self._fault("authentication timeout")
            case Activity.HANDSHAKE if self.pressed["out_of_range"]:
                self._fault("the gap is too wide")
            case Activity.HANDSHAKE if receiver == "garbage":
                self._enter(Activity.CHARGING, LOST_AFTER_S)
            case Activity.HANDSHAKE:
                self._enter(Activity.CHARGING, (1.0 - self.battery) * FILL_S)
            case Activity.CHARGING if receiver == "garbage":
                self._fault("communication lost while charging")
            case Activity.CHARGING:
                self.battery = 1.0
                self._enter(Activity.STOPPING, RAMP_DOWN_S)
            case Activity.STOPPING:
                self._enter(Activity.RELEASED, RESTART_DELAY_S)
            case _:
                self._enter(Activity.IDLE)

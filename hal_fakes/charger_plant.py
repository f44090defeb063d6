"""A wireless charging station with its pad: it charges whoever is parked on it, if it can.

To press: `robot` (one stands on the pad), `foreign_object` (something lies on it),
`over_temperature`. To drive: `clear_error`. A robot comes with its battery 40 % full; the station
shakes hands, charges, ramps down when it is full, waits, and is idle again until another robot comes.
An error stays until it is cleared after its cause has gone.

Failing part `receiver` (on the robot): `off` never answers, `stuck` hangs in the handshake, `slow`
takes ten times as long for it, `wrong` fails it, `garbage` loses contact while charging. The parts
`server`, `headers` and `body` fail on the wire (`hal_fakes/http.py`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from bridges.charger.signals import CURRENT_FLOWS, Activity
from hal_fakes.machine import Machine
from hal_fakes.plant import FailureMode

HANDSHAKE_S: Final = 2.0
SLOWNESS: Final = 10.0
FILL_S: Final = 60.0
ARRIVES_WITH: Final = 0.4
LOST_AFTER_S: Final = 1.0
RAMP_DOWN_S: Final = 1.0
RESTART_DELAY_S: Final = 1.5
NEVER: Final = float("inf")

CAUSES: Final = {
    "foreign_object": "foreign object detected",
    "over_temperature": "over temperature",
}
PARTS: Final = ("receiver", "server", "headers", "body")


def build(name: str, settings: Any) -> "ChargerPlant":
    """A station; its code table is the wire's business (`hal_fakes/http.py`)."""
    return ChargerPlant(name)


@dataclass(frozen=True, slots=True)
class Reading:
    """What a controller without contacts can tell at one instant. `progress`: of the handshake, 0-1."""

    activity: Activity
    progress: float
    error_text: str
    failures: Mapping[str, FailureMode]


class ChargerPlant(Machine):
    """`battery`: 0-1, of the robot on the pad; nobody's when there is none."""

    def __init__(self, name: str) -> None:
        super().__init__(name, parts=PARTS)
        self.activity = Activity.IDLE
        self.error_text = ""
        self.battery = 0.0
        self._pressed = dict.fromkeys(("robot", *CAUSES), False)
        self._since = 0.0
        self._until = NEVER

    def sense(self, signal: str) -> Any:
        """`reading`: everything at once, as a Reading; else whether `robot` or a cause is there."""
        if signal != "reading":
            return self.contact(signal)
        lasts = self._until - self._since
        progress = 0.0 if lasts == NEVER else (self.now - self._since) / lasts
        return Reading(self.activity, progress, self.error_text, dict(self.failures))

    def drive(self, signal: str, asserted: bool, now: float) -> None:
        """`clear_error`: the station looks again whether the cause has gone."""
        if signal != "clear_error":
            raise KeyError(signal)
        self.advance(now)
        self.note("relay", signal, asserted)
        if self.activity is Activity.ERROR and not any(self._pressed[c] for c in CAUSES):
            self.error_text = ""
            self._enter(Activity.IDLE)
        self._settle()

    def contact(self, signal: str) -> bool:
        """Is the robot, or what is pressed, there?"""
        return self._pressed[signal]

    def actuate(self, signal: str, energised: bool) -> None:
        """There is no relay."""

    def event_at(self) -> float:
        """When the activity under way ends by itself."""
        return self._until

    def act(self, signal: str, asserted: bool) -> None:
        """A robot comes or leaves, a cause of error comes or goes."""
        if signal not in self._pressed:
            known = ", ".join(sorted(self._pressed))
            raise ValueError(f"{self.name} has no {signal!r} to press; there are {known}")
        if signal == "robot" and asserted and not self._pressed["robot"]:
            self.battery = ARRIVES_WITH
        self._pressed[signal] = asserted

    def run(self) -> None:
        """What is due ends, and what the pad and the causes demand begins."""
        if self.now >= self._until:
            self._end()
        cause = next((c for c in CAUSES if self._pressed[c]), None)
        busy = self.activity in (*CURRENT_FLOWS, Activity.HANDSHAKE)
        if cause and busy:
            self._fault(CAUSES[cause])
        elif busy and not self._pressed["robot"]:
            self._leave()
        elif self.activity is Activity.IDLE and self._pressed["robot"] and self.battery < 1.0:
            self._shake_hands()

    def _enter(self, activity: Activity, lasts_s: float = NEVER) -> None:
        self._since, self._until = self.now, self.now + lasts_s
        if activity is not self.activity:
            self.activity = activity
            self.note("sensor", "state", str(activity))

    def _fault(self, text: str) -> None:
        self.error_text = text
        self._enter(Activity.ERROR)

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

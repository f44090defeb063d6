"""The play (a series of test messages) for a charger, with two requests and the end of each request."""

from collections.abc import Iterator
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import duration
from workbench.judge.law import shown
from workbench.judge.played_nodes import PlayedNodes
from workbench.judge.scenarios import NOWHERE, REPEAT_S, STRANGER, Scenario
from workbench.rmf_model import Said

SERVED: Final = (d.ChargerStateValue.CHARGER_ASSIGNED, d.ChargerStateValue.CHARGER_CHARGING)
START_TIMEOUT_S: Final = 10.0
LATEST_S: Final = START_TIMEOUT_S + 15.0
"""Maximum time (s) for which the play waits until start_timeout has ended the first request. After this
time, the play goes on to the second request."""
REPEATS: Final = 6


class ChargeScenario(Scenario):
    """A play that requests a station for a robot that does not come.

    The station should end this request after start_timeout. Then the play makes a second request and
    cancels the second request. Further messages tempt a faulty node to break a law about requests:

    - a request for another station
    - a second request for this station
    - a cancel of another request
    - repeats

    `robot` is FLEET/ROBOT. If the robot does come, the play cancels the robot's charge.
    """

    def __init__(self, charger: str, robot: str, request_id: str, patience_s: float) -> None:
        self.charger = charger
        self._fleet, _, self._robot = robot.partition("/")
        self._ids = [request_id, f"{request_id}-2"]
        self._patience_s = patience_s
        self._state: d.ChargerState | None = None
        self._wake_at = 0.0
        self._over = self._leaving = False
        self.speaks = (topics.CHARGER_REQUESTS, topics.CHARGER_CANCELS)
        self.hears = (topics.CHARGER_STATES, topics.CHARGER_REFUSALS)
        self.play = PlayedNodes(charger, [], None, patience_s)
        self._now = 0.0
        self._course = self._play()

    @property
    def over(self) -> bool:
        """Return whether both requests are over, or the station never granted the first request."""
        return bool(self.failed) or self._over

    def begin(self, now: float) -> list[Said]:
        """Send the first request."""
        return self.tick(now)

    def _play(self) -> Iterator[list[Said]]:
        """Yield the messages of each step. Between two steps, REPEAT_S (s) pass."""
        first, second = self._ids
        yield [self._ask(f"{first}-elsewhere", station=NOWHERE)]
        yield from [[]] * 3
        yield from self._until_served(first)
        yield [self._cancel(f"{first}-other"), self._ask(f"{first}-rival", STRANGER)]
        began_at = self._now
        while self._shows(first) and self._now < began_at + LATEST_S:
            waits = self._state is not None and self._state.state == SERVED[0]
            yield [] if waits else [self._cancel(first)]
        yield from self._until_served(second)
        yield from [[self._ask(second)]] * REPEATS

    def _until_served(self, request_id: str) -> Iterator[list[Said]]:
        began_at = self._now
        while not self._shows(request_id):
            if self._now >= began_at + self._patience_s:
                self.failed = f"not assigned in {self._patience_s:.0f} s"
                return
            free = self._state is None or self._state.state not in SERVED
            yield [self._ask(request_id)] if free else []

    def hear(self, topic: str, message: d.Message, now: float) -> list[Said]:
        """Note the charger's states and refusals."""
        if isinstance(message, d.DiagnosticStatus) and message.hardware_id == self.charger:
            if any((v.key, v.value) == ("request_id", self._ids[0]) for v in message.values):
                self.failed = f"refused: {shown(message.message)}"
        elif isinstance(message, d.ChargerState) and message.charger_name == self.charger:
            self._state = message
        return []

    def tick(self, now: float) -> list[Said]:
        """Do the next step, if its time has come."""
        if now < self._wake_at or self.over:
            return []
        self._now, self._wake_at = now, now + REPEAT_S
        said = next(self._course, None)
        self._over = said is None
        return said or []

    def wake_at(self) -> float:
        """Return the time of the next step."""
        return self._wake_at

    def leave(self, now: float) -> list[Said]:
        """Cancel our requests."""
        self._leaving = True
        return [self._cancel(one) for one in (*self._ids, f"{self._ids[0]}-rival")]

    @property
    def left(self) -> bool:
        """Return whether the charger has stopped serving our requests."""
        return self._leaving and not self._shows(self._ids[0])

    def _shows(self, request_id: str) -> bool:
        """Return whether the station serves this request, or a request whose id begins with this id."""
        state = self._state
        if state is None or state.state not in SERVED:
            return False
        return state.request_id == request_id or state.request_id.startswith(f"{request_id}-")

    def _ask(self, request_id: str, robot: str = "", station: str = "") -> Said:
        fleet, _, name = robot.partition("/")
        who = (fleet, name) if robot else (self._fleet, self._robot)
        timeout = duration(60.0 if request_id == self._ids[1] else START_TIMEOUT_S)
        request = d.ChargerRequest(station or self.charger, *who, timeout, request_id)
        return topics.CHARGER_REQUESTS, request

    def _cancel(self, request_id: str) -> Said:
        return topics.CHARGER_CANCELS, d.ChargerCancel(self.charger, request_id)

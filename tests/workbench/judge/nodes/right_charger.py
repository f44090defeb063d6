"""A charger's node that keeps the contract, but differs from ours. For example, an idle charger accepts
each request at once."""

from collections.abc import Sequence

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import in_seconds, stamp
from workbench.rmf_model import Party, Said

LOOP_S = 0.5
IDLE, ASSIGNED, CHARGING, RELEASED, ERROR = 1, 2, 3, 4, 200


class RightCharger(Party):
    """A correct charger. `comes_s` is the time (s) from the promise of the charger until current flows.
    With None, current never flows."""

    subscribes: Sequence[topics.AnyTopic] = (topics.CHARGER_REQUESTS, topics.CHARGER_CANCELS)
    name = "bay1"
    period_s = 1.0

    def __init__(self, comes_s: float | None = None) -> None:
        self.shown = d.ChargerState(state=IDLE, charger_name=self.name)
        self.request = d.ChargerRequest()
        self.comes_s = comes_s
        self.since = self.due_at = self.told_at = float("-inf")
        self._told: d.ChargerState | None = None

    def hear(self, message: d.Message, now: float) -> list[Said]:
        match message:
            case d.ChargerRequest(charger_name=self.name):
                self.requested(message, now)
            case d.ChargerCancel(charger_name=self.name):
                self.cancelled(message.request_id, now)
        return []

    def requested(self, request: d.ChargerRequest, now: float) -> None:
        if self.shown.state == IDLE:
            self.request = request
            self.shows(ASSIGNED, now)

    def cancelled(self, request_id: str, now: float) -> None:
        if request_id == self.shown.request_id and self.shown.state in (ASSIGNED, CHARGING):
            self.shows(RELEASED, now)

    def shows(self, state: int, now: float, text: str = "") -> None:
        """Set the state. Every state except IDLE has the request's id and the robot's name."""
        self.since = now
        asked = self.request if state != IDLE else d.ChargerRequest()
        self.shown = replace(
            self.shown,
            state=state,
            error_message=text,
            request_id=asked.request_id,
            robot_fleet=asked.fleet_name,
            robot_name=asked.robot_name,
        )

    def tick(self, now: float) -> list[Said]:
        self.due_at = now + LOOP_S
        self.goes_on(now)
        if self.shown == self._told and now < self.told_at + self.period_s:
            return []
        self._told, self.told_at = self.shown, now
        return [(topics.CHARGER_STATES, self.state(now))]

    def wake_at(self) -> float:
        return self.due_at if self.due_at > 0 else 0.0

    def goes_on(self, now: float) -> None:
        lasts_s = now - self.since
        if self.shown.state == ASSIGNED and self.comes_s is not None and lasts_s >= self.comes_s:
            self.shows(CHARGING, now)
        elif self.shown.state == ASSIGNED and lasts_s >= in_seconds(self.request.start_timeout) > 0:
            self.shows(RELEASED, now)
        elif self.shown.state == RELEASED and lasts_s >= 2.0:
            self.shows(IDLE, now)

    def state(self, now: float) -> d.ChargerState:
        return replace(self.shown, charger_time=stamp(now))

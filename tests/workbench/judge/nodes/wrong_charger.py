"""Charger nodes, each with one defect that occurred in the field. Each docstring names the defect."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_charger import ASSIGNED, CHARGING, RELEASED, RightCharger
from workbench.rmf_model import Said


class AnyCancelCancels(RightCharger):
    """The charger does not compare the id of a cancel, so any cancel stops the charge."""

    def cancelled(self, request_id: str, now: float) -> None:
        super().cancelled(self.shown.request_id, now)


class ChargerAnswers(RightCharger):
    """The charger publishes a state for each request, even without a change."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        return [(topics.CHARGER_STATES, self.state(now))]


class ChargerFallsSilent(RightCharger):
    """The node's callback calls HTTP without a timeout. So no state comes while the station is slow."""

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        return [] if self.shown.state == ASSIGNED and now - self.since < 8.0 else said


class ChargerIdleFromMemory(RightCharger):
    """The station is unreachable, but the charger publishes IDLE for ever."""

    read_at = 0.0

    def state(self, now: float) -> d.ChargerState:
        self.read_at = self.read_at or now
        return super().state(self.read_at)


class ChargerIgnoresCancels(RightCharger):
    """The charger obeys a cancel only when it charges."""

    def cancelled(self, request_id: str, now: float) -> None:
        if self.shown.state == CHARGING:
            super().cancelled(request_id, now)


class ChargerIsTakenOver(RightCharger):
    """The next request takes over a running charge."""

    def requested(self, request: d.ChargerRequest, now: float) -> None:
        super().requested(request, now)
        if self.shown.state == CHARGING:
            self.request = request
            self.shows(CHARGING, now)


class ChargerNamesAnotherRobot(RightCharger):
    """The charger names a robot that stood on the pad earlier."""

    def state(self, now: float) -> d.ChargerState:
        state = super().state(now)
        return replace(state, robot_name="yesterday's") if state.robot_name else state


class ChargerTalksAlways(RightCharger):
    """The charger puts the station's status line into error_message in every state."""

    def state(self, now: float) -> d.ChargerState:
        return replace(super().state(now), error_message="48.1 V 0.0 A")


class ChargerVendorCodes(RightCharger):
    """The charger publishes 238 in place of RELEASED. 238 is the station's own code."""

    def state(self, now: float) -> d.ChargerState:
        state = super().state(now)
        return replace(state, state=238 if state.state == RELEASED else state.state)


class ChargerWaitsForEver(RightCharger):
    """The charger ignores start_timeout."""

    def requested(self, request: d.ChargerRequest, now: float) -> None:
        super().requested(replace(request, start_timeout=d.Duration()), now)


class ChargerWithoutIds(RightCharger):
    """The charger leaves request_id empty."""

    def state(self, now: float) -> d.ChargerState:
        return replace(super().state(now), request_id="")


class ChargerWithoutStamps(RightCharger):
    """The charger never fills charger_time."""

    def state(self, now: float) -> d.ChargerState:
        return replace(super().state(now), charger_time=d.Time())


class ChargerHearsEveryName(RightCharger):
    """The charger obeys requests for other stations too."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.ChargerRequest | d.ChargerCancel):
            super().hear(replace(message, charger_name=self.name), now)
        return []


class PromiseIsTakenOver(RightCharger):
    """The next request takes a station that is promised to another robot."""

    def requested(self, request: d.ChargerRequest, now: float) -> None:
        if self.shown.state == ASSIGNED:
            self.request = request
            self.shows(ASSIGNED, now)
        super().requested(request, now)

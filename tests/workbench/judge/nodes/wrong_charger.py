"""Nodes of chargers with one defect each that the field knows: its docstring says which."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_charger import ASSIGNED, CHARGING, RELEASED, RightCharger
from workbench.rmf_model import Said


class AnyCancelCancels(RightCharger):
    """The id of a cancel is not looked at."""

    def cancelled(self, request_id: str, now: float) -> None:
        super().cancelled(self.shown.request_id, now)


class ChargerAnswers(RightCharger):
    """A state for each request, whether anything has changed or not."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        return [(topics.CHARGER_STATES, self.state(now))]


class ChargerFallsSilent(RightCharger):
    """HTTP without a timeout in the callback: no state comes while the station is slow."""

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        return [] if self.shown.state == ASSIGNED and now - self.since < 8.0 else said


class ChargerIdleFromMemory(RightCharger):
    """The station is not reached any more, and IDLE is said for ever."""

    read_at = 0.0

    def state(self, now: float) -> d.ChargerState:
        self.read_at = self.read_at or now
        return super().state(self.read_at)


class ChargerIgnoresCancels(RightCharger):
    """A cancel counts only while it charges."""

    def cancelled(self, request_id: str, now: float) -> None:
        if self.shown.state == CHARGING:
            super().cancelled(request_id, now)


class ChargerIsTakenOver(RightCharger):
    """The next request takes the charge over."""

    def requested(self, request: d.ChargerRequest, now: float) -> None:
        super().requested(request, now)
        if self.shown.state == CHARGING:
            self.request = request
            self.shows(CHARGING, now)


class ChargerNamesAnotherRobot(RightCharger):
    """The robot's name is what stood on the pad last."""

    def state(self, now: float) -> d.ChargerState:
        state = super().state(now)
        return replace(state, robot_name="yesterday's") if state.robot_name else state


class ChargerTalksAlways(RightCharger):
    """error_message has the status line of the station in every state."""

    def state(self, now: float) -> d.ChargerState:
        return replace(super().state(now), error_message="48.1 V 0.0 A")


class ChargerVendorCodes(RightCharger):
    """The station's own code is published as RMF's state: 5 is charging, 238 an error."""

    def state(self, now: float) -> d.ChargerState:
        state = super().state(now)
        return replace(state, state=238 if state.state == RELEASED else state.state)


class ChargerWaitsForEver(RightCharger):
    """start_timeout is not looked at."""

    def requested(self, request: d.ChargerRequest, now: float) -> None:
        super().requested(replace(request, start_timeout=d.Duration()), now)


class ChargerWithoutIds(RightCharger):
    """request_id stays empty."""

    def state(self, now: float) -> d.ChargerState:
        return replace(super().state(now), request_id="")


class ChargerWithoutStamps(RightCharger):
    """charger_time is never filled."""

    def state(self, now: float) -> d.ChargerState:
        return replace(super().state(now), charger_time=d.Time())


class ChargerHearsEveryName(RightCharger):
    """Another station's request counts here too."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.ChargerRequest | d.ChargerCancel):
            super().hear(replace(message, charger_name=self.name), now)
        return []


class PromiseIsTakenOver(RightCharger):
    """The next request gets the station that is promised to another robot."""

    def requested(self, request: d.ChargerRequest, now: float) -> None:
        if self.shown.state == ASSIGNED:
            self.request = request
            self.shows(ASSIGNED, now)
        super().requested(request, now)

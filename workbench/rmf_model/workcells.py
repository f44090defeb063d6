"""RMF's phases at a workcell: DispenseItem and IngestItem. Both phases follow the same rules.

Source: rmf_ros2 9dedd0f, rmf_fleet_adapter/src/rmf_fleet_adapter/phases/: DispenseItem.cpp and
IngestItem.cpp (`_init_obs`, `_get_status`), Utils.cpp (`is_newer`: an equal stamp counts as newer).

The phase repeats its request each second, without a stamp, until the phase ends. Nothing cancels the
phase, and the phase has no time limit. tasks/Delivery.cpp uses the task's id as the guid, so two
requests of one task have the same guid.
"""

from typing import Final, Literal

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import in_seconds
from bridges.messages.topics import AnyTopic
from workbench.rmf_model import NEVER, Party, Said

REPEAT_S: Final = 1.0

WorkcellRequest = d.DispenserRequest | d.IngestorRequest
WorkcellState = d.DispenserState | d.IngestorState
WorkcellResult = d.DispenserResult | d.IngestorResult
DISPENSER: Final[tuple[AnyTopic, ...]] = (topics.DISPENSER_STATES, topics.DISPENSER_RESULTS)
INGESTOR: Final[tuple[AnyTopic, ...]] = (topics.INGESTOR_STATES, topics.INGESTOR_RESULTS)


class WorkcellPhase(Party):
    """One phase. `outcome` is "" until the phase ends. `why` is the message that ended the phase."""

    def __init__(self, request: WorkcellRequest, now: float) -> None:
        self.request = request
        self.outcome: Literal["", "completed", "failed"] = ""
        self.why = ""
        ingests = isinstance(request, d.IngestorRequest)
        self.subscribes = INGESTOR if ingests else DISPENSER
        self._topic: AnyTopic = topics.INGESTOR_REQUESTS if ingests else topics.DISPENSER_REQUESTS
        self._next_at = now
        self._result: WorkcellResult | None = None
        self._state: WorkcellState | None = None
        self._acknowledged = False
        self._last = 0.0

    def hear(self, message: d.Message, now: float) -> list[Said]:
        """Check the latest result and the latest state. If there is none yet, skip this check (rxcpp's
        combine_latest)."""
        if isinstance(message, WorkcellResult):
            self._result = message
        if isinstance(message, WorkcellState):
            self._state = message
        if not self.outcome:
            self._judge_result()
            self._judge_state()
        return []

    def tick(self, now: float) -> list[Said]:
        """Send the request."""
        if self.outcome:
            return []
        self._next_at = now + REPEAT_S
        return [(self._topic, self.request)]

    def wake_at(self) -> float:
        """Time (s) of the next request."""
        return NEVER if self.outcome else self._next_at

    def _judge_result(self) -> None:
        result = self._result
        if result is None or result.request_guid != self.request.request_guid:
            return
        if not self._is_newer(result.time):
            return
        match result.status:
            case d.WorkcellStatus.ACKNOWLEDGED:
                self._acknowledged = True
            case d.WorkcellStatus.SUCCESS:
                self.outcome, self.why = "completed", "a result SUCCESS"
            case d.WorkcellStatus.FAILED:
                self.outcome, self.why = "failed", "a result FAILED"

    def _judge_state(self) -> None:
        """Check the latest state. As in `_get_status`, the state may still turn a failed request into a
        completed request."""
        state, guid = self._state, self.request.request_guid
        if state is None or state.guid != self.request.target_guid:
            return
        if not self._is_newer(state.time):
            return
        listed = guid in state.request_guid_queue
        if not self._acknowledged:
            self._acknowledged = listed
        elif not listed:
            self.outcome, self.why = "completed", "a newer state that does not list it"

    def _is_newer(self, stamp: d.Time) -> bool:
        at = in_seconds(stamp)
        newer = at >= self._last
        self._last = at if newer else self._last
        return newer

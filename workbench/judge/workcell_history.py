"""The history of a dispenser or ingestor: its requests, the requests that its states list, and its
results."""

from typing import Any, Final

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard
from bridges.messages.stamps import in_seconds
from bridges.observe.requesters import Moment
from bridges.observe.workcell import ObservedDispenser, ObservedIngestor
from workbench.judge.history import NOT_YET, History, keep

HEARD_S: Final = 3.0
"""Time (s) without a request after which RMF's phase has ended, because three repeats are missing."""
UNEXPLAINED_S: Final = 600.0
"""Time (s) within which two requests must leave the queue without a result to show a fault of the node.
Over a longer time, the network may lose two results."""


class WorkcellHistory(History[d.DispenserState]):
    """The history of one workcell. A guid names a request.

    - `listed`: the guids that the states list. The value is the newest stamp that RMF has heard about
      the guid, of a state or of a result. RMF ignores a state with an older stamp.
    - `results`: guid -> the last status.
    - `heard_of`: guid -> the time of its latest request or result.
    - `acknowledged`: guid -> stamp of its result ACKNOWLEDGED, as long as no state has listed the guid.
    - `left`: the listed guids that the latest state, if RMF does not ignore it, no longer lists.
    - `unexplained`: guid -> the time at which states stopped listing the guid, without a result
      SUCCESS or FAILED, although RMF still repeated the request. It is forgotten after UNEXPLAINED_S.
      `vanished`: whether such a request has been forgotten.
    - `succeeded`: whether a request has left the queue after its result SUCCESS.
    - `asked_since`: guid -> the times of the requests after its last result. It is forgotten when the
      node is OFFLINE or pauses, because such a node need not answer.
    - `result`: the latest message, if the message is a result of this workcell.
    - `result_before`: the status of the previous result for the same guid.
    - `came_again`: whether the request was heard between these two results.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.listed: dict[str, float] = {}
        self.results: dict[str, int] = {}
        self.heard_of: dict[str, float] = {}
        self.left: tuple[str, ...] = ()
        self.unexplained: dict[str, float] = {}
        self.asked_since: dict[str, list[float]] = {}
        self.acknowledged: dict[str, float] = {}
        self.result: words.WorkcellResulted | None = None
        self.result_before: int | None = None
        self.came_again = self.succeeded = self.vanished = False

    @staticmethod
    def claims(state: Any) -> bool:
        """Return whether RMF would act on this state. This is true for every mode except OFFLINE."""
        return bool(state.mode != d.WorkcellMode.OFFLINE)

    def take(self, heard: Heard, own: bool = False) -> bool:
        """Take a message of any device. Clear `result` and `left`, which belong to the message
        before."""
        self.result, self.left = None, ()
        return super().take(heard, own)

    def pass_time(self, now: float, wall: float) -> None:
        """Note that time has passed without a message."""
        super().pass_time(now, wall)
        self.result, self.left = None, ()

    def forget(self) -> None:
        """Forget the queue and the unanswered requests after a pause. Nobody knows which results the
        node has sent in the pause."""
        self.listed.clear()
        self.acknowledged.clear()
        self.asked_since.clear()

    def take_other(self, heard: Heard) -> bool:
        """Take this workcell's requests and results."""
        message = heard.message
        if not isinstance(message, words.WorkcellRequested | words.WorkcellResulted):
            return False
        if (words.kind(message), words.device(message)) != (self.seen.kind, self.name):
            return False
        guid = message.request_guid
        if isinstance(message, words.WorkcellRequested):
            self.asked()
            if self.is_over(guid):
                self.results.pop(guid, None)  # the guid is a task's id, and names a new request too
            keep(self.heard_of, guid, self.now)
            keep(self.asked_since, guid, [*self.asked_since.get(guid, []), self.now][-10:])
            return True
        self.seen.hear(Moment(heard.at, heard.wall), heard.topic, message)
        stamp = in_seconds(message.time)
        self.result, self.result_before = message, self.results.get(guid)
        self.came_again = bool(self.asked_since.pop(guid, None))
        keep(self.results, guid, message.status)
        keep(self.heard_of, guid, self.now)
        self.acknowledged.pop(guid, None)
        if message.status == d.WorkcellStatus.SUCCESS:
            self.unexplained.pop(guid, None)
        if guid in self.listed:
            self.listed[guid] = max(self.listed[guid], stamp)
        elif message.status == d.WorkcellStatus.ACKNOWLEDGED:
            keep(self.acknowledged, guid, stamp)
        return True

    def settle(self, state: d.DispenserState) -> None:
        """Note the requests that the state lists, and the requests that the state no longer lists."""
        stamp = words.stamped_at(state)
        queue = set(state.request_guid_queue)
        self.left = tuple(
            sorted(g for g, newest in self.listed.items() if g not in queue and stamp >= newest)
        )
        for guid in queue:
            keep(self.listed, guid, max(stamp, self.listed.get(guid, 0.0)))
            self.acknowledged.pop(guid, None)
        for guid in self.left:
            self.listed.pop(guid, None)
            result = self.results.get(guid)
            self.succeeded |= result == d.WorkcellStatus.SUCCESS
            has_ended = result in (d.WorkcellStatus.SUCCESS, d.WorkcellStatus.FAILED)
            if not has_ended and not self.is_over(guid):
                keep(self.unexplained, guid, self.now)
        for guid, at in [*self.unexplained.items()]:
            if self.now - at > UNEXPLAINED_S:
                del self.unexplained[guid]
                self.vanished = True
        if not self.claims(state):
            self.asked_since.clear()

    def is_over(self, guid: str) -> bool:
        """Return whether RMF's phase with this request has ended, or is unknown. RMF repeats a request
        each second until it hears a result (DispenseItem.cpp)."""
        return self.now - self.heard_of.get(guid, NOT_YET) > HEARD_S

    def waited_s(self, guid: str) -> float:
        """Return for how long (s) RMF has repeated this request since its last result. Return -inf for
        fewer than three requests."""
        times = self.asked_since.get(guid, [])
        return times[-1] - times[0] if len(times) > 2 else NOT_YET


class DispenserHistory(WorkcellHistory):
    """The history of a dispenser."""

    observes = ObservedDispenser


class IngestorHistory(WorkcellHistory):
    """The history of an ingestor."""

    observes = ObservedIngestor

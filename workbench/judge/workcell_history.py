"""The history of a dispenser or ingestor: its requests, the requests that its states list, and its
results."""

from typing import Any

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard
from bridges.messages.stamps import in_seconds
from bridges.observe.requesters import Moment
from bridges.observe.workcell import ObservedDispenser, ObservedIngestor
from workbench.judge.history import NOT_YET, History, keep


class WorkcellHistory(History[d.DispenserState]):
    """The history of one workcell. A guid names a request.

    - `listed`: guid -> time of the first state that listed the guid.
    - `results`: guid -> the last status. `result_at`: guid -> the time of that result.
    - `acknowledged`: guid -> stamp of its result ACKNOWLEDGED, as long as no state has listed the guid.
    - `left`: the guids that the latest state no longer lists, although the state before listed them.
    - `unexplained`: guid -> the time at which states stopped listing the guid, without a result
      SUCCESS or FAILED.
    - `asked_since`: guid -> the times of the requests after its last result.
    - `result`: the latest message, if the message is a result of this workcell.
    - `result_before`: the status of the previous result for the same guid.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.listed: dict[str, float] = {}
        self.results: dict[str, int] = {}
        self.result_at: dict[str, float] = {}
        self.left: tuple[str, ...] = ()
        self.unexplained: dict[str, float] = {}
        self.asked_since: dict[str, list[float]] = {}
        self.acknowledged: dict[str, float] = {}
        self.result: words.WorkcellResulted | None = None
        self.result_before: int | None = None

    @staticmethod
    def claims(state: Any) -> bool:
        """Return whether RMF would act on this state. This is true for every mode except OFFLINE."""
        return bool(state.mode != d.WorkcellMode.OFFLINE)

    def take(self, heard: Heard, own: bool = False) -> bool:
        """Take a message of any device. Clear `result` and `left`, which belong to the message
        before."""
        self.result, self.left = None, ()
        return super().take(heard, own)

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
            keep(self.asked_since, guid, [*self.asked_since.get(guid, []), self.now][-10:])
            return True
        self.seen.hear(Moment(heard.at, heard.wall), heard.topic, message)
        self.result, self.result_before = message, self.results.get(guid)
        keep(self.results, guid, message.status)
        keep(self.result_at, guid, self.now)
        self.acknowledged.pop(guid, None)
        if message.status == d.WorkcellStatus.SUCCESS:
            self.unexplained.pop(guid, None)
        if message.status == d.WorkcellStatus.ACKNOWLEDGED and guid not in self.listed:
            keep(self.acknowledged, guid, in_seconds(message.time))
        self.asked_since[guid] = []
        return True

    def settle(self, state: d.DispenserState) -> None:
        """Note the requests that the state lists, and the requests that the state no longer lists."""
        queue = set(state.request_guid_queue)
        before = set(self.before.request_guid_queue) if self.before else set(self.listed)
        self.left = tuple(sorted(before - queue))
        for guid in queue - self.listed.keys():
            keep(self.listed, guid, self.now)
            self.acknowledged.pop(guid, None)
        for guid in self.left:
            self.listed.pop(guid, None)
            if self.results.get(guid) not in (d.WorkcellStatus.SUCCESS, d.WorkcellStatus.FAILED):
                keep(self.unexplained, guid, self.now)

    def waited_s(self, guid: str) -> float:
        """Return for how long (s) RMF has repeated this request since its last result. Return -inf for
        fewer than three requests."""
        times = self.asked_since.get(guid) or [self.now]
        return self.now - times[0] if len(times) > 2 else NOT_YET


class DispenserHistory(WorkcellHistory):
    """The history of a dispenser."""

    observes = ObservedDispenser


class IngestorHistory(WorkcellHistory):
    """The history of an ingestor."""

    observes = ObservedIngestor

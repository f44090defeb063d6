"""Request one cycle of a dispenser or ingestor, as DispenseItem.cpp and IngestItem.cpp do."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import ClassVar

from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.topics import AnyTopic
from workbench.graph.requests import Failed, Fulfilled, Obstacle, Request, RequestProgress

TELLS_S = 2.5
"""Maximum time (s) from a result until the workcell's daemon gives the reason for the result.
Diagnostics come each second."""
LOOK = "run rmf-bridge status on its daemon's machine"
DECIDE = f"{LOOK}, then rmf-bridge workcell done, again or failed"
REMEDIES = {
    "MEMORY_LOST": DECIDE,
    "OUTCOME_UNKNOWN": DECIDE,
    "WORKCELL_HALTED": "clear the workcell, then run rmf-bridge reset FILE on its daemon's machine",
}
"""What a person can do about a workcell that is offline with this fault."""


@dataclass(frozen=True, slots=True)
class Dispensing(Request):
    """A request for `quantity` items of `type_guid`, until a result comes. With `type_guid` "", the
    request asks for no items."""

    guid: str
    type_guid: str = ""
    quantity: int = 1
    compartment: str = ""
    transporter: str = field(default="rmf_bridge_send", kw_only=True)

    kind: ClassVar[str] = "dispenser"
    states: ClassVar[AnyTopic] = topics.DISPENSER_STATES
    own: ClassVar[AnyTopic] = topics.DISPENSER_REQUESTS
    answers: ClassVar[tuple[AnyTopic, ...]] = (topics.DISPENSER_RESULTS,)
    made: ClassVar[type[words.WorkcellRequested]] = d.DispenserRequest
    part: ClassVar[type[d.DispenserRequestItem | d.IngestorRequestItem]] = d.DispenserRequestItem

    def message(self, seen: RequestProgress) -> words.WorkcellRequested:
        """Return the request. The request's guid is always the same, so a repeat is no new request."""
        one = self.part(self.type_guid, self.quantity, self.compartment)
        items = (one,) if self.type_guid else ()
        return self.made(d.Time(), self.guid, self.name, self.transporter, items)  # type: ignore[arg-type]

    def outcome(self, seen: RequestProgress) -> Fulfilled | Failed | None:
        """Return Fulfilled or Failed after a result for this request. RMF's adapter also completes a
        request that a newer state no longer lists, but `send` waits for the result."""
        for at, one in seen.results:
            if (one.source_guid, one.request_guid) == (self.name, self.guid):
                if one.status == d.WorkcellStatus.SUCCESS:
                    return Fulfilled(f"{self.name} has served request {self.guid}")
                if one.status == d.WorkcellStatus.FAILED and (why := self._why(seen, at)):
                    return Failed(f"{self.name} has failed request {self.guid}: {why}")
        return None

    def _why(self, seen: RequestProgress, failed_at: float) -> str:
        """Return why the request has failed, in the words of the workcell's daemon. Return "" as long
        as the daemon may not have given the reason yet."""
        told = seen.told
        if told.get("last_refusal request") == self.guid:
            return f"it was refused: {told.get('last_refusal reason')}"
        prefix = f"{self.guid} has failed: "
        if (halted := told.get("WORKCELL_HALTED", "")).startswith(prefix):
            return halted.removeprefix(prefix)
        heard_at = max(seen.stated_at, seen.told_at)
        return "" if heard_at < failed_at + TELLS_S else "see its log"

    def obstacles(self, seen: RequestProgress) -> Iterable[Obstacle]:
        """Return the obstacles, which depend on the workcell's last state."""
        state = seen.states[-1]
        assert isinstance(state, words.WorkcellStated)
        listed = self.guid in state.request_guid_queue
        return (
            Obstacle(
                state.mode == d.WorkcellMode.OFFLINE,
                f"{self.name} is offline; request {self.guid} {'waits' if listed else 'is not listed'}",
                next((REMEDIES[code] for code in REMEDIES if code in seen.told), LOOK),
            ),
            Obstacle(not listed, f"{self.name} does not list request {self.guid}"),
            Obstacle(True, f"{self.name} lists request {self.guid}, and gives no result yet"),
        )


@dataclass(frozen=True, slots=True)
class Ingesting(Dispensing):
    """A request to an ingestor to take items. Everything else is as in `Dispensing`."""

    kind: ClassVar[str] = "ingestor"
    states: ClassVar[AnyTopic] = topics.INGESTOR_STATES
    own: ClassVar[AnyTopic] = topics.INGESTOR_REQUESTS
    answers: ClassVar[tuple[AnyTopic, ...]] = (topics.INGESTOR_RESULTS,)
    made: ClassVar[type[words.WorkcellRequested]] = d.IngestorRequest
    part: ClassVar[type[d.DispenserRequestItem | d.IngestorRequestItem]] = d.IngestorRequestItem

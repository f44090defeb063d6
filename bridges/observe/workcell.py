"""Observation of a dispenser or ingestor: its requests, its queue, and the result of each request."""

from collections.abc import Iterator
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.observe.device import ObservedDevice, Wait
from bridges.observe.news import News
from bridges.observe.requesters import Fact, Moment

FINAL: Final = ("success", "failed")
"""RMF's words for the results that end a request."""
SHOWN: Final = 10
"""The maximum number of a queue's guids that are kept for display."""


class ObservedWorkcell(ObservedDevice[d.DispenserState]):
    """A dispenser or ingestor as observed. A requester's name is the guid of its request.

    `mode`: RMF's word for the mode. `queue`: the guids that the state lists. `results`: RMF's word for
    the last result of each guid. The messages of an ingestor have the same fields as those of a
    dispenser.
    """

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.mode = Fact("", began)
        self.queue = Fact("", began)
        self.results: dict[str, str] = {}

    def facts(self, state: d.DispenserState) -> dict[str, str]:
        """Return the mode and the queue that the state shows."""
        guids = [self.text(guid) for guid in state.request_guid_queue[:SHOWN]]
        return {"mode": words.plain(d.WorkcellMode, state.mode), "queue": ", ".join(guids)}

    def lists(self, guid: str) -> bool:
        """Return whether the last state lists this request."""
        queue = self.state.request_guid_queue if self.state else ()
        return guid in map(self.text, queue)

    def waits(self, now: Moment) -> Iterator[Wait]:
        """Yield each request that a fleet adapter still repeats, and that has no final result yet."""
        for one in self.requesters:
            if one.asks(now) and self.results.get(one.who) not in FINAL:
                yield Wait(one.who, one.wants, one.since)

    def _hear_other(self, moment: Moment, topic: str, message: d.Message) -> Iterator[News]:
        if isinstance(message, d.DispenserRequest | d.IngestorRequest):
            who, wants = self.text(message.request_guid), self.text(words.items(message))
            one, new = self.requesters.ask(who, wants, moment, stands=False)
            if new:
                yield News("asks", moment, who, requester=one)
        elif isinstance(message, d.DispenserResult | d.IngestorResult):
            yield from self._hear_result(moment, message)

    def _hear_result(
        self, moment: Moment, message: d.DispenserResult | d.IngestorResult
    ) -> Iterator[News]:
        who, says = self.text(message.request_guid), words.result(message)
        if self.results.pop(who, "") != says:
            yield News("result", moment, who, says)
        self.results[who] = says
        while len(self.results) > SHOWN:
            del self.results[next(iter(self.results))]

    def _settle(self, moment: Moment) -> Iterator[News]:
        if self.changed and self.before is not None:
            yield News("changed", moment)
        for one in self.requesters:
            if not one.asks(moment) and not self.lists(one.who):
                self.requesters.drop(one.who)


class ObservedDispenser(ObservedWorkcell):
    """A dispenser."""

    kind = "dispenser"


class ObservedIngestor(ObservedWorkcell):
    """An ingestor."""

    kind = "ingestor"

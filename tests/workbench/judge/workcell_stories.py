"""Three stories for each law of workcells. The first story has no occasion: no event at which a wrong
workcell would break the law. In the second the workcell keeps the law, and in the third the workcell
breaks the law."""

from typing import Any

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from bridges.messages.topics import AnyTopic
from workbench.judge.judge import JudgedKind

ACKNOWLEDGED, SUCCESS, FAILED = 0, 1, 2
Line = tuple[float, AnyTopic, d.Message]
NAMES = {"dispenser": "store", "ingestor": "intake"}


class WorkcellLines:
    """A maker of messages for one kind of workcell. Each message comes with its time and topic."""

    def __init__(self, kind: str) -> None:
        self.name = NAMES[kind]
        dispenses = kind == "dispenser"
        self._state: Any = d.DispenserState if dispenses else d.IngestorState
        self._request: Any = d.DispenserRequest if dispenses else d.IngestorRequest
        self._result: Any = d.DispenserResult if dispenses else d.IngestorResult
        self._states: Any = topics.DISPENSER_STATES if dispenses else topics.INGESTOR_STATES
        self._requests: Any = topics.DISPENSER_REQUESTS if dispenses else topics.INGESTOR_REQUESTS
        self._results: Any = topics.DISPENSER_RESULTS if dispenses else topics.INGESTOR_RESULTS

    def state(self, at: float, *queue: str, mode: int = 0, read_at: float | None = None) -> Line:
        time = stamp(1000.0 + (at if read_at is None else read_at))
        return at, self._states, self._state(time, self.name, mode, queue)

    def never_read(self, at: float) -> Line:
        return at, self._states, self._state(d.Time(), self.name)

    def ask(self, at: float, guid: str = "a") -> Line:
        return at, self._requests, self._request(d.Time(), guid, self.name)

    def result(self, at: float, status: int, guid: str = "a") -> Line:
        return at, self._results, self._result(stamp(1000.0 + at), guid, self.name, status)

    def states(self, until: float, *queue: str, begin: float = 0.0) -> list[Line]:
        count = int(until - begin) + 1
        return [self.state(begin + n, *queue) for n in range(count)]


def stories(kind: JudgedKind, senders: Any, twins: Any) -> dict[tuple[JudgedKind, str], Any]:
    """Return three stories for each (kind, law). The first has no occasion, the second keeps the law,
    and the third breaks it."""
    of = WorkcellLines(kind)
    served = [of.ask(0.1), of.state(0.2, "a", mode=1), of.result(0.3, ACKNOWLEDGED)]
    return {
        (kind, "W1.numbers"): ([of.ask(0.0)], of.states(1.0), [of.result(0.0, 7)]),
        (kind, "W2.lists"): (
            of.states(2.0),
            [of.state(0.0), *served],
            [of.state(0.0), of.ask(0.1), of.result(0.2, ACKNOWLEDGED), *of.states(4.0, begin=1.0)],
        ),
        (kind, "W2.done"): (
            [*served, of.state(1.0, "a")],
            [*served, of.result(1.1, SUCCESS), of.state(1.2), of.state(2.5)],
            [*served, of.result(1.1, FAILED), of.state(1.2), of.state(3.5)],
        ),
        (kind, "W3.result"): (
            [*served, of.result(1.0, SUCCESS)],
            [*served, of.result(1.0, SUCCESS), of.result(2.0, SUCCESS)],
            [*served, of.result(1.0, SUCCESS), of.result(2.0, FAILED)],
        ),
        (kind, "W3.repeats"): (
            served,
            [*served, of.ask(1.1), of.result(1.2, ACKNOWLEDGED)],
            [*served, *of.states(8.0, "a", begin=1.0), *(of.ask(1.1 + n) for n in range(8))],
        ),
        (kind, "W4.rate"): (
            [of.state(0.0)],
            of.states(2.0),
            [of.state(0.0), of.state(6.0)],
        ),
        (kind, "W4.stamp"): ([of.ask(0.0)], of.states(1.0), [of.never_read(0.0)]),
        (kind, "B0.one"): (
            of.states(12.0),
            [senders("/a"), *of.states(12.0)],
            twins(of.state),
        ),
    }

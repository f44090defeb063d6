"""The daemon reports a refused ChargerRequest on a topic, in the status and in diagnostics."""

from dataclasses import dataclass, field
from typing import Any

from msgspec.structs import replace

from bridges.kinds.charger import KIND
from bridges.kinds.charger.memory import ChargerLimits
from bridges.kinds.charger.refusals import ChargerRefusal, read
from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample
from bridges.messages import topics
from bridges.messages.definitions import (
    ChargerCancel,
    ChargerRequest,
    ChargerState,
    DiagnosticStatus,
    Duration,
    KeyValue,
    Time,
)
from bridges.runtime.clock import Clock
from bridges.runtime.device import Node
from bridges.runtime.diagnostics import diagnosis
from tests.accepted import accepted

FIRST = ChargerRequest("a", "tiny", "AMR01", Duration(60), "req-1")
SECOND = ChargerRequest("a", "tiny", "AMR02", Duration(60), "req-2")
REFUSED = ChargerRefusal(
    request_id="req-2",
    charger="a",
    robot="tiny/AMR02",
    reason="charger occupied",
    state="ASSIGNED",
    held_by="tiny/AMR01",
    held_request="req-1",
)


class Idle:
    """A driver of a station that stays idle."""

    def open(self) -> None: ...

    def read(self) -> ChargerSample:
        return ChargerSample(Activity.IDLE, 0)

    def write(self, outputs: ChargerOutputs) -> None: ...

    def make_safe(self) -> None: ...

    def close(self) -> None: ...


@dataclass
class Station:
    """A charger's node that scans once per call of `hears`. `said` has (topic, message) of each
    message."""

    now: float = 0.0
    said: list[tuple[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.settings, clock = ChargerSettings(), Clock(lambda: self.now, lambda: 1e9 + self.now)
        limits = ChargerLimits.of(self.settings)
        self.node = Node("a", KIND, self.settings, limits, Idle(), self._say, clock)

    def _say(self, topic: Any, message: Any) -> None:
        self.said.append((topic.name, message))

    def hears(self, *requests: ChargerRequest | ChargerCancel, after_s: float = 1.0) -> "Station":
        cancel = topics.CHARGER_CANCELS
        heard = [
            (cancel if isinstance(r, ChargerCancel) else topics.CHARGER_REQUESTS, r)
            for r in requests
        ]
        self.node.scan(accepted(self.node, KIND, self.settings, *heard))
        self.now += after_s
        return self

    def refusals(self) -> list[ChargerRefusal | None]:
        return [read(m) for topic, m in self.said if topic == topics.CHARGER_REFUSALS.name]

    def states(self) -> list[tuple[int, str]]:
        found = [m for _, m in self.said if isinstance(m, ChargerState)]
        return [(m.state, m.request_id) for m in found]


def test_a_robot_that_asks_for_an_occupied_charger_learns_the_name_of_the_other_robot() -> None:
    it = Station().hears().hears(FIRST).hears(SECOND).hears()
    assert it.refusals() == [REFUSED]
    assert it.states() == [(1, ""), (2, "req-1"), (2, "req-1"), (2, "req-1")]
    assert REFUSED.text == "charger occupied: tiny/AMR01 has it (request req-1)"


def test_a_refusal_is_a_diagnostic_status_with_one_value_for_each_field() -> None:
    it = Station().hears().hears(FIRST).hears(SECOND)
    assert [m for topic, m in it.said if topic == "charger_refusals"] == [
        DiagnosticStatus(
            level=1,
            name="ChargerRequest refused",
            message="charger occupied: tiny/AMR01 has it (request req-1)",
            hardware_id="a",
            values=(
                KeyValue("request_id", "req-2"),
                KeyValue("charger", "a"),
                KeyValue("robot", "tiny/AMR02"),
                KeyValue("reason", "charger occupied"),
                KeyValue("state", "ASSIGNED"),
                KeyValue("held_by", "tiny/AMR01"),
                KeyValue("held_request", "req-1"),
                KeyValue("error", ""),
            ),
        )
    ]


def test_a_granted_request_and_its_repeat_and_a_cancel_get_no_answer() -> None:
    it = Station().hears().hears(FIRST).hears(FIRST).hears(ChargerCancel("a", "nobody"))
    assert it.refusals() == []


def test_every_repeat_of_a_refused_request_is_answered_because_an_answer_may_be_lost() -> None:
    it = Station().hears().hears(FIRST).hears(SECOND).hears(SECOND)
    assert it.refusals() == [REFUSED, REFUSED]


def test_the_next_scan_answers_a_malformed_request_with_its_mistake() -> None:
    it = Station().hears().hears(replace(FIRST, start_timeout=Duration(-1)))
    long = replace(FIRST, robot_name="x" * 5000)
    it.hears(long)
    first, second = it.refusals()
    assert first == ChargerRefusal(
        request_id="req-1",
        charger="a",
        robot="tiny/AMR01",
        reason="negative start_timeout: -1 s",
        state="IDLE",
    )
    assert second is not None
    assert (second.robot, second.reason[:21]) == ("tiny/" + "x" * 256, "impossible robot_name")


def test_a_flood_of_requests_causes_no_flood_of_answers() -> None:
    it = Station().hears().hears(FIRST)
    for n in range(50):
        flood = [replace(SECOND, request_id=f"r-{n}-{i}") for i in range(40)]
        it.hears(*flood, after_s=0.02)
    assert len(it.refusals()) == 100


def test_an_answer_that_must_wait_wakes_the_loop() -> None:
    it = Station().hears().hears(FIRST).hears(SECOND, after_s=0.01).hears(SECOND, after_s=0.0)
    assert (it.refusals(), round(it.node.wake_at, 3)) == ([REFUSED], 2.1)
    it.now = it.node.wake_at
    it.hears()
    assert it.refusals() == [REFUSED, REFUSED]


def test_the_last_refusal_is_in_the_status_and_in_diagnostics() -> None:
    it = Station().hears().hears(FIRST)
    assert "last_refusal" not in it.node.status()
    it.hears(SECOND)
    status = it.node.status()
    assert status["last_refusal"] == REFUSED.fields()
    (_, shown) = diagnosis("a_daemon", "charger", {}, {"a": status}, Time(1)).status
    values = {pair.key: pair.value for pair in shown.values}
    assert values["last_refusal reason"] == "charger occupied"
    assert values["last_refusal held_by"] == "tiny/AMR01"
    assert values["refused charger occupied"] == "1"


def test_a_status_without_a_refusal_is_not_read_as_a_refusal() -> None:
    message = REFUSED.message()
    others = [replace(message, name="x"), replace(message, values=()), DiagnosticStatus()]
    assert [read(status) for status in (message, *others)] == [REFUSED, None, None, None]

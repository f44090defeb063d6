"""`send dispenser` and `send ingestor` in virtual time."""

from typing import Any

import pytest

from bridges.messages import definitions as d
from tests.workbench.graph.test_exchange import Ran, tell
from workbench.graph.requests import Failed, Fulfilled
from workbench.graph.requests.workcell import Dispensing, Ingesting

ASK = Dispensing("store", "mine", "box", 2, "left")


def state(mode: int = 0, *queue: str) -> d.DispenserState:
    return d.DispenserState(d.Time(1), "store", mode, queue)


def result(status: int, guid: str = "mine", source: str = "store") -> d.DispenserResult:
    return d.DispenserResult(d.Time(2), guid, source, status)


def sent(ran: Ran) -> list[Any]:
    return [message for _, message in ran.sent]


def test_the_request_is_repeated_with_one_guid_until_its_result() -> None:
    ran = tell(ASK, [(0.1, state()), (1.5, state(1, "mine")), (3.4, result(1))])
    item = d.DispenserRequestItem("box", 2, "left")
    request = d.DispenserRequest(d.Time(), "mine", "store", "rmf_bridge_send", (item,))
    assert sent(ran) == [request] * 4
    assert ran.outcome == Fulfilled("store has served request mine")


SILENT = [(2.0, state()), (3.0, state()), (4.0, state())]


def test_a_failure_is_told() -> None:
    ran = tell(ASK, [(0.1, state()), (1.0, result(2)), *SILENT])
    assert ran.outcome == Failed("store has failed request mine: see its log")
    assert ran.at == 4.0


@pytest.mark.parametrize(
    ("told", "why"),
    [
        (
            {
                "last_refusal request": "mine",
                "last_refusal reason": "cannot be asked here: most is 1",
            },
            "it was refused: cannot be asked here: most is 1",
        ),
        (
            {"WORKCELL_HALTED": "mine has failed: done did not come; rmf-bridge reset when clear"},
            "done did not come; rmf-bridge reset when clear",
        ),
        ({"WORKCELL_HALTED": "theirs has failed: jam"}, "see its log"),
        ({"last_refusal request": "theirs", "last_refusal reason": "x"}, "see its log"),
    ],
)
def test_a_failure_gives_the_daemons_own_reason(told: dict[str, str], why: str) -> None:
    ran = tell(ASK, [(0.1, state()), (1.0, result(2)), *SILENT], told=told)
    assert ran.outcome == Failed(f"store has failed request mine: {why}")


@pytest.mark.parametrize(
    "other", [result(1, guid="another"), result(1, source="another"), result(0)]
)
def test_another_result_is_no_outcome(other: d.DispenserResult) -> None:
    ran = tell(ASK, [*((n / 2, state(1, "mine")) for n in range(20)), (1.0, other)])
    assert isinstance(ran.outcome, Failed)
    assert "lists request mine, and gives no result yet" in ran.outcome.text


@pytest.mark.parametrize(
    ("told", "command"),
    [
        ({"MEMORY_LOST": ""}, "rmf-bridge workcell done, again or failed"),
        ({"OUTCOME_UNKNOWN": "mine"}, "rmf-bridge workcell done, again or failed"),
        ({"WORKCELL_HALTED": "theirs has failed: jam"}, "rmf-bridge reset FILE"),
        ({"COMMUNICATION_LOST": ""}, "rmf-bridge status on"),
        ({}, "rmf-bridge status on"),
    ],
)
def test_an_offline_workcell_names_the_command_that_helps(
    told: dict[str, str], command: str
) -> None:
    ran = tell(ASK, [(n / 2, state(2, "mine")) for n in range(20)], told=told)
    text = str([*ran.hints, ran.outcome])
    assert command in text
    assert ("workcell done" in text) == ("workcell done" in command)


def test_an_ingestor_is_asked_with_its_own_messages_and_may_be_asked_for_nothing() -> None:
    ask = Ingesting("intake", "mine")
    found = d.IngestorState(d.Time(1), "intake")
    ran = tell(ask, [(0.1, found), (1.0, d.IngestorResult(d.Time(2), "mine", "intake", 1))])
    assert sent(ran)[0] == d.IngestorRequest(d.Time(), "mine", "intake", "rmf_bridge_send", ())
    assert isinstance(ran.outcome, Fulfilled)

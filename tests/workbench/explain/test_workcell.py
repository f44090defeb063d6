"""`explain` for a dispenser or ingestor. The reasons come from the requests to the workcell, and from
the requests that the workcell's state lists."""

from typing import Any

import pytest

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.observe.all_devices import PlainGraph
from bridges.runtime.diagnostics import diagnosis
from bridges.runtime.faults import for_explain
from workbench.explain.heard_devices import HeardDevices

WALL = 1_800_000_000.0


def told(*lines: tuple[float, str, Any], kind: str = "dispenser") -> Any:
    site = HeardDevices()
    for at, topic, message in sorted(lines, key=lambda line: line[0]):
        site.take(Heard(at, WALL + at, f"{kind}_{topic}", message))
    [(found, name)] = site.devices()
    return site.explain(found, name, None)


def states(until: float, mode: int, *queue: str) -> list[tuple[float, str, Any]]:
    return [
        (float(n), "states", d.DispenserState(stamp(WALL + n), "store", mode, queue))
        for n in range(int(until) + 1)
    ]


def asks(until: float) -> list[tuple[float, str, Any]]:
    items = (d.DispenserRequestItem("box", 1),)
    request = d.DispenserRequest(d.Time(), "task", "store", "", items)
    return [(n + 0.5, "requests", request) for n in range(int(until))]


def result(at: float, status: int) -> tuple[float, str, Any]:
    return at, "results", d.DispenserResult(stamp(WALL + at), "task", "store", status)


@pytest.mark.parametrize(
    ("lines", "says", "who"),
    [
        (states(9, 0), "Nobody requests the workcell.", "nobody"),
        (
            states(19, 0, "task") + asks(5),
            "Its state still lists task, but no fleet adapter repeats it.",
            "nobody",
        ),
        (states(9, 0, "task"), "Whether a fleet adapter still waits is not known", "a person"),
        (
            states(9, 1, "task"),
            "Whether a fleet adapter still waits is not known",
            "the controller",
        ),
        (states(9, 2), "Nobody requests the workcell.", "a person"),
        (states(9, 2, "task") + asks(9), "has had no answer", "a person"),
        (states(9, 1, "task") + asks(9), "Request task has asked for 1 box", "the controller"),
        (states(9, 0, "task") + asks(9), "Request task has asked for 1 box", "the controller"),
        (states(9, 0) + asks(9), "Request task has asked for 1 box", "the device's node"),
        ([*states(9, 2, "task"), *asks(9), result(5.6, 2)], "It has failed", "the fleet adapter"),
    ],
)
def test_it_says_which_request_waits_and_who_must_act(lines: Any, says: str, who: str) -> None:
    found = told(*lines)
    assert says in " ".join(found.now)
    assert [step.who for step in found.next][:1] == [who]


def test_why_a_cell_of_another_node_is_not_ready_is_not_known() -> None:
    (step,) = told(*states(9, 0, "task"), *asks(9)).next
    assert step.what == "become ready; why it is not ready is not known"


@pytest.mark.parametrize("repeated_s", [9, 2])
@pytest.mark.parametrize(
    ("code", "do"),
    [
        ("OUTCOME_UNKNOWN", "look at the robot and the machine"),
        ("WORKCELL_FAULT", "mend the workcell"),
        ("WORKCELL_HALTED", "clear the workcell"),
        ("NOT_KEPT", "make room on the disk"),
    ],
)
def test_a_workcell_that_can_be_read_is_offline_for_its_fault(
    code: str, do: str, repeated_s: float
) -> None:
    said = {"faults": [{"code": code, "detail": ""}]}
    site = HeardDevices()
    for at, topic, message in sorted([*states(9, 2, "task"), *asks(repeated_s)], key=_at):
        site.take(Heard(at, WALL + at, f"dispenser_{topic}", message))
        told = diagnosis("node", "dispenser", {}, {"store": said}, stamp(WALL + at))
        site.take(Heard(at, WALL + at, "diagnostics", told))
    explained = site.explain("dispenser", "store", None, for_explain())
    assert [(step.who, step.what.startswith(do)) for step in explained.next] == [("a person", True)]


@pytest.mark.parametrize(
    ("waits", "who"),
    [
        ("", "nobody"),  # after a failure the state lists the request for a day
        ("for the workcell to be ready", "the controller"),
        ("for RMF to repeat the request", "the fleet adapter"),
    ],
)
def test_of_a_listed_request_its_own_daemon_says_whether_it_waits(waits: str, who: str) -> None:
    site = HeardDevices()
    for at, topic, message in states(9, 0, "task"):
        site.take(Heard(at, WALL + at, f"dispenser_{topic}", message))
        told = diagnosis("node", "dispenser", {}, {"store": {"waits": waits}}, stamp(WALL + at))
        site.take(Heard(at, WALL + at, "diagnostics", told))
    explained = site.explain("dispenser", "store", None, for_explain())
    assert [step.who for step in explained.next] == [who]


@pytest.mark.parametrize(("status", "waits"), [(0, [4.5]), (1, []), (2, [])])
def test_a_wait_ends_with_its_result_though_rmf_repeats_the_request(
    status: int, waits: list[float]
) -> None:
    """Check how long RMF's request waits. notify, the exporter and the recorder use the same times."""
    graph = PlainGraph()
    request = [(at + 4.0, topic, message) for at, topic, message in asks(3)]
    for at, topic, message in sorted([*states(9, 0), *request, result(5.0, status)], key=_at):
        graph.hear(Heard(at, WALL + at, f"dispenser_{topic}", message))
    [store] = graph.stated("dispenser")
    assert [wait.since.at for wait in store.waits(graph.now)] == waits


def _at(line: tuple[float, str, Any]) -> float:
    return line[0]


def test_the_story_has_the_request_its_results_and_the_changes() -> None:
    lines = [*states(3, 0), *asks(3), result(1.6, 0), result(2.6, 1)]
    story = [line.text for line in told(*lines).story]
    assert story == [
        "store is asked for 1 box (request task)",
        "store answers request task: acknowledged",
        "store answers request task: success",
    ]

"""The memory of our observers about our nodes' messages on `/diagnostics`. The memory must stay
bounded."""

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.observe.all_devices import PlainGraph
from bridges.observe.limits import MOST_NODES, QUIET_S, SILENT_S

LIFT = d.LiftState(lift_name="L")


def says(name: str, device: str, message: str = "OK", **values: str) -> d.DiagnosticStatus:
    level = d.DiagnosticLevel.OK if message == "OK" else d.DiagnosticLevel.ERROR
    pairs = {"kind": "lift", **{key.replace("_", " "): text for key, text in values.items()}}
    return d.DiagnosticStatus(
        level, name, message, device, tuple(d.KeyValue(*pair) for pair in pairs.items())
    )


def told(graph: PlainGraph, at: float, *statuses: d.DiagnosticStatus) -> list[tuple[str, str]]:
    heard = Heard(at, at, "/diagnostics", d.DiagnosticArray(d.Header(d.Time()), statuses))
    return [(one.what, one.text) for _, news in graph.hear(heard) for one in news]


def graph() -> PlainGraph:
    made = PlainGraph()
    made.hear(Heard(0.0, 0.0, "/lift_states", LIFT))
    return made


def test_a_fault_is_news_when_it_comes_and_when_it_ends() -> None:
    site = graph()
    fault = says("n: L", "L", "OVERLOAD", OVERLOAD="since 3 s")
    assert told(site, 10.0, fault) == [("fault", "OVERLOAD")]
    assert told(site, 11.0, fault) == []
    assert told(site, 12.0, says("n: L", "L")) == [("fault over", "OVERLOAD")]


def test_a_refusal_is_news_again_after_a_minute() -> None:
    site, at = graph(), 10.0
    assert told(site, at, says("n: L", "L", refused_full="1")) == [("refused", "full")]
    assert told(site, at + 1.0, says("n: L", "L", refused_full="2")) == []
    later = at + 2.0 + QUIET_S
    assert told(site, later, says("n: L", "L", refused_full="3")) == [("refused", "full")]


def test_invented_nodes_displace_no_node_that_publishes() -> None:
    site = graph()
    lift = site.known["lift", "L"]
    told(site, 10.0, *(says(f"{n}: L", "L") for n in range(MOST_NODES + 5)))
    assert [*lift.diagnoses] == [f"{n}: L" for n in range(MOST_NODES)]
    told(site, 11.0 + SILENT_S, says("new: L", "L"))
    assert [*lift.diagnoses][-1] == "new: L"
    assert "0: L" not in lift.diagnoses


def test_diagnostics_of_a_daemon_itself_are_no_lift() -> None:
    site = graph()
    told(site, 10.0, says("L: daemon", "L", "SIMULATED"))
    assert [*site.nodes] == ["L: daemon"]
    assert site.known["lift", "L"].diagnoses == {}

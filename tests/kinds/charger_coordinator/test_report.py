"""The coordinator's report and the texts in it. Also the times at which the core asks to be woken."""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger_coordinator import core, report
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    Grant,
    Nudge,
    SiteLimits,
    SiteMemory,
    Standing,
    StationSeen,
    Wish,
)
from bridges.kinds.charger_coordinator.signals import (
    ChargerStateHeard,
    ChargeUnwanted,
    Sighting,
)
from bridges.kinds.shared.durations import NEVER
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages import definitions as d
from tests.kinds.charger_coordinator.alone import ONE, SETTINGS, TWO, A, Alone, B

SITE = SiteLimits.of(SETTINGS)


# ---- COORDINATOR-REPORT-2, COORDINATOR-REPORT-3: the report


def test_the_report_names_each_station_with_its_state_and_robot() -> None:
    site_ = Alone()
    site_.shows = {A: ChargerStateHeard(A, IDLE)}
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, CHARGING)
    site_.run(1)
    shown = report.report(site_.memory, site_.now, SITE)
    assert shown.read_at == 2.0
    assert shown.stations == ((A, "CHARGING tiny/AMR01, by the robot"), (B, "?"))
    site_.hears(ChargeUnwanted(site_.memory.grants[A].request_id))
    assert report.report(site_.memory, site_.now, SITE).stations[0] == (A, "CHARGING")


@pytest.mark.parametrize(
    ("error", "who"),
    [
        ("unknown receiver RX-99", "unknown receiver RX-99"),
        ("wrong docking: other/robot is not assigned here", "an unknown robot"),
    ],
)
def test_the_report_names_an_unknown_robot_on_a_pad_as_far_as_possible(
    error: str, who: str
) -> None:
    site_ = Alone()
    site_.shows[A] = ChargerStateHeard(A, ERROR, "unrequested/charger_a", None, error)
    site_.run(1)
    assert site_.faults == [f"WRONG_STATION: {who} stands at charger_a, but nobody requested that"]


def test_a_fault_becomes_an_alert_with_title_reason_and_tier() -> None:
    site_ = Alone()
    site_.run(1)
    alerts = []
    for station, error in ((A, "station: fan"), (B, "unknown receiver RX-99")):
        heard = ChargerStateHeard(station, ERROR, f"unrequested/{station}", None, error)
        decided = core.decide(site_.memory, heard, site_.now, SITE)
        site_.memory = decided.memory
        alerts += [message for _, message in decided.publish]
    detail = "charger_a: station: fan"
    stranger = "unknown receiver RX-99 stands at charger_b, but nobody requested that"
    assert alerts == [
        d.Alert(
            id=f"charger_coordinator/STATION_OUT_OF_SERVICE/{detail}",
            title="A charger is out of service",
            subtitle="STATION_OUT_OF_SERVICE",
            message=detail,
            tier=int(d.AlertTier.TIER_ERROR),
        ),
        d.Alert(
            id=f"charger_coordinator/WRONG_STATION/{stranger}",
            title="A robot is at the wrong charger",
            subtitle="WRONG_STATION",
            message=stranger,
            tier=int(d.AlertTier.TIER_WARNING),
        ),
    ]


def test_the_assignments_are_published_again_after_a_rival_has_gone() -> None:
    def published(event: object) -> list[str]:
        decided = core.decide(site_.memory, event, site_.now, SITE)  # type: ignore[arg-type]
        site_.memory = decided.memory
        return [topic.name for topic, _ in decided.publish]

    site_ = Alone()
    site_.run(1)
    assert published(Woken()) == []
    assert published(MaySpeak(False)) == []
    assert published(MaySpeak(True)) == ["charging_assignments"]


def test_the_report_tells_which_robot_was_told_to_leave_another_pad_until_it_has_left() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    told = {ONE: Nudge(site_.memory.grants[A].request_id, 1, 1.0)}
    for place, more in (("dock_b", ", told to leave another pad"), (None, ""), ("dock_a", "")):
        there = {ONE: Standing(Sighting(ONE, True, place, 40.0, "task"), site_.now)}
        memory = replace(site_.memory, nudges=told, robots=there)
        shown = report.report(memory, site_.now, SITE)
        assert shown.stations[0] == (A, f"IDLE tiny/AMR01, by the robot{more}"), place
    adopted = replace(site_.memory, wishes=(Wish(ONE, "operator"),))
    shown = report.report(adopted, site_.now, SITE)
    assert shown.stations[0] == (A, "IDLE tiny/AMR01, by an adopted request")
    late = report.report(adopted, site_.memory.silent_since(A), SITE)
    assert late.stations[0] == (A, "silent, was IDLE tiny/AMR01, by an adopted request")
    unknown = report.report(replace(site_.memory, wishes=()), site_.now, SITE)
    assert unknown.stations[0] == (A, "IDLE tiny/AMR01")


def test_an_assignment_is_repeated_for_a_robot_with_a_station_that_stands_idle_elsewhere() -> None:
    idle = Standing(Sighting(ONE, False, "wait_1", 40.0, ""), 2.0)
    other = Standing(Sighting(TWO, False, "wait_2", 40.0, ""), 2.0)
    grant = Grant(ONE, "r1", 5.0)
    memory = SiteMemory(
        may_speak=True, robots={ONE: idle, TWO: other}, grants={A: grant, B: Grant(TWO, "r2", 9.0)}
    )
    assert sorted(report.due(memory, SITE))[-2:] == [20.0, 24.0]
    for done in (replace(grant, started=True), replace(grant, over=True)):
        one = replace(memory, grants={A: done, B: memory.grants[B]})
        assert [at for at in report.due(one, SITE) if 20.0 <= at < 99.0] == [24.0]
    for change in ({"task_id": "work"}, {"place": None}, {"place": "charger_a"}):
        seen = replace(idle, sighting=replace(idle.sighting, **change))
        one = replace(memory, robots={ONE: seen, TWO: other})
        assert [at for at in report.due(one, SITE) if 20.0 <= at < 99.0] == [24.0]


def test_a_cancel_is_repeated_only_while_the_station_shows_the_cancelled_request() -> None:
    over = Grant(ONE, "r1", 5.0, over=True, sent_at=7.0)
    for request_id, at in (("r1", 8.0), ("r2", NEVER)):
        seen = StationSeen(ASSIGNED, request_id, ONE, "", 7.0, 7.0)
        memory = SiteMemory(may_speak=True, grants={A: over}, stations={A: seen})
        assert report.due(memory, SITE)[-1] == at


def test_a_robot_on_a_pad_that_nobody_requested_is_a_fault_after_five_seconds() -> None:
    error = "wrong docking: tiny/AMR01 is not assigned here"
    seen = StationSeen(ERROR, "", None, error, 12.0, 10.0)
    memory = SiteMemory(
        may_speak=True, stations={A: seen, B: StationSeen(IDLE, "", None, "", 14, 0)}
    )
    faults = [report.report(memory, now, SITE).faults for now in (14.9, 15.0)]
    assert [[fault.code for fault in them] for them in faults] == [[], ["WRONG_STATION"]]
    assert 15.0 in report.due(memory, SITE)


def wakes(site_: Alone) -> float:
    return core.decide(site_.memory, Woken(), site_.now, SITE).wake_at


# ---- COORDINATOR-REPORT-1, COORDINATOR-3: when the core asks to be woken


def test_the_core_wakes_for_a_silent_station_and_for_a_repeat_of_a_request() -> None:
    site_ = Alone()
    site_.run(1)
    assert wakes(site_) == 6.0
    site_.wants(ONE)
    site_.run(1)
    assert wakes(site_) == 3.0


def test_the_core_wakes_when_a_request_has_not_been_taken() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.now = 10.5
    site_.memory = core.decide(site_.memory, Woken(), site_.now, SITE).memory
    assert wakes(site_) == 11.0


def test_the_core_wakes_when_a_robot_on_its_way_needs_another_station() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ERROR, "Charger unreachable")
    site_.run(30)
    site_.now = 31.5
    assert [text for _, text in site_.sent] == ["charger_a: AMR01"]
    assert wakes(site_) == 32.0

"""The coordinator's report and the texts in it. Also the times at which the core asks to be woken."""

import pytest

from bridges.kinds.charger_coordinator import core, report
from bridges.kinds.charger_coordinator.memory import (
    CHARGING,
    ERROR,
    IDLE,
    SiteLimits,
)
from bridges.kinds.charger_coordinator.signals import (
    ChargerStateHeard,
    ChargeUnwanted,
)
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages import definitions as d
from tests.kinds.charger_coordinator.alone import ONE, SETTINGS, A, Alone, B

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

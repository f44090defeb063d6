"""COORDINATOR-2: two brands of robots share the stations, and each brand has its own waypoint names."""

from typing import Any

import pytest

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import messages
from bridges.kinds.charger_coordinator.signals import ReceiverHeard
from bridges.messages import definitions as d
from bridges.messages import topics
from tests.kinds.charger_coordinator.virtual_site import PLACES, Yard, settings, two_brands


def yard() -> Yard:
    """Return a simulated charging yard. Both fleets run, and no robot wants to charge."""
    site = Yard(two_brands(), finishing="charge")
    assert [what for _, what in site.run(5.0)][-4:] == [
        "B01 -> WAIT bay_1",
        "AMR01 -> WAIT wait_1",
        "AMR02 -> WAIT wait_2",
        "AMR03 -> WAIT wait_3",
    ]
    return site


def test_robots_of_two_brands_are_charged_at_the_same_stations() -> None:
    site = yard()
    site.big.charge("B01", site.now)
    site.run(6.0)
    site.fleet.charge("AMR01", site.now)
    site.run(7.0)
    site.fleet.charge("AMR02", site.now)
    assert site.run(36.0) == [
        (7.25, "charger_a <- charge B01"),
        (7.25, "charger_a: ASSIGNED B01"),
        (7.25, "B01 -> CHARGE station_1"),
        (8.25, "charger_b <- charge AMR01"),
        (8.25, "charger_b: ASSIGNED AMR01"),
        (8.25, "AMR01 -> CHARGE dock_b"),
        (13.25, "charger_a: CHARGING B01"),
        (14.25, "charger_b: CHARGING AMR01"),
        (25.5, "charger_a: RELEASED B01"),
        (25.5, "B01 -> WAIT bay_1"),
        (26.5, "charger_a: IDLE"),
        (26.5, "charger_b: RELEASED AMR01"),
        (26.5, "charger_a <- charge AMR02"),
        (26.5, "charger_a: ASSIGNED AMR02"),
        (26.5, "AMR02 -> CHARGE charger_a"),
        (26.5, "AMR01 -> WAIT wait_1"),
        (27.5, "charger_b: IDLE"),
        (32.5, "charger_a: CHARGING AMR02"),
    ]
    assert site.faults == []


def test_a_robot_of_the_other_brand_is_sent_on_by_its_own_waypoint_names() -> None:
    site = yard()
    site.big.charge("B01", site.now)
    site.run(8.5)
    site.big.robots["B01"].goes_to = "station_2"
    assert site.run(14.0) == [
        (11.25, "charger_b: ERROR B01 (wrong docking: big/B01 is not assigned here)"),
        (11.25, "B01 -> WAIT bay_1"),
        (11.5, "charger_b: IDLE"),
        (12.25, "B01 -> CHARGE station_1"),
    ]


@pytest.mark.parametrize(("state", "error"), [(3, ""), (200, "robot: NTC")])
def test_the_receiver_on_a_robot_is_not_a_station(state: int, error: str) -> None:
    told = d.ChargerState(charger_name="rcu_b01", state=state, error_message=error)
    heard = messages.accept_state(told, two_brands(), 0.0)
    assert heard == ReceiverHeard(RobotName("big", "B01"), error)


def test_the_receiver_on_a_robot_gets_no_request_but_its_errors_are_shown() -> None:
    site = yard()
    states: Any = site.rmf.publisher(topics.CHARGER_STATES)
    states.publish(d.ChargerState(charger_name="rcu_b01", state=1))
    states.publish(d.ChargerState(charger_name="rcu_b01", state=200, error_message="robot: NTC"))
    assert site.run(8.0) == [
        (5.0, "ALERT RECEIVER_ERROR: the receiver on big/B01: robot: NTC"),
    ]
    assert (site.node.refused, site.faults) == (
        {},
        ["RECEIVER_ERROR: the receiver on big/B01: robot: NTC"],
    )
    assert "rcu_b01" not in site.node.devices()["site"]


def test_a_station_has_each_fleets_own_name_for_its_place() -> None:
    assert two_brands().places() == PLACES
    stations = dict(settings().stations)
    assert settings(stations=stations).places()["charger_b"] == {"tiny": "dock_b"}

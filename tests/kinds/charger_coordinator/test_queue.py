"""COORDINATOR-2: the queue gives stations to permitted robots only, first come, first served."""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger_coordinator import keep
from bridges.kinds.charger_coordinator.memory import (
    CHARGING,
    ERROR,
    IDLE,
    RELEASED,
    SiteLimits,
    Standing,
    Wish,
)
from bridges.kinds.charger_coordinator.queue import suiting
from bridges.kinds.charger_coordinator.signals import (
    ChargerStateHeard,
    Dedicated,
    FleetSeen,
    Sighting,
)
from bridges.kinds.shared.decision import OperatorReset
from bridges.messages import definitions as d
from tests.kinds.charger_coordinator.alone import (
    ONE,
    SETTINGS,
    THREE,
    TWO,
    A,
    Alone,
    B,
    busy,
)


def test_the_queue_is_first_come_first_served() -> None:
    site_ = Alone()
    site_.shows = {A: busy(A), B: busy(B)}
    for who in (TWO, ONE, THREE):
        site_.wants(who)
        site_.run(1)
    site_.shows[B] = ChargerStateHeard(B, IDLE)
    assert site_.run(1) == [(4.0, "charger_b: AMR02")]


def test_a_station_with_another_robot_on_its_pad_is_not_free() -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.seen[TWO] = Sighting(TWO, False, "charger_a", 90.0, "")
    site_.wants(ONE)
    assert site_.run(10) == []
    site_.seen[TWO] = replace(site_.seen[TWO], place=None)
    assert site_.run(1) == [(11.0, "charger_a: AMR01")]


GONE = (
    "tiny/AMR02 was last seen at charger_a and its fleet says nothing of it (if it is gone, reset)"
)


def silent_at_a() -> Alone:
    """Return a site in which AMR01 waits, and the fleet has fallen silent about AMR02 at charger_a."""
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.hears(FleetSeen((Sighting(TWO, False, "charger_a", 90.0, ""),)))
    site_.wants(ONE)
    return site_


def test_no_other_robot_is_sent_to_the_pad_of_a_robot_whose_fleet_is_silent() -> None:
    site_ = silent_at_a()
    assert site_.run(3600) == []
    assert [GONE in text for text in site_.report.queue] == [True]
    assert any(GONE in fault for fault in site_.faults)
    site_.hears(FleetSeen((Sighting(TWO, False, None, 90.0, ""),)))
    assert site_.run(1) == [(3601.0, "charger_a: AMR01")]


def test_a_restart_of_the_coordinator_does_not_free_the_pad_of_a_robot_whose_fleet_is_silent() -> (
    None
):
    site_ = silent_at_a()
    kept = keep.persist({"site": site_.memory})
    site_.memory = replace(keep.restore(kept, SETTINGS, 0.0)["site"], may_speak=True)
    assert site_.run(600) == []
    assert keep.persist({"site": site_.memory}).count(b"charger_a") == 1
    site_.hears(FleetSeen((Sighting(TWO, False, None, 90.0, ""),)))
    assert site_.run(1) == [(601.0, "charger_a: AMR01")]


def test_a_reset_frees_the_pad_of_a_robot_whose_fleet_is_silent_and_no_other_pad() -> None:
    site_ = silent_at_a()
    site_.run(29)
    site_.hears(OperatorReset())
    assert site_.run(1) == []
    site_.hears(OperatorReset())
    assert site_.run(1) == [(31.0, "charger_a: AMR01")]


def test_a_reset_after_a_restart_frees_the_pad_where_a_robot_of_a_silent_fleet_stood() -> None:
    site_ = silent_at_a()
    kept = keep.persist({"site": site_.memory})
    site_.memory = replace(keep.restore(kept, SETTINGS, 0.0)["site"], may_speak=True)
    assert site_.run(1) == []
    site_.hears(OperatorReset())
    assert site_.run(1) == [(2.0, "charger_a: AMR01")]


@pytest.mark.parametrize("state", [CHARGING, RELEASED])
def test_a_robot_that_charges_without_a_request_may_have_that_station_and_no_released_one(
    state: d.ChargerStateValue,
) -> None:
    site_ = Alone()
    site_.shows = {A: ChargerStateHeard(A, state, "unrequested/charger_a", ONE), B: busy(B)}
    site_.wants(ONE, "charger_a")
    assert site_.run(1) == ([(1.0, "charger_a: AMR01")] if state is CHARGING else [])


def test_beside_a_charging_schedule_a_robot_without_a_dedicated_station_may_have_only_its_place() -> (
    None
):
    memory = replace(Alone().memory, alone=False)
    for place, stations in (("charger_a", [A]), ("wait_1", [])):
        seen = {ONE: Standing(Sighting(ONE, True, place, 40.0, ""), 0.0)}
        at_place = replace(memory, robots=seen)
        assert suiting(at_place, Wish(ONE, "fleet"), 0.0, SiteLimits.of(SETTINGS)) == stations


def test_a_robot_that_stands_at_a_station_gets_that_station() -> None:
    site_ = Alone()
    site_.wants(ONE, "dock_b")
    assert site_.run(1) == [(1.0, "charger_b: AMR01")]


def test_the_place_of_the_robot_comes_before_its_dedicated_station_and_the_yaml_comes_last() -> (
    None
):
    for place, station in (("wait_1", "charger_b"), ("charger_a", "charger_a")):
        site_ = Alone()
        site_.hears(Dedicated(((ONE, B),)))
        site_.wants(ONE, place)
        assert site_.run(1) == [(1.0, f"{station}: AMR01")]


def test_a_robot_that_is_charged_without_a_request_has_that_station() -> None:
    site_ = Alone()
    site_.shows[A] = ChargerStateHeard(A, CHARGING, "unrequested/charger_a")
    site_.wants(ONE, "charger_a")
    assert site_.run(10) == []
    assert site_.memory.station_of(ONE) == A


def test_only_a_robot_that_was_refused_without_a_request_may_get_the_station_at_its_place() -> None:
    for request_id, said in (("unrequested/charger_a", ["charger_a: AMR01"]), ("somebody-1", [])):
        site_ = Alone()
        site_.shows[B] = busy(B)
        text = "wrong docking: tiny/AMR01 is not assigned here"
        site_.shows[A] = ChargerStateHeard(A, ERROR, request_id, ONE, text)
        site_.wants(ONE, "charger_a")
        assert [words for _, words in site_.run(1)] == said


def test_only_the_robot_on_its_pad_may_get_a_station_in_error() -> None:
    site_ = Alone()
    text = "wrong docking: tiny/AMR02 is not assigned here"
    site_.shows = {A: ChargerStateHeard(A, ERROR, "unrequested/charger_a", TWO, text), B: busy(B)}
    site_.wants(ONE)
    assert site_.run(5) == []


def failed_once_at_a() -> Alone:
    """Return a site in which AMR01 waits, and has failed at charger_a."""
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ERROR, "robot: handshake timeout")
    site_.run(1)
    site_.shows[A] = ChargerStateHeard(A, IDLE)
    return site_


def test_a_robot_waits_for_a_station_where_it_has_not_failed() -> None:
    site_ = failed_once_at_a()
    assert site_.run(5) == []
    site_.shows[B] = ChargerStateHeard(B, IDLE)
    assert site_.run(1) == [(8.0, "charger_b: AMR01")]


def test_a_robot_is_tried_again_where_it_failed_while_the_other_station_is_silent() -> None:
    site_ = failed_once_at_a()
    del site_.shows[B]
    assert site_.run(60)[:1] == [(37.0, "charger_a: AMR01")]


@pytest.mark.parametrize("error", ["station: fan", "Charger unreachable", "over temperature"])
def test_a_robot_is_tried_again_where_it_failed_while_the_other_station_is_out_of_service(
    error: str,
) -> None:
    site_ = failed_once_at_a()
    site_.shows[B] = ChargerStateHeard(B, ERROR, "unrequested/charger_b", None, error)
    assert site_.run(60)[:1] == [(33.0, "charger_a: AMR01")]


def test_a_robot_is_tried_again_where_it_failed_while_the_other_station_takes_no_request() -> None:
    site_ = failed_once_at_a()
    site_.shows[B] = ChargerStateHeard(B, IDLE)
    assert [at for at, words in site_.run(20) if words == "charger_a: AMR01"][:1] == [13.0]


def test_a_robot_that_has_failed_waits_while_another_robot_blocks_the_other_station() -> None:
    site_ = failed_once_at_a()
    text = "wrong docking: tiny/AMR02 is not assigned here"
    site_.shows[B] = ChargerStateHeard(B, ERROR, "unrequested/charger_b", TWO, text)
    assert site_.run(60) == []

"""Stories of shared chargers in a simulated yard: the coordinator, a fleet adapter and the chargers'
cores."""

from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.schedule import Charging
from bridges.kinds.shared.decision import OperatorReset
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.transports.transport import Publisher
from tests.kinds.charger_coordinator.virtual_site import Yard, settings


def yard(**changes: object) -> Yard:
    """Return a simulated charging yard in which everything runs, and no robot wants to charge yet."""
    found = Yard(**changes)  # type: ignore[arg-type]
    assert found.run(5.0) == [
        (0.25, "charger_a: IDLE"),
        (0.25, "charger_b: IDLE"),
        (3.0, "AMR01 -> WAIT wait_1"),
        (3.0, "AMR02 -> WAIT wait_2"),
        (3.0, "AMR03 -> WAIT wait_3"),
    ]
    return found


def test_a_scheduled_robot_is_called_and_charged_and_sent_on() -> None:
    site = yard()
    site.fleet.charge("AMR01", site.now)
    assert site.run(30.0) == [
        (7.25, "charger_a <- charge AMR01"),
        (7.25, "charger_a: ASSIGNED AMR01"),
        (7.25, "AMR01 -> CHARGE charger_a"),
        (13.25, "charger_a: CHARGING AMR01"),
        (25.5, "charger_a: RELEASED AMR01"),
        (25.5, "AMR01 -> WAIT wait_1"),
    ]
    site.fleet.works("AMR01", "ward", site.now)
    assert site.run(40.0) == [(30.25, "charger_a: IDLE")]
    assert site.faults == []
    assert site.assignments == 3, "a repeated assignment would restart tasks"


def test_an_operator_has_the_robot_on_the_pad_charged_ad_hoc() -> None:
    site = yard()
    robot = site.fleet.robots["AMR01"]
    robot.place = robot.dedicated = "charger_a"
    robot.doing, robot.task_id, robot.battery_percent = "work", "work-1", 40.0
    site.run(6.75)
    site.wants("AMR01")
    assert site.run(30.0) == [
        (6.75, "charger_a <- charge AMR01"),
        (6.75, "charger_a: ASSIGNED AMR01"),
        (6.75, "AMR01 -> CHARGE charger_a"),
        (8.75, "charger_a: CHARGING AMR01"),
        (21.0, "charger_a: RELEASED AMR01"),
        (21.0, "AMR01 -> WAIT wait_1"),
    ]


def test_stacked_robots_go_to_both_stations_and_the_third_waits_until_it_is_called() -> None:
    site = yard()
    site.fleet.charge("AMR01", site.now)
    site.run(6.0)
    site.fleet.charge("AMR02", site.now)
    site.run(8.0)
    site.fleet.charge("AMR03", site.now)
    assert site.story[5:] == [
        (7.25, "charger_a <- charge AMR01"),
        (7.25, "charger_a: ASSIGNED AMR01"),
        (7.25, "AMR01 -> CHARGE charger_a"),
    ]
    assert site.run(34.0) == [
        (8.25, "charger_b <- charge AMR02"),
        (8.25, "charger_b: ASSIGNED AMR02"),
        (8.25, "AMR02 -> CHARGE dock_b"),
        (13.25, "charger_a: CHARGING AMR01"),
        (14.25, "charger_b: CHARGING AMR02"),
        (25.5, "charger_a: RELEASED AMR01"),
        (25.5, "AMR01 -> WAIT wait_1"),
        (26.5, "charger_b: RELEASED AMR02"),
        (26.5, "AMR02 -> WAIT wait_2"),
    ]
    site.fleet.works("AMR02", "ward", site.now)
    assert site.run(42.0) == [
        (34.25, "charger_b: IDLE"),
        (34.25, "charger_b <- charge AMR03"),
        (34.25, "charger_b: ASSIGNED AMR03"),
        (34.25, "AMR03 -> CHARGE dock_b"),
        (40.25, "charger_b: CHARGING AMR03"),
    ]


def test_a_robot_that_does_not_leave_the_wrong_station_is_nudged_twice_before_a_person_is_told() -> (
    None
):
    site = yard()
    site.fleet.charge("AMR01", site.now)
    site.run(8.5)
    robot = site.fleet.robots["AMR01"]
    robot.goes_to, robot.stuck = "dock_b", True
    assert site.run(50.0) == [
        (11.25, "charger_b: ERROR AMR01 (wrong docking: tiny/AMR01 is not assigned here)"),
        (11.25, "AMR01 -> WAIT wait_1"),
        (12.25, "AMR01 -> CHARGE charger_a"),
        (26.25, "AMR01 -> WAIT wait_1"),
        (27.25, "AMR01 -> CHARGE charger_a"),
        (
            41.25,
            "ALERT WRONG_STATION: tiny/AMR01 stands at charger_b, but is expected at charger_a",
        ),
    ]
    assert site.mode("charger_a") == "ASSIGNED"
    robot.stuck = False
    site.fleet.works("AMR01", "charger_a", site.now)
    robot.task_id = "Charge0"
    assert site.run(60.0) == [(50.25, "charger_b: IDLE"), (56.0, "charger_a: CHARGING AMR01")]
    assert site.faults == []


def test_a_robot_at_the_wrong_station_may_stay_once_the_request_has_timed_out() -> None:
    site = yard()
    site.fleet.charge("AMR01", site.now)
    site.run(8.5)
    robot = site.fleet.robots["AMR01"]
    robot.goes_to, robot.stuck = "dock_b", True
    site.run(42.0)
    assert site.run(70.0) == [
        (67.25, "charger_a: RELEASED AMR01"),
        (67.25, "charger_b <- charge AMR01"),
        (67.25, "charger_b: ASSIGNED AMR01"),
        (67.25, "AMR01 -> CHARGE dock_b"),
        (68.25, "charger_a: IDLE"),
        (69.25, "charger_b: CHARGING AMR01"),
    ]


def test_a_failed_station_is_out_of_service_and_its_robot_goes_to_another() -> None:
    site = yard()
    a = site.chargers["charger_a"]
    a.broken = True
    site.fleet.charge("AMR01", site.now)
    assert site.run(30.0) == [
        (7.25, "charger_a <- charge AMR01"),
        (7.25, "charger_a: ASSIGNED AMR01"),
        (7.25, "AMR01 -> CHARGE charger_a"),
        (13.5, "charger_a: ERROR AMR01 (station: over temperature)"),
        (13.5, "charger_a <- cancel"),
        (13.5, "charger_b <- charge AMR01"),
        (13.5, "charger_b: ASSIGNED AMR01"),
        (13.5, "AMR01 -> CHARGE dock_b"),
        (13.5, "ALERT STATION_OUT_OF_SERVICE: charger_a: station: over temperature"),
        (19.5, "charger_b: CHARGING AMR01"),
    ]
    site.fleet.charge("AMR02", site.now)
    assert site.run(31.0) == []
    assert site.run(50.0) == [
        (31.75, "charger_b: RELEASED AMR01"),
        (31.75, "AMR01 -> WAIT wait_1"),
    ]
    a.broken = False
    a.decide(OperatorReset(), site.now)
    assert site.run(60.0) == [
        (50.25, "charger_a: IDLE"),
        (50.25, "charger_a <- charge AMR02"),
        (50.25, "charger_a: ASSIGNED AMR02"),
        (50.25, "AMR02 -> CHARGE charger_a"),
        (56.25, "charger_a: CHARGING AMR02"),
    ]
    assert site.faults == []


def test_a_robot_that_fails_at_a_second_station_is_not_tried_a_third_time() -> None:
    site = yard()
    for station in site.chargers.values():
        station.refuses = {"RX-1"}
    site.fleet.charge("AMR01", site.now)
    faulty = "ROBOT_FAULTY: tiny/AMR01 failed at charger_a and at charger_b: not tried again"
    assert site.run(60.0) == [
        (7.25, "charger_a <- charge AMR01"),
        (7.25, "charger_a: ASSIGNED AMR01"),
        (7.25, "AMR01 -> CHARGE charger_a"),
        (13.5, "charger_a: ERROR AMR01 (robot: authentication timeout)"),
        (13.5, "charger_a <- cancel"),
        (13.5, "charger_b <- charge AMR01"),
        (13.5, "charger_b: ASSIGNED AMR01"),
        (13.5, "AMR01 -> CHARGE dock_b"),
        (13.75, "charger_a: RELEASED AMR01"),
        (14.5, "charger_a: IDLE"),
        (19.75, "charger_b: ERROR AMR01 (robot: authentication timeout)"),
        (19.75, "charger_b <- cancel"),
        (19.75, "AMR01 -> WAIT wait_1"),
        (19.75, f"ALERT {faulty}"),
        (20.0, "charger_b: RELEASED AMR01"),
        (20.75, "charger_b: IDLE"),
    ]
    assert site.faults == [faulty]
    site.chargers["charger_a"].refuses = set()
    site.coordinator.reset()
    assert site.run(75.0) == [
        (60.25, "charger_a <- charge AMR01"),
        (60.25, "charger_a: ASSIGNED AMR01"),
        (60.25, "AMR01 -> CHARGE charger_a"),
        (66.25, "charger_a: CHARGING AMR01"),
    ]
    assert site.faults == []


# ---- COORDINATOR-6, COORDINATOR-7, COORDINATOR-STATIONS-1: restarts and rivals


def test_a_charge_that_ended_while_the_coordinator_was_away_is_not_requested_again() -> None:
    site = Yard(site=settings(start_timeout_s=300.0), finishing="nothing")
    site.run(5.0)
    site.wants("AMR01")
    site.fleet.strays("AMR01", "charger_a", site.now)
    site.fleet.robots["AMR01"].battery_percent = 60.0
    site.run(14.0)
    assert site.mode("charger_a") == "CHARGING"
    site.coordinator.leave()
    site.run(25.0)
    site.fleet.works("AMR01", "ward", site.now)
    site.run(40.0)
    site.coordinator.restart()
    site.run(100.0)
    assert (site.mode("charger_b"), site.faults) == ("IDLE", [])


def test_a_restart_keeps_the_queue_and_touches_no_charge_under_way() -> None:
    site = yard(fills=1.0)
    for who in ("AMR01", "AMR02", "AMR03"):
        site.fleet.charge(who, site.now)
    site.run(14.0)
    site.coordinator.leave()
    site.run(40.0)
    site.coordinator.restart()
    assert site.run(70.0) == []
    assert [site.mode(name) for name in site.chargers] == ["CHARGING", "CHARGING"]
    site.fleet.works("AMR02", "ward", site.now)
    assert site.run(72.0) == [
        (70.25, "charger_b: RELEASED AMR02"),
        (70.25, "charger_b <- cancel"),
        (70.25, "AMR02 -> WAIT wait_2"),
        (71.25, "charger_b: IDLE"),
        (71.25, "charger_b <- charge AMR03"),
        (71.25, "charger_b: ASSIGNED AMR03"),
        (71.25, "AMR03 -> CHARGE dock_b"),
    ]


def charges_at_a(*, by_operator: bool, knows: bool) -> Yard:
    """Return a yard at 14 s, while AMR01 charges at charger_a.

    The battery is then at 60 %, or at 65 % if an operator sent the request.
    """
    site = yard(fills=1.0, knows=knows)
    if by_operator:
        site.wants("AMR01")
        site.fleet.strays("AMR01", "charger_a", site.now)
        site.fleet.robots["AMR01"].battery_percent = 60.0
    else:
        site.fleet.charge("AMR01", site.now, 60.0)
    site.run(14.0)
    assert site.mode("charger_a") == "CHARGING"
    return site


AGAIN: Any = [(16.25, "charger_a: ASSIGNED AMR01"), (18.25, "charger_a: CHARGING AMR01")]
"""The last events of a story: after its restart the station gets a request again, and charges."""
REFUSED = (16.25, "charger_a: ERROR AMR01 (wrong docking: tiny/AMR01 is not assigned here)")


@pytest.mark.parametrize("by_operator", [False, True])
@pytest.mark.parametrize(
    ("knows", "switched_off", "history"),
    [
        (True, True, [REFUSED, *AGAIN]),
        (True, False, []),
        (False, True, [(16.25, "charger_a: IDLE"), *AGAIN]),
        (False, False, [(16.25, "charger_a: CHARGING")]),
    ],
)
def test_after_a_restart_of_the_chargers_daemon_a_robot_is_charged_to_the_end(
    knows: bool, switched_off: bool, history: list[tuple[float, str]], by_operator: bool
) -> None:
    site = charges_at_a(by_operator=by_operator, knows=knows)
    site.chargers["charger_a"].dead = True
    site.run(16.0)
    site.chargers["charger_a"].restarts(site.now, switched_off)
    assert site.run(30.0) == history
    assert site.faults == []
    site.run(70.0)
    assert site.fleet.robots["AMR01"].battery_percent == 100.0


@pytest.mark.parametrize("by_operator", [False, True])
def test_a_charge_that_is_requested_during_the_power_down_begins_again(
    by_operator: bool,
) -> None:
    site = charges_at_a(by_operator=by_operator, knows=True)
    site.chargers["charger_a"].restarts(site.now, switched_off=False)
    site.run(14.5)
    site.chargers["charger_a"].stops()
    assert site.run(30.0) == [
        (14.75, "charger_a: RELEASED AMR01"),
        (14.75, "charger_a <- charge AMR01"),
        (15.75, "charger_a: ASSIGNED AMR01"),
        (17.75, "charger_a: CHARGING AMR01"),
    ]
    assert site.faults == []


@pytest.mark.parametrize("by_operator", [False, True])
def test_a_robot_on_its_way_keeps_the_charger_whose_daemon_restarts(by_operator: bool) -> None:
    site = yard()
    if by_operator:
        site.wants("AMR01")
    else:
        site.fleet.charge("AMR01", site.now)
    site.run(8.0)
    assert site.mode("charger_a") == "ASSIGNED"
    site.chargers["charger_a"].restarts(site.now)
    assert site.run(9.0) == [(8.25, "charger_a: IDLE"), (8.25, "charger_a: ASSIGNED AMR01")]
    assert site.faults == []


def test_a_charge_forgotten_by_daemon_and_coordinator_is_requested_and_goes_on() -> None:
    for stops_at in (16.5, None):
        site = charges_at_a(by_operator=False, knows=True)
        site.chargers["charger_a"].restarts(site.now, switched_off=False)
        site.coordinator.leave()
        site.disk.kept = None
        site.coordinator.restart()
        if stops_at:
            site.run(stops_at)
            site.chargers["charger_a"].stops()
        site.run(70.0)
        assert site.fleet.robots["AMR01"].battery_percent == 100.0
        assert site.faults == []


def test_a_coordinator_without_memory_takes_over_the_requests_that_the_stations_show() -> None:
    site = yard(fills=1.0)
    site.fleet.charge("AMR01", site.now)
    site.run(14.0)
    site.coordinator.leave()
    site.disk.kept = None
    site.coordinator.restart()
    assert site.run(40.0) == []
    assert site.assigned == {
        "AMR01": "CHARGE charger_a",
        "AMR02": "WAIT wait_2",
        "AMR03": "WAIT wait_3",
    }


def dedicate(site: Yard, **places: str) -> Publisher[Any]:
    """Publish ChargingAssignments, RMF's charging schedule, which sends each robot to its place.

    If the name of the place begins with `wait`, the robot only waits there. Otherwise the robot charges
    there.
    """
    schedule: Publisher[Any] = site.rmf.publisher(topics.CHARGING_ASSIGNMENTS)
    modes = {who: int(place.startswith("wait")) for who, place in places.items()}
    told = tuple(d.ChargingAssignment(who, place, modes[who]) for who, place in places.items())
    schedule.publish(d.ChargingAssignments("tiny", told))
    return schedule


def test_beside_the_charging_schedule_of_rmf_its_dedicated_stations_get_requests() -> None:
    site = yard()
    schedule = dedicate(site, AMR01="dock_b", AMR02="wait_2")
    site.run(6.0)
    site.story.clear()
    for who in ("AMR01", "AMR02"):
        site.fleet.charge(who, site.now)
    assert site.run(30.0) == [
        (10.0, "charger_b: ERROR AMR01 (wrong docking: tiny/AMR01 is not assigned here)"),
        (12.25, "charger_b <- charge AMR01"),
        (12.25, "charger_b: ASSIGNED AMR01"),
        (14.25, "charger_b: CHARGING AMR01"),
        (26.5, "charger_b: RELEASED AMR01"),
    ]
    status = site.node.devices()["site"]
    assert site.node.status()["passive"] is False
    assert status["assigns"] == "no: another node publishes charging_assignments"
    assert status["queue"] == (
        "tiny/AMR02 by the robot: the charging schedule has no station for this robot"
    )
    again = dedicate(site, AMR02="charger_a")
    assert site.run(40.0) == [
        (30.0, "AMR02 -> CHARGE charger_a"),
        (30.0, "charger_a <- charge AMR02"),
        (30.0, "charger_a: ASSIGNED AMR02"),
        (36.0, "charger_a: CHARGING AMR02"),
    ]
    for end in (schedule, again):
        end.close()


def test_beside_the_charging_schedule_of_rmf_our_schedule_ends_no_charge() -> None:
    site = yard(site=settings(schedule=[Charging(at="22:00", until="23:00")]))
    schedule = dedicate(site, AMR01="charger_a")
    site.run(6.0)
    site.story.clear()
    site.fleet.charge("AMR01", site.now, 93.0)
    assert site.run(300.0) == [
        (10.0, "charger_a: ERROR AMR01 (wrong docking: tiny/AMR01 is not assigned here)"),
        (12.25, "charger_a <- charge AMR01"),
        (12.25, "charger_a: ASSIGNED AMR01"),
        (14.25, "charger_a: CHARGING AMR01"),
        (16.0, "charger_a: RELEASED AMR01"),
    ]
    schedule.close()


def test_a_station_is_taken_back_if_the_schedule_sends_the_robot_elsewhere_on_its_way() -> None:
    """RMF drives a robot only to its dedicated station."""
    site = yard()
    schedule = dedicate(site, AMR01="dock_b")
    site.run(20.0)
    site.fleet.charge("AMR01", site.now)
    site.run(27.0)
    again = dedicate(site, AMR01="charger_a")
    then = [what for _, what in site.run(40.0)]
    assert then == [
        "AMR01 -> CHARGE charger_a",
        "charger_b <- cancel",
        "charger_b: RELEASED AMR01",
        "charger_a <- charge AMR01",
        "charger_a: ASSIGNED AMR01",
        "charger_b: IDLE",
        "charger_a: CHARGING AMR01",
    ]
    for end in (schedule, again):
        end.close()


def test_the_choice_of_a_charging_schedule_outlives_the_schedule() -> None:
    site = yard()
    schedule = dedicate(site, AMR01="dock_b")
    site.fleet.robots["AMR01"].dedicated = "wait_1"
    site.run(20.0)
    schedule.close()
    site.run(30.0)
    site.fleet.charge("AMR01", site.now)
    told = [what for _, what in site.run(60.0)]
    assert told == [
        "charger_b <- charge AMR01",
        "charger_b: ASSIGNED AMR01",
        "AMR01 -> CHARGE dock_b",
        "charger_b: CHARGING AMR01",
        "charger_b: RELEASED AMR01",
        "AMR01 -> WAIT wait_1",
    ]


def test_of_two_coordinators_one_serves_and_the_other_only_listens() -> None:
    site = yard()
    other = site.serves("other").node
    site.run(25.0)
    assert (site.node.status()["passive"], other.status()["passive"]) == (False, True)


# ---- COORDINATOR-3, COORDINATOR-STATIONS-4: unreachable stations


def test_a_charge_goes_on_at_an_unreachable_station() -> None:
    site = yard(fills=1.0)
    site.fleet.charge("AMR01", site.now)
    site.run(20.0)
    site.chargers["charger_a"].unplugged = True
    assert site.run(60.0) == [
        (20.75, "charger_a: ERROR AMR01 (Charger unreachable)"),
        (20.75, "ALERT STATION_OUT_OF_SERVICE: charger_a: Charger unreachable"),
    ]
    site.chargers["charger_a"].unplugged = False
    assert site.run(70.0) == [(60.25, "charger_a: CHARGING AMR01")]


def test_a_robot_that_has_left_a_dead_charger_for_a_task_is_charged_at_another() -> None:
    site = charges_at_a(by_operator=True, knows=True)
    site.chargers["charger_a"].dead = True
    site.fleet.works("AMR01", "ward", site.now)
    site.run(300.0)
    site.fleet.charge("AMR01", site.now, 20.0)
    assert site.run(330.0) == [
        (306.25, "charger_b <- charge AMR01"),
        (306.25, "charger_b: ASSIGNED AMR01"),
        (306.25, "AMR01 -> CHARGE dock_b"),
        (312.25, "charger_b: CHARGING AMR01"),
    ]


def test_a_robot_on_its_way_to_a_station_that_falls_silent_is_sent_to_another() -> None:
    site = yard(drive_s=50.0)
    site.fleet.charge("AMR01", site.now)
    site.run(10.0)
    site.chargers["charger_a"].dead = True
    assert site.run(50.0) == [
        (14.25, "ALERT STATION_SILENT: charger_a: no ChargerState comes"),
        (44.25, "charger_a <- cancel"),
        (44.25, "charger_b <- charge AMR01"),
        (44.25, "charger_b: ASSIGNED AMR01"),
        (44.25, "AMR01 -> CHARGE dock_b"),
    ]
    site.chargers["charger_a"].dead = False
    assert site.run(53.0) == [
        (50.25, "charger_a: RELEASED AMR01"),
        (51.25, "charger_a: IDLE"),
    ]


def test_a_station_whose_daemon_takes_no_request_is_passed_over() -> None:
    site = yard(drive_s=20.0)
    a = site.chargers["charger_a"]
    a.limits = replace(a.limits, receivers={"RX-9": RobotName("other", "robot")})
    site.fleet.charge("AMR01", site.now)
    assert site.run(18.0) == [
        (7.25, "charger_a <- charge AMR01"),
        (7.25, "AMR01 -> CHARGE charger_a"),
        (17.25, "charger_b <- charge AMR01"),
        (17.25, "charger_b: ASSIGNED AMR01"),
        (17.25, "AMR01 -> CHARGE dock_b"),
        (17.25, "ALERT REQUEST_NOT_TAKEN: charger_a: its daemon's log says why"),
    ]


# ---- COORDINATOR-1, COORDINATOR-6: operators


def test_a_withdrawn_request_of_an_operator_is_not_started_by_repeats() -> None:
    site = yard()
    site.wants("AMR01", "charger_b")
    site.wants("AMR01", "charger_b")
    assert site.run(8.0) == [
        (5.0, "charger_b <- charge AMR01"),
        (5.0, "charger_b: ASSIGNED AMR01"),
        (5.0, "AMR01 -> CHARGE dock_b"),
    ]
    site.withdrawals.publish(d.ChargerCancel("", "op-1"))
    told = [what for _, what in site.run(12.0)]
    assert told == [
        "charger_b <- cancel",
        "charger_b: RELEASED AMR01",
        "AMR01 -> WAIT wait_1",
        "charger_b: IDLE",
    ]
    site.wants("AMR01", "charger_b")
    assert site.run(15.0) == []
    assert site.node.refused == {"request is over": 1}


def test_a_request_sent_directly_to_a_charger_gives_that_robot_its_place() -> None:
    site = yard()
    request = d.ChargerRequest("charger_b", "tiny", "AMR02", d.Duration(60, 0), "somebody-1")
    site.rmf.publisher(topics.CHARGER_REQUESTS).publish(request)
    site.fleet.charge("AMR03", site.now)
    told = [what for _, what in site.run(15.0)]
    assert told == [
        "charger_b <- charge AMR02",
        "charger_b: ASSIGNED AMR02",
        "AMR02 -> CHARGE dock_b",
    ]
    queue = site.node.devices()["site"]["queue"]
    assert (site.node.status()["passive"], queue) == (
        False,
        "tiny/AMR03 by the robot: charger_b is assigned to tiny/AMR02",
    )

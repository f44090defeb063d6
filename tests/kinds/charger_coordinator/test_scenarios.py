"""The numbered charging scenarios, with every `finishing_request`. Some tests let RMF send a robot to a
charger because its battery is low.

The simulated fleet reports its robots as RMF's adapter does (`workbench/rmf_model/fleet.py`). A robot
that charges because of its finishing request is reported as IDLE and without a task. After its first
charge a robot is reported with the mode CHARGING in every task.
"""

from typing import Final

import pytest

from bridges.kinds.charger_coordinator.schedule import Charging
from bridges.kinds.shared.decision import OperatorReset
from bridges.messages import definitions as d
from tests.kinds.charger_coordinator.virtual_site import Yard, settings
from workbench.rmf_model.fleet import Finishing

FINISHING: Final[tuple[Finishing, ...]] = ("charge", "park", "nothing")
EACH: Final = pytest.mark.parametrize("finishing", FINISHING)
History = list[tuple[float, str]]


def yard(finishing: Finishing, **changes: object) -> Yard:
    """Return a simulated charging yard in which each robot stands at its waiting place with a full
    battery."""
    site = Yard(finishing=finishing, **changes)  # type: ignore[arg-type]
    site.run(5.0)
    return site


def home_from_work(finishing: Finishing, percent: float, jazzy: bool = False) -> Yard:
    """Return a yard in which AMR01 has just ended a task in the ward. Its battery is at `percent`."""
    site = yard(finishing, jazzy=jazzy)
    site.fleet.works("AMR01", "ward", site.now)
    site.run(10.0)
    site.fleet.robots["AMR01"].battery_percent = percent
    site.fleet.rests("AMR01", site.now)
    return site


def charged_at_a(told_at: float, full_at: float, drives_s: float = 6.0) -> History:
    """Return the events (s, text) of a charge: the coordinator calls AMR01 to charger_a, and AMR01
    charges."""
    return [
        (told_at, "charger_a <- charge AMR01"),
        (told_at, "charger_a: ASSIGNED AMR01"),
        (told_at, "AMR01 -> CHARGE charger_a"),
        (told_at + drives_s, "charger_a: CHARGING AMR01"),
        (full_at, "charger_a: RELEASED AMR01"),
        (full_at, "AMR01 -> WAIT wait_1"),
    ]


CALLED_IN_VAIN: Final = [
    (16.25, "charger_a <- charge AMR01"),
    (16.25, "charger_a: ASSIGNED AMR01"),
    (16.25, "AMR01 -> CHARGE charger_a"),
    (76.25, "charger_a: RELEASED AMR01"),
    (76.25, "charger_a <- cancel"),
    (76.25, "AMR01 -> WAIT wait_1"),
    (77.25, "charger_a: IDLE"),
]

# ---- 0: which robots want to charge


@pytest.mark.parametrize(
    ("finishing", "history", "place", "percent"),
    [
        ("charge", [*charged_at_a(16.25, 30.5), (31.5, "charger_a: IDLE")], "wait_1", 100.0),
        ("park", CALLED_IN_VAIN, "wait_1", 60.0),
        ("nothing", [], "ward", 60.0),
    ],
)
def test_0_a_robot_without_a_task_is_served_if_its_finishing_request_brings_it(
    finishing: Finishing, history: History, place: str, percent: float
) -> None:
    site = home_from_work(finishing, 60.0)
    assert site.run(300.0) == history
    robot = site.fleet.robots["AMR01"]
    assert (robot.place, robot.battery_percent, site.faults) == (place, percent, [])


def test_0_a_robot_whose_adapter_starts_again_on_its_way_is_told_again() -> None:
    site = home_from_work("charge", 60.0)
    site.run(17.0)
    site.fleet.starts_again(site.now)
    assert site.run(60.0) == [
        (37.25, "charger_a: CHARGING AMR01"),
        (45.5, "charger_a: RELEASED AMR01"),
        (45.5, "AMR01 -> WAIT wait_1"),
        (46.5, "charger_a: IDLE"),
    ]
    assert site.faults == []


@pytest.mark.parametrize("starts_at", [12.0, 20.0, 40.0])
@pytest.mark.parametrize("known", [False, True])
def test_0_a_robot_that_was_called_before_its_adapter_started_is_told_again(
    known: bool, starts_at: float
) -> None:
    site = Yard(finishing="charge")
    site.adapters = [site.fleet] if known else []
    site.run(5.0)
    site.adapters = []
    site.wants("AMR01")
    site.run(starts_at)
    site.adapters = [site.fleet]
    site.fleet.robots["AMR01"].battery_percent = 60.0
    site.run(starts_at + 0.5)
    site.fleet.starts_again(site.now)
    site.run(starts_at + 22.0)
    assert site.mode("charger_a") == "CHARGING"


def test_0_in_jazzy_park_goes_to_the_dedicated_charger_as_charge_does() -> None:
    site = home_from_work("park", 60.0, jazzy=True)
    assert site.run(300.0) == [*charged_at_a(16.25, 30.5), (31.5, "charger_a: IDLE")]
    robot = site.fleet.robots["AMR01"]
    assert (robot.place, robot.battery_percent, site.faults) == ("wait_1", 100.0, [])


@pytest.mark.parametrize(
    ("finishing", "history"),
    [
        ("charge", [*charged_at_a(16.25, 40.5), (41.5, "charger_a: IDLE")]),
        ("park", [*charged_at_a(16.25, 44.5, 10.0), (45.5, "charger_a: IDLE")]),
        ("nothing", charged_at_a(26.25, 50.5)),
    ],
)
def test_0_every_robot_that_rmf_lets_retreat_is_served(
    finishing: Finishing, history: History
) -> None:
    site = home_from_work(finishing, 60.0)
    told = site.run(20.0)
    site.fleet.robots["AMR01"].battery_percent = 10.0
    assert told + site.run(300.0) == history
    assert site.faults == []


def test_0_jazzy_lets_no_robot_retreat_that_is_below_the_recharge_threshold() -> None:
    site = home_from_work("nothing", 11.0, jazzy=True)
    assert site.run(60.0)[0] == (16.25, "charger_a <- charge AMR01")
    late = home_from_work("nothing", 9.0, jazzy=True)
    assert (late.run(60.0), late.fleet.robots["AMR01"].place) == ([], "ward")


@EACH
def test_0_a_full_robot_that_waits_for_traffic_on_its_pad_is_not_served_again(
    finishing: Finishing,
) -> None:
    site = yard(finishing)
    site.fleet.charge("AMR01", site.now)
    site.run(25.5)
    robot = site.fleet.robots["AMR01"]
    robot.place, robot.goes_to, robot.stuck = "charger_a", "", True
    site.fleet.works("AMR01", "ward", site.now)
    robot.battery_percent = 99.0
    assert site.run(120.0) == []
    robot.battery_percent = 89.0
    assert site.run(125.0) == [], "a patrol counts as a wish to charge"
    robot.task_id = "somebody's task"
    assert site.run(130.0)[0] == (127.25, "charger_a <- charge AMR01")


@pytest.mark.parametrize("knows", [True, False])
def test_0_a_robot_that_stays_on_its_pad_is_charged_again_there(
    knows: bool,
) -> None:
    site = yard("nothing", knows=knows)
    site.fleet.charge("AMR03", site.now, 60.0)
    site.run(60.0)
    site.fleet.robots["AMR03"].battery_percent = 50.0
    assert site.run(73.0)[:5] == [
        (60.25, "charger_b <- charge AMR03"),
        (60.25, "charger_b: ASSIGNED AMR03"),
        (60.25, "AMR03 -> CHARGE dock_b"),
        (62.25, "charger_b: CHARGING AMR03"),
        (72.5, "charger_b: RELEASED AMR03"),
    ]


@EACH
def test_0_a_robot_that_stops_at_its_place_on_a_patrol_does_not_ask(finishing: Finishing) -> None:
    site = yard(finishing)
    robot = site.fleet.robots["AMR01"]
    robot.mode, robot.battery_percent = d.RobotModeValue.MODE_CHARGING, 50.0
    site.fleet.works("AMR01", "wait_1", site.now)
    assert site.run(60.0) == []
    site.fleet.charge("AMR01", site.now, 50.0)
    assert site.run(63.0)[0] == (62.25, "charger_a <- charge AMR01")


def test_0_a_patrol_that_begins_at_the_call_is_not_the_drive_to_the_charger() -> None:
    site = home_from_work("charge", 60.0)
    site.run(17.0)
    site.fleet.works("AMR01", "ward", site.now)
    assert site.run(30.0) == [
        (17.25, "charger_a <- cancel"),
        (17.25, "charger_a: RELEASED AMR01"),
        (17.25, "AMR01 -> WAIT wait_1"),
        (18.25, "charger_a: IDLE"),
    ]


@EACH
def test_0_a_robot_that_does_not_come_gives_way_at_once_and_is_called_again_later(
    finishing: Finishing,
) -> None:
    site = yard(finishing)
    robot = site.fleet.robots["AMR01"]
    robot.battery_percent, robot.stuck = 60.0, True
    called = [at for at, what in site.run(1500.0) if what == "charger_a <- charge AMR01"]
    assert called == [5.25, 665.25, 1325.25]
    assert site.node.devices()["site"]["queue"] == "-"
    site.run(1560.0)
    assert site.node.devices()["site"]["did not come"] == "tiny/AMR01"


# ---- 1: a charge that the schedule begins


@EACH
def test_1_the_schedule_calls_its_robots_and_is_shown(finishing: Finishing) -> None:
    night = Charging(at="13:47", until="13:50", robots=["tiny/AMR01"], percent=95.0)
    site = yard(finishing, site=settings(schedule=[night], timezone="UTC"))
    for who in ("AMR01", "AMR02"):
        site.fleet.robots[who].battery_percent = 92.0
    told = site.run(25.0)
    assert told == [
        (20.25, "charger_a <- charge AMR01"),
        (20.25, "charger_a: ASSIGNED AMR01"),
        (20.25, "AMR01 -> CHARGE charger_a"),
    ]
    status = site.node.devices()["site"]
    assert (status["schedule"], status["charger_a"]) == (
        "13:47-13:50 tiny/AMR01 to 95 %: under way",
        "ASSIGNED tiny/AMR01, by the schedule",
    )
    told = site.run(400.0)
    status = site.node.devices()["site"]
    assert status["schedule"] == "13:47-13:50 tiny/AMR01 to 95 %: not now"
    if finishing == "charge":
        assert told == [
            (26.25, "charger_a: CHARGING AMR01"),
            (27.25, "charger_a <- cancel"),
            (27.25, "AMR01 -> WAIT wait_1"),
            (27.5, "charger_a: RELEASED AMR01"),
            (28.5, "charger_a: IDLE"),
        ]
    else:  # with this finishing_request RMF moves a robot only in a task
        assert told == [(at + 4.0, what) for at, what in CALLED_IN_VAIN[3:]]


# ---- 2: ad-hoc, by the robot and by an operator


@EACH
def test_2_the_wish_of_a_robot_and_the_wish_of_an_operator_are_shown_apart(
    finishing: Finishing,
) -> None:
    site = yard(finishing)
    site.fleet.charge("AMR01", site.now)
    site.wants("AMR03")
    site.run(8.0)
    status = site.node.devices()["site"]
    assert (status["charger_a"], status["charger_b"]) == (
        "ASSIGNED tiny/AMR01, by the robot",
        "ASSIGNED tiny/AMR03, by an operator",
    )


# ---- 3: stacked: more robots than stations


def three_at_two(finishing: Finishing) -> Yard:
    """Return a yard in which AMR01 and AMR03 charge at the two stations. AMR02 waits for a free
    station."""
    site = yard(finishing)
    for who in ("AMR03", "AMR01", "AMR02"):
        site.fleet.charge(who, site.now)
        site.run(site.now + 1.0)
    assert site.run(25.0)[-2:] == [
        (13.25, "charger_b: CHARGING AMR03"),
        (14.25, "charger_a: CHARGING AMR01"),
    ]
    return site


@pytest.mark.parametrize("finishing", ["charge", "park"])
def test_3_a_finished_robot_is_sent_to_its_place_and_the_next_robot_is_called(
    finishing: Finishing,
) -> None:
    site = three_at_two(finishing)
    assert site.run(35.0) == [
        (25.5, "charger_b: RELEASED AMR03"),
        (25.5, "AMR03 -> WAIT wait_3"),
        (26.5, "charger_a: RELEASED AMR01"),
        (26.5, "charger_b: IDLE"),
        (26.5, "AMR01 -> WAIT wait_1"),
        (26.5, "charger_b <- charge AMR02"),
        (26.5, "charger_b: ASSIGNED AMR02"),
        (26.5, "AMR02 -> CHARGE dock_b"),
        (27.5, "charger_a: IDLE"),
        (32.5, "charger_b: CHARGING AMR02"),
    ]
    assert site.faults == []


def test_3_an_alert_names_a_finished_robot_that_stays_and_the_robot_that_it_blocks() -> None:
    site = three_at_two("nothing")
    why = "RMF moves this robot only with a charging task (as with finishing_request: charge)"
    assert site.run(110.0) == [
        (25.5, "charger_b: RELEASED AMR03"),
        (25.5, "AMR03 -> WAIT wait_3"),
        (26.5, "charger_a: RELEASED AMR01"),
        (26.5, "AMR01 -> WAIT wait_1"),
        (85.5, "AMR03 -> CHARGE wait_3"),
        (86.5, "AMR01 -> CHARGE wait_1"),
        (86.5, "AMR03 -> WAIT wait_3"),
        (87.5, "AMR01 -> WAIT wait_1"),
        (
            100.5,
            "ALERT PAD_BLOCKED: tiny/AMR03 stands at charger_b,"
            f" and tiny/AMR02 waits for that station: {why}",
        ),
        (
            101.5,
            "ALERT PAD_BLOCKED: tiny/AMR01 stands at charger_a,"
            f" and tiny/AMR02 waits for that station: {why}",
        ),
    ]
    assert site.node.devices()["site"]["queue"] == (
        "tiny/AMR02 by the robot: tiny/AMR01 stands at charger_a, tiny/AMR03 stands at charger_b"
    )
    site.fleet.works("AMR01", "ward", site.now)
    assert site.run(112.0)[:2] == [
        (110.25, "charger_a: IDLE"),
        (110.25, "charger_a <- charge AMR02"),
    ]
    assert site.faults == []


def test_3_a_robot_in_its_charging_task_leaves_the_pad_for_which_another_robot_waits() -> None:
    site = yard("charge")
    site.fleet.charge("AMR03", site.now)
    site.run(20.0)
    site.chargers["charger_a"].unplugged = True
    site.fleet.robots["AMR03"].stuck = True
    site.fleet.charge("AMR01", site.now)
    assert site.run(85.0)[-2:] == [
        (25.5, "charger_b: RELEASED AMR03"),
        (25.5, "AMR03 -> WAIT wait_3"),
    ]
    site.fleet.robots["AMR03"].stuck = False
    assert site.run(100.0) == [
        (85.5, "AMR03 -> CHARGE wait_3"),
        (85.75, "charger_b: IDLE"),
        (85.75, "AMR03 -> WAIT wait_3"),
        (86.25, "charger_b <- charge AMR01"),
        (86.25, "charger_b: ASSIGNED AMR01"),
        (86.25, "AMR01 -> CHARGE dock_b"),
        (92.25, "charger_b: CHARGING AMR01"),
    ]


def test_3_the_queue_tells_for_each_robot_the_reason_and_the_time_of_its_wait() -> None:
    site = three_at_two("charge")
    site.chargers["charger_a"].full_in_s = 720.0
    site.fleet.charge("AMR02", site.now)
    site.run(25.25)
    assert site.node.devices()["site"]["queue"] == (
        "tiny/AMR02 by the robot: charger_a charges tiny/AMR01, charger_b charges tiny/AMR03,"
        " charger_a is free in 12 min"
    )


# ---- 4: wrong station


@EACH
def test_4_a_robot_at_the_wrong_station_is_sent_to_its_own_station(finishing: Finishing) -> None:
    site = yard(finishing)
    site.fleet.charge("AMR01", site.now)
    site.run(8.5)
    site.fleet.robots["AMR01"].goes_to = "dock_b"
    assert site.run(20.0) == [
        (11.25, "charger_b: ERROR AMR01 (wrong docking: tiny/AMR01 is not assigned here)"),
        (11.25, "AMR01 -> WAIT wait_1"),
        (11.5, "charger_b: IDLE"),
        (12.25, "AMR01 -> CHARGE charger_a"),
        (18.25, "charger_a: CHARGING AMR01"),
    ]
    assert site.faults == []


@EACH
def test_4_without_receivers_the_position_from_the_fleet_tells_which_robot_stands_there(
    finishing: Finishing,
) -> None:
    site = yard(finishing, knows=False)
    site.fleet.charge("AMR01", site.now)
    site.run(8.5)
    site.fleet.robots["AMR01"].goes_to = "dock_b"
    assert site.run(22.0) == [
        (13.25, "AMR01 -> WAIT wait_1"),
        (14.25, "AMR01 -> CHARGE charger_a"),
        (20.0, "charger_a: CHARGING AMR01"),
    ]


# ---- 5a: a faulty station; 5b: a faulty robot


@EACH
@pytest.mark.parametrize("found", ["at the self-check", "during the charge"])
def test_5a_a_robot_leaves_a_faulty_station_and_does_not_count_as_faulty(
    finishing: Finishing, found: str
) -> None:
    site = yard(finishing)
    a = site.chargers["charger_a"]
    a.broken = found == "at the self-check"
    site.fleet.charge("AMR01", site.now)
    site.run(15.0 if a.broken is False else 13.25)
    a.broken, a.error = True, ("station", "over temperature")
    at = site.now + 0.25
    assert site.run(at + 7.0) == [
        (at, "charger_a: ERROR AMR01 (station: over temperature)"),
        (at, "charger_a <- cancel"),
        (at, "charger_b <- charge AMR01"),
        (at, "charger_b: ASSIGNED AMR01"),
        (at, "AMR01 -> CHARGE dock_b"),
        (at, "ALERT STATION_OUT_OF_SERVICE: charger_a: station: over temperature"),
        (at + 6.0, "charger_b: CHARGING AMR01"),
    ]
    assert site.faults == ["STATION_OUT_OF_SERVICE: charger_a: station: over temperature"]


@EACH
@pytest.mark.parametrize("side", ["station", ""])
def test_5a_after_two_faulty_stations_a_robot_is_charged_when_they_are_repaired(
    finishing: Finishing, side: str
) -> None:
    site = yard(finishing)
    for station in site.chargers.values():
        station.broken, station.fails = True, "station" if side else ""
    site.fleet.charge("AMR01", site.now)
    site.run(60.0)
    text = f"{side}: over temperature" if side else "over temperature"
    robot = "ROBOT_FAULTY: tiny/AMR01 failed at charger_a and at charger_b: not tried again"
    assert site.faults == [
        *([] if side else [robot]),
        *(f"STATION_OUT_OF_SERVICE: charger_{x}: {text}" for x in "ab"),
    ]
    for station in site.chargers.values():
        station.broken = False
        station.decide(OperatorReset(), site.now)
    charged = [what for _, what in site.run(68.0) if what.endswith(": CHARGING AMR01")]
    assert (charged, site.faults) == (["charger_a: CHARGING AMR01"], [])


@EACH
def test_5b_a_faulty_robot_is_tried_at_one_more_station_and_blocks_no_other(
    finishing: Finishing,
) -> None:
    site = yard(finishing)
    for station in site.chargers.values():
        station.refuses = {"RX-1"}
    site.fleet.charge("AMR01", site.now)
    site.run(8.0)
    site.run(20.0)
    assert site.assigned["AMR01"] == "WAIT wait_1"
    for who in ("AMR02", "AMR03"):
        site.fleet.charge(who, site.now)
    site.run(40.0)
    assert [site.mode(name) for name in site.chargers] == ["CHARGING", "CHARGING"]
    tried = [what for _, what in site.story if what.endswith("<- charge AMR01")]
    assert tried == ["charger_a <- charge AMR01", "charger_b <- charge AMR01"]
    assert site.faults == [
        "ROBOT_FAULTY: tiny/AMR01 failed at charger_a and at charger_b: not tried again"
    ]

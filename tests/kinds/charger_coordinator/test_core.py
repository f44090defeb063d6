"""The coordinator's rules, each tested alone. Tests give events to the core, in virtual time."""

import dataclasses

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.report import LOST, FaultCause, diagnosis
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    RELEASED,
    Grant,
    Nudge,
    SiteLimits,
    Wish,
)
from bridges.kinds.charger_coordinator.signals import (
    ChargerStateHeard,
    ChargeUnwanted,
    ChargeWanted,
    Dedicated,
    Event,
    FleetSeen,
    Sighting,
)
from bridges.kinds.charger_coordinator.wrong_pad import on_pad
from bridges.kinds.shared.decision import OperatorReset
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages import definitions as d
from tests.kinds.charger_coordinator.alone import ONE, SETTINGS, THREE, TWO, A, Alone, B, busy
from tests.kinds.charger_coordinator.virtual_site import RECEIVERS

SERVED = [CHARGING, RELEASED]


class Alerted(Alone):
    """The core alone. `sent` has the alerts only."""

    def words(self, message: d.Message) -> str:
        return message.message if isinstance(message, d.Alert) else ""


# ---- COORDINATOR-WISHES-1, COORDINATOR-WISHES-2: which robots want to be charged


def test_a_passing_robot_with_the_mode_of_its_last_charge_has_no_wish() -> None:
    site_ = Alone()
    site_.seen[ONE] = Sighting(ONE, True, None, 40.0, "work")
    site_.run(5)
    site_.wants(ONE, "charger_a")
    site_.run(2)
    site_.wants(ONE, None)
    site_.seen[ONE] = replace(site_.seen[ONE], place=None)
    site_.run(20)
    assert site_.sent == []


def test_a_full_robot_gives_up_its_station_until_its_battery_is_low() -> None:
    site_ = Alone()
    site_.wants(ONE)
    assert site_.run(1) == [(1.0, "charger_a: AMR01")]
    site_.does(A, CHARGING)
    site_.run(2)
    site_.wants(ONE, "charger_a", 100.0)
    assert site_.run(1) == [(4.0, "charger_a: cancel")]
    site_.does(A, RELEASED)
    site_.run(1)
    site_.shows[A] = ChargerStateHeard(A, IDLE)
    site_.wants(ONE, "charger_a", 90.0)
    assert site_.run(30) == []
    site_.wants(ONE, "charger_a", 89.9)
    assert site_.run(1) == [(36.0, "charger_a: AMR01")]


def test_after_an_early_end_of_a_charge_only_a_low_battery_is_a_new_wish() -> None:
    site_ = Alone()
    site_.wants(ONE, "charger_a", 95.0)
    site_.run(1)
    for state in (CHARGING, RELEASED):
        site_.does(A, state)
        site_.run(1)
    site_.shows[A] = ChargerStateHeard(A, IDLE)
    assert site_.run(30) == []
    site_.wants(ONE, "charger_a", 89.0)
    assert site_.run(1) == [(34.0, "charger_a: AMR01")]


# ---- COORDINATOR-1: operators


def test_a_full_robot_of_an_operators_request_makes_room() -> None:
    site_ = Alone()
    site_.hears(ChargeWanted(ONE, "", "op-1", 0.0))
    site_.run(1)
    site_.does(A, CHARGING)
    site_.run(1)
    site_.wants(ONE, "charger_a", 100.0)
    assert site_.run(1) == [(3.0, "charger_a: cancel")]
    assert site_.memory.wishes == ()


def answer(site_: Alone, event: Event) -> str:
    """Return why the event is refused, or "" if the event is accepted."""
    before = len(site_.refused)
    site_.hears(event)
    return "".join(why for _, why in site_.refused[before:])


def test_an_operator_may_send_a_robot_from_its_station_to_another_station() -> None:
    site_ = Alone()
    site_.hears(ChargeWanted(ONE, "", "op-1", 0.0))
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.run(1)
    assert answer(site_, ChargeWanted(ONE, B, "op-2", 0.0)) == ""
    site_.run(1)
    assert site_.sent == [
        (1.0, "charger_a: AMR01"),
        (2.0, "charger_a: cancel"),
        (2.0, "charger_b: AMR01"),
        (3.0, "charger_b: AMR01"),
        (3.0, "charger_a: cancel"),
    ]
    assert [(w.robot, w.request_id) for w in site_.memory.wishes] == [(ONE, "op-2")]


def test_a_reset_tries_faulty_robots_and_passed_over_stations_again() -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.wants(ONE)
    site_.run(12)
    assert site_.run(5) == []
    assert answer(site_, OperatorReset()) == ""
    assert site_.run(1)[0] == (18.0, "charger_a: AMR01")


@pytest.mark.parametrize("event", [OperatorReset(), MaySpeak(True)])
def test_a_reset_or_a_new_permission_to_publish_forgets_the_orders_to_leave_a_pad(
    event: Event,
) -> None:
    site_ = Alone()
    grants, nudges = {A: Grant(ONE, "r1", 0.0)}, {ONE: Nudge("r1", 2, 5.0)}
    site_.memory = replace(site_.memory, grants=grants, nudges=nudges, absent={TWO: 900.0})
    site_.hears(Woken())
    assert site_.memory.nudges == nudges
    site_.hears(event)
    assert site_.memory.nudges == {}
    assert bool(site_.memory.absent) is isinstance(event, MaySpeak)


def test_while_another_node_serves_each_waiting_robot_is_told_so() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.hears(MaySpeak(False, waits="while /other publishes charger_requests"))
    site_.run(1)
    assert site_.report.queue == (
        "tiny/AMR01 by the robot: while /other publishes charger_requests",
    )
    assert (site_.report.waiting, site_.report.assigns) == ((ONE,), "no")
    site_.hears(MaySpeak(True))
    site_.run(1)
    assert (site_.report.waiting, site_.report.assigns) == ((), "yes")


def test_no_event_that_counts_is_refused() -> None:
    site_ = Alone()
    events: list[Event] = [
        Dedicated(((ONE, B),)),
        Woken(),
        MaySpeak(True),
        FleetSeen(()),
        OperatorReset(),
    ]
    assert [answer(site_, event) for event in events] == [""] * 5


def test_a_request_withdrawn_before_its_station_shows_it_is_cancelled_and_does_not_come_back() -> (
    None
):
    site_ = Alone()
    site_.seen[ONE] = Sighting(ONE, False, "wait_1", 95.0, "")
    site_.run(1)
    site_.hears(ChargeWanted(ONE, "", "op-1", 0.0))
    site_.hears(ChargeUnwanted("op-1"))
    site_.hears(ChargerStateHeard(A, IDLE))
    site_.does(A, ASSIGNED)
    site_.run(1)
    site_.does(A, RELEASED)
    site_.run(1)
    site_.shows[A] = ChargerStateHeard(A, IDLE)
    site_.run(10)
    assert site_.sent == [(1.0, "charger_a: AMR01"), (2.0, "charger_a: cancel")]
    assert (site_.memory.wishes, site_.memory.grants) == ((), {})


def test_a_station_that_never_shows_a_withdrawn_request_is_free_after_ten_seconds() -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.run(1)
    site_.hears(ChargeWanted(ONE, "", "op-1", 0.0))
    site_.hears(ChargeUnwanted("op-1"))
    site_.wants(TWO)
    assert site_.run(20)[0] == (11.0, "charger_a: AMR02")


# ---- COORDINATOR-3: a station that does not accept its request


def test_a_station_that_accepts_no_request_is_passed_over_and_its_robot_is_queued_last() -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.wants(ONE)
    site_.run(2)
    site_.wants(TWO)
    assert [text for _, text in site_.run(9)] == ["charger_a: AMR01"] * 8
    assert [w.robot for w in site_.memory.wishes] == [TWO, ONE]
    assert site_.faults == ["REQUEST_NOT_TAKEN: charger_a: its daemon's log says why"]
    assert site_.run(29) == []
    assert site_.run(1) == [(41.0, "charger_a: AMR02")]
    site_.does(A, ASSIGNED)
    site_.run(1)
    assert site_.faults == []


def test_a_station_that_takes_no_request_for_an_hour_causes_one_alert() -> None:
    site_ = Alerted()
    site_.shows[B] = busy(B)
    site_.wants(ONE)
    site_.run(3600)
    assert site_.sent == [(11.0, "charger_a: its daemon's log says why")]


@pytest.mark.parametrize(
    ("after_s", "failed", "said"),
    [
        (58, {}, [(60.0, "charger_a: AMR01")]),
        (59, {ONE: (A,)}, [(61.0, "charger_b: AMR01")]),
    ],
)
def test_a_dropped_request_is_repeated_until_the_start_timeout(
    after_s: int, failed: dict[RobotName, tuple[str, ...]], said: list[tuple[float, str]]
) -> None:
    site_ = Alone()
    site_.wants(ONE, "charger_a")
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.run(after_s)
    site_.shows[A] = ChargerStateHeard(A, IDLE)
    assert site_.run(1) == said
    assert site_.memory.strikes == failed


@pytest.mark.parametrize(
    ("state", "robot", "gone"),
    [(ERROR, TWO, True), (CHARGING, TWO, True), (CHARGING, ONE, False), (ERROR, ONE, False)],
)
def test_a_request_that_a_station_does_not_accept_is_given_up(
    state: d.ChargerStateValue, robot: RobotName, gone: bool
) -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    text = f"wrong docking: {robot} is not assigned here" if state is ERROR else ""
    before = site_.memory.grants[A].request_id
    site_.hears(ChargerStateHeard(A, state, "unrequested/charger_a", robot, text))
    assert (before not in [g.request_id for g in site_.memory.grants.values()]) is gone


def test_requests_are_numbered_one_after_the_other() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.wants(TWO)
    site_.run(1)
    assert [site_.memory.grants[name].request_id for name in (A, B)] == [
        "charger_coordinator/tiny/AMR01/1",
        "charger_coordinator/tiny/AMR02/2",
    ]


# ---- COORDINATOR-STATIONS-2, COORDINATOR-STATIONS-3: whether the station or the robot is at fault


def test_an_error_of_an_unknown_side_counts_until_another_station_charges_the_robot() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ERROR, "over temperature")
    assert site_.run(1) == [(2.0, "charger_a: cancel"), (2.0, "charger_b: AMR01")]
    assert site_.memory.strikes == {ONE: (A,)}
    site_.does(B, CHARGING)
    site_.run(1)
    site_.does(B, RELEASED)
    site_.run(1)
    assert site_.memory.strikes == {}


def test_a_robot_that_fails_at_both_stations_soon_after_the_start_is_faulty() -> None:
    site_ = Alone()
    site_.wants(ONE)
    for station in (A, B):
        site_.run(1)
        for state, error in ((CHARGING, ""), (ERROR, "robot: communication lost")):
            site_.does(station, state, error)
            site_.run(2)
        site_.shows[station] = ChargerStateHeard(station, IDLE)
    assert site_.run(60) == [(11.0, "charger_b: cancel")]
    assert site_.faults == [
        "ROBOT_FAULTY: tiny/AMR01 failed at charger_a and at charger_b: not tried again"
    ]


# ---- COORDINATOR-5, COORDINATOR-WRONG-PAD-3: robots on wrong pads


def test_a_person_is_told_at_once_about_a_stray_robot_in_a_task() -> None:
    site_ = Alone()
    site_.hears(ChargeWanted(ONE, "", "op-1", 0.0))
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.seen[ONE] = Sighting(ONE, False, None, 40.0, "work")
    site_.run(2)
    site_.seen[ONE] = Sighting(ONE, False, "dock_b", 40.0, "work")
    site_.run(2)
    assert site_.faults == []
    site_.run(1)
    assert site_.faults == [
        "WRONG_STATION: tiny/AMR01 stands at charger_b, but is expected at charger_a"
    ]
    assert site_.memory.nudges == {}


def test_a_robot_that_drives_from_a_station_where_it_failed_is_not_astray() -> None:
    site_ = Alone()
    site_.wants(ONE, "charger_a")
    site_.run(1)
    site_.does(A, ERROR, "station: fan")
    site_.run(1)
    site_.does(B, ASSIGNED)
    site_.run(29)
    assert site_.memory.nudges == {}
    site_.run(1)
    assert [(nudge.count, nudge.at) for nudge in site_.memory.nudges.values()] == [(1, 32.0)]


# ---- COORDINATOR-WISHES-4: a robot on its way to its station


def test_an_idle_robot_that_begins_a_task_after_its_call_is_on_its_way() -> None:
    site_ = Alone()
    site_.seen[ONE] = Sighting(ONE, False, "wait_1", 40.0, "")
    assert site_.run(1) == [(1.0, "charger_a: AMR01")]
    site_.does(A, ASSIGNED)
    site_.seen[ONE] = Sighting(ONE, False, None, 40.0, "charge-1")
    assert site_.run(100) == []
    site_.seen[ONE] = Sighting(ONE, False, None, 40.0, "work-2")
    assert site_.run(1) == [(102.0, "charger_a: cancel")]


def test_an_idle_robot_on_the_road_does_not_wait_for_a_station() -> None:
    site_ = Alone()
    site_.shows = {A: busy(A), B: busy(B)}
    site_.seen[ONE] = Sighting(ONE, False, "wait_1", 40.0, "")
    site_.run(1)
    assert [wish.robot for wish in site_.memory.wishes] == [ONE]
    site_.seen[ONE] = Sighting(ONE, False, None, 40.0, "")
    site_.run(1)
    assert site_.memory.wishes == ()


def test_a_robot_on_its_way_keeps_its_station() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ASSIGNED)
    assert site_.run(200) == []


def test_a_charge_of_another_robot_does_not_keep_a_request_that_is_not_accepted() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, CHARGING)
    site_.run(1)
    site_.wants(TWO)
    site_.run(11)
    assert site_.faults == ["REQUEST_NOT_TAKEN: charger_b: its daemon's log says why"]


def test_the_charge_of_a_robot_of_a_silent_fleet_belongs_to_no_task() -> None:
    site_ = Alone()
    site_.hears(ChargeWanted(ONE, "", "op-1", 0.0))
    site_.run(1)
    for state in SERVED:
        site_.does(A, state)
        site_.run(1)
    assert site_.memory.served == {ONE: ""}


# ---- COORDINATOR-4, COORDINATOR-STATIONS-1, COORDINATOR-STATIONS-2: how a request ends


def test_a_robot_with_one_station_is_tried_there_only_twice() -> None:
    site_ = Alone()
    site_.wants(THREE)
    for _ in range(2):
        assert [text for _, text in site_.run(1)][-1:] == ["charger_b: AMR03"]
        site_.does(B, ERROR, "robot: handshake timeout")
        assert [text for _, text in site_.run(1)][-1:] == ["charger_b: cancel"]
        site_.shows[B] = ChargerStateHeard(B, IDLE)
    site_.run(1)
    assert site_.run(60) == []
    assert site_.faults == [
        "ROBOT_FAULTY: tiny/AMR03 failed at charger_b and at charger_b: not tried again"
    ]
    site_.hears(ChargeWanted(THREE, "", "op-1", 0.0))
    assert site_.run(1) != []


@pytest.mark.parametrize(
    ("place", "said", "served"),
    [
        ("charger_a", [(3.0, "charger_a: AMR01"), (4.0, "charger_a: AMR01")], {}),
        ("wait_1", [], {ONE: "task of AMR01"}),
    ],
)
def test_without_a_release_a_charge_ends_when_its_robot_has_left_the_idle_station(
    place: str, said: list[tuple[float, str]], served: dict[RobotName, str]
) -> None:
    site_ = Alone()
    site_.wants(ONE, "charger_a", 95.0)
    site_.run(1)
    site_.does(A, CHARGING)
    site_.run(1)
    site_.shows[A] = ChargerStateHeard(A, IDLE)
    site_.wants(ONE, place, 95.0)
    site_.hears(FleetSeen((site_.seen[ONE],)))
    assert site_.run(2) == said
    assert site_.memory.served == served


def test_the_request_of_another_node_gives_a_robot_no_second_station() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.shows[B] = ChargerStateHeard(B, ASSIGNED, "somebody-1", ONE)
    assert site_.run(5) == []
    assert site_.memory.station_of(ONE) == A
    assert list(site_.memory.grants) == [A]


def test_a_request_of_another_node_for_our_robot_is_adopted_with_its_charge() -> None:
    for state, started in ((ASSIGNED, False), (CHARGING, True)):
        site_ = Alone()
        site_.shows[A] = ChargerStateHeard(A, state, "somebody-1", ONE)
        assert site_.run(3) == []
        assert site_.memory.grants == {
            A: Grant(ONE, "somebody-1", 1.0, shown=True, started=started)
        }
        assert site_.memory.wishes == (Wish(ONE, "operator"),)


def test_a_request_of_another_node_gives_a_waiting_robot_no_second_wish() -> None:
    site_ = Alone()
    site_.shows = {A: busy(A), B: busy(B)}
    site_.wants(ONE)
    site_.run(1)
    site_.shows[A] = ChargerStateHeard(A, ASSIGNED, "somebody-1", ONE)
    site_.run(1)
    assert [(w.robot, w.by) for w in site_.memory.wishes] == [(ONE, "fleet")]


def test_a_second_station_with_an_earlier_request_of_ours_must_release_it() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.shows[B] = ChargerStateHeard(B, ASSIGNED, "charger_coordinator/tiny/AMR01/0", ONE)
    site_.run(1)
    assert site_.sent[-1] == (2.0, "charger_b: cancel")
    assert (site_.memory.station_of(ONE), len(site_.memory.wishes)) == (A, 1)


def test_a_station_that_serves_another_robot_has_released_our_robot() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.run(1)
    site_.shows[A] = busy(A)
    assert site_.run(1) == [(3.0, "charger_b: AMR01")]


def test_a_station_whose_pad_another_robot_does_not_leave_is_given_up_after_the_start_timeout() -> (
    None
):
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ERROR, "wrong docking: tiny/AMR02 stands here, tiny/AMR01 is expected")
    assert site_.run(60) == []
    assert site_.faults == [
        "WRONG_STATION: tiny/AMR02 stands at charger_a, but nobody requested that"
    ]
    assert site_.run(1) == [(62.0, "charger_a: cancel"), (62.0, "charger_b: AMR01")]
    assert site_.memory.strikes == {}


# ---- COORDINATOR-7: a second coordinator (a rival)


def test_a_request_delayed_by_a_rival_is_sent_after_the_rival_has_gone() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.hears(MaySpeak(False))
    assert site_.run(60) == []
    site_.sent.clear()
    site_.hears(MaySpeak(True))
    assert site_.sent == [(61.0, "charger_a: AMR01")]
    assert [text for _, text in site_.run(9)] == ["charger_a: AMR01"] * 9
    assert site_.faults == []


def test_a_request_from_before_a_rival_keeps_its_age_when_it_is_shown() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.run(1)
    before = site_.memory.grants[A]
    site_.hears(MaySpeak(False))
    assert site_.memory.grants[A] == before
    site_.hears(MaySpeak(True))
    assert site_.memory.grants[A] == before


# ---- COORDINATOR-4: the states of a station


@pytest.mark.parametrize(
    ("text", "whose"),
    [
        ("robot: authentication timeout", FaultCause.ROBOT),
        ("station: fan", FaultCause.STATION),
        ("out of service after: station: fan", FaultCause.STATION),
        ("Charger unreachable", FaultCause.LOST),
        ("Charger takes no commands", FaultCause.LOST),
        ("two nodes for one device", FaultCause.LOST),
        ("wrong docking: tiny/AMR01 is not assigned here", FaultCause.PAD),
        ("unknown receiver RX-1", FaultCause.PAD),
        ("unknown vendor state 99", FaultCause.UNCLEAR),
        ("", FaultCause.UNCLEAR),
    ],
)
def test_the_station_names_the_side_at_fault(text: str, whose: FaultCause) -> None:
    assert diagnosis(text) is whose


def test_the_fixed_texts_of_our_chargers_accuse_no_robot() -> None:
    assert {diagnosis(text) for text in LOST.values()} == {FaultCause.LOST}


def test_the_error_of_a_station_names_the_robot_on_its_pad() -> None:
    robots = dict.fromkeys((ONE, TWO, RobotName("tiny", "AMR0")), ())
    ours = dataclasses.replace(
        SiteLimits.of(SETTINGS), robots=robots, receivers={**RECEIVERS, "RX, 1": TWO}
    )
    texts = {
        "wrong docking: tiny/AMR02 stands here, tiny/AMR01 is expected": TWO,
        "wrong docking: tiny/AMR03 is not assigned here": None,
        "unknown receiver RX-1, tiny/AMR02 is expected": ONE,
        "unknown receiver RX-99": None,
        'unknown receiver "RX, 1", tiny/AMR02 is expected': TWO,
        "wrong docking: a text of another node": None,
    }
    assert {text: on_pad(text, ours) for text in texts} == texts

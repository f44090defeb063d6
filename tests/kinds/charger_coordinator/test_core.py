"""The coordinator's rules one by one: its core alone, told by hand, in virtual time."""

import dataclasses
from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.report import LOST, Diagnosis, diagnosis
from bridges.kinds.charger.settings import Robot
from bridges.kinds.charger_coordinator import core, keep
from bridges.kinds.charger_coordinator.astray import on_pad
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    RELEASED,
    Memory,
    Site,
)
from bridges.kinds.charger_coordinator.report import SiteReport
from bridges.kinds.charger_coordinator.signals import Event, FleetSeen, Sighting, StateHeard, Wanted
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages import definitions as d
from tests.kinds.charger_coordinator.yard import RECEIVERS, settings
from tests.kinds.shared import alone

SETTINGS = settings()
ONE, TWO, THREE = (Robot("tiny", f"AMR0{i}") for i in (1, 2, 3))
A, B = "charger_a", "charger_b"


class Alone(alone.Alone[Memory, Event, Site, SiteReport]):
    """`shows`: what each station does, told once a second; `seen`: the robots that a fleet shows."""

    def __init__(self) -> None:
        self.shows = {name: StateHeard(name, IDLE) for name in (A, B)}
        self.seen: dict[Robot, Sighting] = {}
        super().__init__(core.initial("site", 0.0), core.decide, Site.of(SETTINGS), True)

    def words(self, message: d.Message) -> str:
        """Words to the stations are noted."""
        match message:
            case d.ChargerRequest():
                return f"{message.charger_name}: {message.robot_name}"
            case d.ChargerCancel():
                return f"{message.charger_name}: cancel"
        return ""

    @property
    def faults(self) -> list[str]:
        return [str(fault) for fault in self.report.faults]

    def run(self, seconds: int) -> list[tuple[float, str]]:
        """Let time pass, a second at a time; what was said meanwhile."""
        said = len(self.sent)
        for _ in range(seconds):
            self.now += 1.0
            for shown in self.shows.values():
                self.hears(shown)
            for sighting in self.seen.values():
                self.hears(FleetSeen((sighting,)))
            self.hears(Woken())
        return self.sent[said:]

    def wants(self, who: Robot, place: str | None = None, percent: float = 40.0) -> None:
        """Its fleet shows it so from now on."""
        place = f"wait_{who.name[-1]}" if place is None else place
        self.seen[who] = Sighting(who, True, place, percent, f"task of {who.name}")

    def does(self, station: str, state: Any, error: str = "") -> None:
        """The station goes on so with the request that it was sent last."""
        grant = self.memory.grants[station]
        self.shows[station] = StateHeard(station, state, grant.request_id, grant.robot, error)


def busy(station: str) -> StateHeard:
    """A station that serves somebody who is none of ours."""
    return StateHeard(station, CHARGING, "somebody-1", Robot("other", "robot"))


# ---- who wants to be charged


def test_a_robot_that_passes_with_the_mode_of_its_last_charge_does_not_ask_for_another() -> None:
    site_ = Alone()
    site_.seen[ONE] = Sighting(ONE, True, None, 40.0, "work")
    site_.run(5)
    site_.wants(ONE, "charger_a")
    site_.run(2)
    site_.wants(ONE, None)
    site_.seen[ONE] = replace(site_.seen[ONE], place=None)
    site_.run(20)
    assert site_.sent == []


def test_a_robot_that_is_full_gives_its_station_up_and_comes_back_only_when_it_is_low() -> None:
    site_ = Alone()
    site_.wants(ONE)
    assert site_.run(1) == [(1.0, "charger_a: AMR01")]
    site_.does(A, CHARGING)
    site_.run(2)
    site_.wants(ONE, "charger_a", 100.0)
    assert site_.run(1) == [(4.0, "charger_a: cancel")]
    site_.does(A, RELEASED)
    site_.run(1)
    site_.shows[A] = StateHeard(A, IDLE)
    site_.wants(ONE, "charger_a", 90.0)
    assert site_.run(30) == []
    site_.wants(ONE, "charger_a", 89.9)
    assert site_.run(1) == [(36.0, "charger_a: AMR01")]


def test_a_station_that_ends_a_charge_early_is_not_asked_again_until_the_battery_is_low() -> None:
    site_ = Alone()
    site_.wants(ONE, "charger_a", 95.0)
    site_.run(1)
    for state in (CHARGING, RELEASED):
        site_.does(A, state)
        site_.run(1)
    site_.shows[A] = StateHeard(A, IDLE)
    assert site_.run(30) == []
    site_.wants(ONE, "charger_a", 89.0)
    assert site_.run(1) == [(34.0, "charger_a: AMR01")]


def test_a_full_robot_that_an_operator_asked_for_makes_room() -> None:
    site_ = Alone()
    site_.hears(Wanted(ONE, "", "op-1", 0.0))
    site_.run(1)
    site_.does(A, CHARGING)
    site_.run(1)
    site_.wants(ONE, "charger_a", 100.0)
    assert site_.run(1) == [(3.0, "charger_a: cancel")]
    assert site_.memory.wishes == ()


# ---- who gets which station


def test_the_queue_is_first_come_first_served() -> None:
    site_ = Alone()
    site_.shows = {A: busy(A), B: busy(B)}
    for who in (TWO, ONE, THREE):
        site_.wants(who)
        site_.run(1)
    site_.shows[B] = StateHeard(B, IDLE)
    assert site_.run(1) == [(4.0, "charger_b: AMR02")]


def test_a_station_at_which_another_robot_stands_is_not_free_though_it_says_so() -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.seen[TWO] = Sighting(TWO, False, "charger_a", 90.0, "")
    site_.wants(ONE)
    assert site_.run(10) == []
    site_.seen[TWO] = replace(site_.seen[TWO], place=None)
    assert site_.run(1) == [(11.0, "charger_a: AMR01")]


def test_an_old_position_of_a_robot_keeps_no_station() -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.hears(FleetSeen((Sighting(TWO, False, "charger_a", 90.0, ""),)))
    site_.wants(ONE)
    assert site_.run(29) == []
    assert site_.run(1) == [(30.0, "charger_a: AMR01")]


def test_a_station_that_takes_no_request_is_passed_over_and_its_request_is_queued_last() -> None:
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
    assert site_.faults == []


def test_a_robot_that_is_charged_unasked_where_it_stands_has_that_station() -> None:
    site_ = Alone()
    site_.shows[A] = StateHeard(A, CHARGING, "unrequested/charger_a")
    site_.wants(ONE, "charger_a")
    assert site_.run(10) == []
    assert site_.memory.station_of(ONE) == A


# ---- whose fault


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


def test_a_failure_is_forgotten_once_the_robot_has_been_charged_for_a_while() -> None:
    site_ = Alone()
    site_.wants(ONE, "charger_a")
    site_.run(1)
    site_.does(A, ERROR, "over temperature")
    site_.run(1)
    site_.wants(ONE, "dock_b")
    site_.shows[A] = StateHeard(A, IDLE)
    site_.does(B, CHARGING)
    site_.run(10)
    assert site_.memory.strikes == {ONE: (A,)}
    site_.run(1)
    assert site_.memory.strikes == {}


def test_a_robot_that_fails_at_both_stations_a_moment_after_the_charge_begins_is_faulty() -> None:
    site_ = Alone()
    site_.wants(ONE)
    for station in (A, B):
        site_.run(1)
        for state, error in ((CHARGING, ""), (ERROR, "robot: communication lost")):
            site_.does(station, state, error)
            site_.run(2)
        site_.shows[station] = StateHeard(station, IDLE)
    assert site_.run(60) == [(11.0, "charger_b: cancel")]
    assert site_.faults == [
        "ROBOT_FAULTY: tiny/AMR01 failed at charger_a and at charger_b: not tried again"
    ]


@pytest.mark.parametrize(
    ("error", "left"),
    [
        ("station: over temperature", {}),
        ("out of service after: station: over temperature", {}),
        ("over temperature", {}),
        ("out of service after: over temperature", {}),
        ("robot: handshake timeout", {ONE: (A,)}),
        ("Charger unreachable", {ONE: (A,)}),
        ("unknown receiver RX-9", {ONE: (A,)}),
    ],
)
def test_a_failure_is_forgotten_when_its_station_names_itself_or_is_mended_without_the_robot(
    error: str, left: dict[Robot, tuple[str, ...]]
) -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.wants(ONE, "charger_a")
    site_.run(1)
    site_.does(A, ERROR, "over temperature")
    site_.run(60)
    assert site_.memory.strikes == {ONE: (A,)}, "it stands there still: either may be at fault"
    site_.shows[A] = StateHeard(A, ERROR, "unrequested/charger_a", None, error)
    site_.wants(ONE)
    site_.run(12)
    site_.shows[A] = busy(A)
    site_.run(1)
    assert site_.memory.strikes == left


def test_a_strayed_robot_in_a_task_cannot_be_told_so_a_person_is_at_once() -> None:
    site_ = Alone()
    site_.hears(Wanted(ONE, "", "op-1", 0.0))
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


def test_a_robot_on_its_way_from_a_station_where_it_failed_is_not_astray() -> None:
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


def test_an_idle_robot_that_is_called_and_begins_a_task_is_on_its_way() -> None:
    site_ = Alone()
    site_.seen[ONE] = Sighting(ONE, False, "wait_1", 40.0, "")
    assert site_.run(1) == [(1.0, "charger_a: AMR01")]
    site_.does(A, ASSIGNED)
    site_.seen[ONE] = Sighting(ONE, False, None, 40.0, "charge-1")
    assert site_.run(100) == []
    site_.seen[ONE] = Sighting(ONE, False, None, 40.0, "work-2")
    assert site_.run(1) == [(102.0, "charger_a: cancel")]


def test_an_idle_robot_that_is_on_the_road_when_it_has_no_station_does_not_wait_for_one() -> None:
    site_ = Alone()
    site_.shows = {A: busy(A), B: busy(B)}
    site_.seen[ONE] = Sighting(ONE, False, "wait_1", 40.0, "")
    site_.run(1)
    assert [wish.robot for wish in site_.memory.wishes] == [ONE]
    site_.seen[ONE] = Sighting(ONE, False, None, 40.0, "")
    site_.run(1)
    assert site_.memory.wishes == ()


def test_a_served_robots_mode_is_believed_again_when_it_has_left_or_stays_long() -> None:
    for leaves, again_at in ((True, 9.0), (False, 304.0)):
        site_ = Alone()
        site_.wants(ONE, "charger_a", 95.0)
        site_.run(1)
        for state in (CHARGING, RELEASED):
            site_.does(A, state)
            site_.run(1)
        site_.shows[A] = StateHeard(A, IDLE)
        if leaves:
            site_.seen[ONE] = Sighting(ONE, True, None, 95.0, "work")
            site_.run(3)
        site_.sent.clear()
        site_.seen[ONE] = Sighting(ONE, True, "charger_a", 95.0, "another task")
        site_.run(400)
        assert site_.sent[0] == (again_at, "charger_a: AMR01")


def test_a_robot_with_one_station_is_tried_there_twice_and_no_more() -> None:
    site_ = Alone()
    site_.wants(THREE)
    for _ in range(2):
        assert [text for _, text in site_.run(1)][-1:] == ["charger_b: AMR03"]
        site_.does(B, ERROR, "robot: handshake timeout")
        assert [text for _, text in site_.run(1)][-1:] == ["charger_b: cancel"]
        site_.shows[B] = StateHeard(B, IDLE)
    site_.run(1)
    assert site_.run(60) == []
    assert site_.faults == [
        "ROBOT_FAULTY: tiny/AMR03 failed at charger_b and at charger_b: not tried again"
    ]
    site_.hears(Wanted(THREE, "", "op-1", 0.0))
    assert site_.run(1) != []


def test_a_robot_that_did_not_come_has_not_failed_but_one_that_stood_there_has() -> None:
    for place, strikes in ((None, {}), ("charger_a", {ONE: (A,)})):
        site_ = Alone()
        site_.wants(ONE)
        site_.run(1)
        site_.does(A, ASSIGNED)
        site_.seen[ONE] = replace(site_.seen[ONE], place=place)
        site_.run(1)
        site_.does(A, RELEASED)
        site_.run(1)
        assert site_.memory.strikes == strikes


def test_a_fault_of_the_stations_side_does_not_count_against_the_robot() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ERROR, "station: fan")
    assert site_.run(1) == [(2.0, "charger_a: cancel"), (2.0, "charger_b: AMR01")]
    assert site_.memory.strikes == {}
    assert site_.faults == ["STATION_OUT_OF_SERVICE: charger_a: station: fan"]


def test_a_robot_that_did_not_come_keeps_its_request_only_while_it_stands_at_one_of_our_places() -> (
    None
):
    for place, queue in ((None, [TWO]), ("wait_1", [TWO, ONE])):
        site_ = Alone()
        site_.shows[B] = busy(B)
        site_.wants(ONE)
        site_.run(1)
        site_.wants(TWO)
        site_.does(A, ASSIGNED)
        site_.seen[ONE] = replace(site_.seen[ONE], place=place)
        site_.run(1)
        site_.does(A, RELEASED)
        site_.run(1)
        assert [wish.robot for wish in site_.memory.wishes] == queue


def test_a_robot_that_has_a_station_does_not_get_another_by_a_strangers_request() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.shows[B] = StateHeard(B, ASSIGNED, "somebody-1", ONE)
    assert site_.run(5) == []
    assert site_.memory.station_of(ONE) == A
    assert list(site_.memory.grants) == [A]


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


def test_a_request_that_a_rival_held_back_is_sent_afterwards() -> None:
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


def test_only_a_robot_refused_as_unasked_may_have_the_station_where_it_stands() -> None:
    for request_id, said in (("unrequested/charger_a", ["charger_a: AMR01"]), ("somebody-1", [])):
        site_ = Alone()
        site_.shows[B] = busy(B)
        text = "wrong docking: tiny/AMR01 is not assigned here"
        site_.shows[A] = StateHeard(A, ERROR, request_id, ONE, text)
        site_.wants(ONE, "charger_a")
        assert [words for _, words in site_.run(1)] == said


@pytest.mark.parametrize(
    ("text", "whose"),
    [
        ("robot: authentication timeout", Diagnosis.ROBOT),
        ("station: fan", Diagnosis.STATION),
        ("out of service after: station: fan", Diagnosis.STATION),
        ("Charger unreachable", Diagnosis.LOST),
        ("Charger takes no commands", Diagnosis.LOST),
        ("two nodes for one device", Diagnosis.LOST),
        ("wrong docking: tiny/AMR01 is not assigned here", Diagnosis.PAD),
        ("unknown receiver RX-1", Diagnosis.PAD),
        ("unknown vendor state 99", Diagnosis.UNCLEAR),
        ("", Diagnosis.UNCLEAR),
    ],
)
def test_the_side_at_fault_is_what_the_station_says(text: str, whose: Diagnosis) -> None:
    assert diagnosis(text) is whose


def test_the_fixed_texts_of_our_own_chargers_say_nothing_against_a_robot() -> None:
    assert {diagnosis(text) for text in LOST.values()} == {Diagnosis.LOST}


def test_who_stands_on_a_pad_is_read_from_its_error() -> None:
    robots = dict.fromkeys((ONE, TWO, Robot("tiny", "AMR0")), ())
    ours = dataclasses.replace(
        Site.of(SETTINGS), robots=robots, receivers={**RECEIVERS, "RX, 1": TWO}
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


# ---- what is kept


def test_a_restart_remembers_who_was_charging_and_which_robot_a_station_must_release() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.wants(TWO)
    site_.run(1)
    site_.does(A, CHARGING)
    site_.does(B, CHARGING)
    site_.run(1)
    site_.seen[TWO] = replace(site_.seen[TWO], charges=False)
    site_.run(1)
    kept = keep.persist({"site": site_.memory})
    restored = keep.restore(kept, SETTINGS, 50.0)["site"].grants
    assert {name: (g.robot, g.started, g.over) for name, g in restored.items()} == {
        A: (ONE, True, False),
        B: (TWO, True, True),
    }


def test_names_that_the_yaml_no_longer_has_are_not_restored() -> None:
    site_ = Alone()
    for who in (ONE, TWO, THREE):
        site_.wants(who)
    site_.run(1)
    kept = keep.persist({"site": site_.memory})
    fleet = SETTINGS.fleets["tiny"]
    less = {name: robot for name, robot in fleet.robots.items() if name != "AMR01"}
    changed = settings(
        fleets={"tiny": type(fleet)(waypoints=fleet.waypoints, robots=less)},
        stations={"charger_b": SETTINGS.stations["charger_b"]},
    )
    restored = keep.restore(kept, changed, 9.0)["site"]
    assert [wish.robot for wish in restored.wishes] == [TWO, THREE]
    assert {name: grant.robot for name, grant in restored.grants.items()} == {B: TWO}
    with pytest.raises(ValueError, match="version 7"):
        keep.restore(kept.replace(b'"version":1', b'"version":7'), SETTINGS, 0.0)

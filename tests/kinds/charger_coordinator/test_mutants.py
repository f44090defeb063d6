"""The coordinator's core at its edges: what a mutation run found untested (docs/mutation.md)."""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.settings import Robot
from bridges.kinds.charger_coordinator import core, keep, report
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    RELEASED,
    Grant,
    Site,
    Wish,
)
from bridges.kinds.charger_coordinator.signals import (
    Dedicated,
    Event,
    FleetSeen,
    Sighting,
    StateHeard,
    Unwanted,
    Wanted,
)
from bridges.kinds.shared.decision import OperatorReset
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages import definitions as d
from tests.kinds.charger_coordinator.test_core import ONE, SETTINGS, THREE, TWO, A, Alone, B, busy

SITE = Site.of(SETTINGS)
SERVED = [CHARGING, RELEASED]


def answer(site_: Alone, event: Event) -> str:
    """Why the event is refused; "" if it counts."""
    before = len(site_.refused)
    site_.hears(event)
    return "".join(why for _, why in site_.refused[before:])


# ---- operators


def test_an_operator_may_send_a_robot_that_has_a_station_to_another_one() -> None:
    site_ = Alone()
    site_.hears(Wanted(ONE, "", "op-1", 0.0))
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.run(1)
    assert answer(site_, Wanted(ONE, B, "op-2", 0.0)) == ""
    site_.run(1)
    assert site_.sent == [
        (1.0, "charger_a: AMR01"),
        (2.0, "charger_a: cancel"),
        (2.0, "charger_b: AMR01"),
        (3.0, "charger_b: AMR01"),
        (3.0, "charger_a: cancel"),
    ]
    assert [(w.robot, w.request_id) for w in site_.memory.wishes] == [(ONE, "op-2")]


def test_a_newer_request_for_the_station_that_the_robot_has_moves_nothing() -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.hears(Wanted(ONE, "", "op-1", 0.0))
    site_.hears(Wanted(TWO, "", "op-2", 0.0))
    site_.run(1)
    site_.does(A, ASSIGNED)
    for request_id, station in (("op-3", A), ("op-4", "")):
        site_.hears(Wanted(ONE, station, request_id, 0.0))
        assert site_.run(5) == []
    assert [(w.robot, w.request_id) for w in site_.memory.wishes] == [(ONE, "op-4"), (TWO, "op-2")]


def test_a_request_that_suits_no_station_of_the_robot_is_refused_by_name() -> None:
    assert answer(Alone(), Wanted(THREE, A, "op-1", 0.0)) == "station does not suit the robot"


def test_a_request_that_has_a_station_is_withdrawn_by_the_id_that_the_station_shows() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.hears(Wanted(TWO, "", "op-2", 0.0))
    site_.run(1)
    site_.does(A, CHARGING)
    site_.run(1)
    charging, other = site_.memory.grants[A].robot, site_.memory.grants[B].robot
    assert answer(site_, Unwanted(site_.memory.grants[A].request_id)) == ""
    assert site_.sent[-1] == (2.0, "charger_a: cancel")
    assert [w.robot for w in site_.memory.wishes] == [other]
    assert charging != other


def test_a_withdrawal_is_refused_unless_the_request_is_known_or_over() -> None:
    site_ = Alone()
    site_.hears(Wanted(ONE, "", "op-1", 0.0))
    assert [answer(site_, Unwanted("op-1")) for _ in range(2)] == ["", ""]
    site_.wants(TWO)
    site_.run(1)
    assert answer(site_, Unwanted("op-9")) == "no such request"
    assert answer(site_, Unwanted("")) == "no such request"


def test_an_operators_reset_tries_faulty_robots_and_stations_that_were_passed_over() -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.wants(ONE)
    site_.run(12)
    assert site_.run(5) == []
    assert answer(site_, OperatorReset()) == ""
    assert site_.run(1)[0] == (18.0, "charger_a: AMR01")


def test_nothing_that_counts_is_refused() -> None:
    site_ = Alone()
    events: list[Event] = [
        Dedicated(((ONE, B),)),
        Woken(),
        MaySpeak(True),
        FleetSeen(()),
        OperatorReset(),
    ]
    assert [answer(site_, event) for event in events] == [""] * 5


def test_a_robot_that_an_operator_asks_for_again_is_tried_again_in_spite_of_its_failures() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ERROR, "over temperature")
    site_.run(1)
    assert site_.memory.strikes == {ONE: (A,)}
    site_.hears(Wanted(ONE, "", "op-1", 0.0))
    assert site_.memory.strikes == {}


# ---- who gets which station


def test_a_robot_that_stands_at_a_station_gets_that_one() -> None:
    site_ = Alone()
    site_.wants(ONE, "dock_b")
    assert site_.run(1) == [(1.0, "charger_b: AMR01")]


def test_a_dedicated_station_comes_before_the_yamls_first_and_after_where_the_robot_stands() -> (
    None
):
    for place, station in (("wait_1", "charger_b"), ("charger_a", "charger_a")):
        site_ = Alone()
        site_.hears(Dedicated(((ONE, B),)))
        site_.wants(ONE, place)
        assert site_.run(1) == [(1.0, f"{station}: AMR01")]


@pytest.mark.parametrize(
    ("place", "said", "served"),
    [
        ("charger_a", [(3.0, "charger_a: AMR01"), (4.0, "charger_a: AMR01")], {}),
        ("wait_1", [], {ONE: "task of AMR01"}),
    ],
)
def test_a_charge_that_an_idle_station_has_not_released_is_over_if_its_robot_has_left(
    place: str, said: list[tuple[float, str]], served: dict[Robot, str]
) -> None:
    site_ = Alone()
    site_.wants(ONE, "charger_a", 95.0)
    site_.run(1)
    site_.does(A, CHARGING)
    site_.run(1)
    site_.shows[A] = StateHeard(A, IDLE)
    site_.wants(ONE, place, 95.0)
    site_.hears(FleetSeen((site_.seen[ONE],)))
    assert site_.run(2) == said
    assert site_.memory.served == served


def test_a_robot_charged_in_one_task_may_be_charged_again_in_the_next() -> None:
    site_ = Alone()
    site_.wants(ONE, "charger_a", 95.0)
    site_.run(1)
    for state in SERVED:
        site_.does(A, state)
        site_.run(1)
    site_.shows[A] = StateHeard(A, IDLE)
    site_.run(1)
    assert site_.memory.served == {ONE: "task of AMR01"}
    site_.hears(FleetSeen((Sighting(ONE, False, None, 95.0, "the next task"),)))
    assert site_.memory.served == {}
    site_.seen[ONE] = Sighting(ONE, True, "charger_a", 95.0, "the next task")
    assert site_.run(3) == [(7.0, "charger_a: AMR01")]


def test_a_robot_whose_fleet_is_not_heard_is_charged_in_no_task() -> None:
    site_ = Alone()
    site_.hears(Wanted(ONE, "", "op-1", 0.0))
    site_.run(1)
    for state in SERVED:
        site_.does(A, state)
        site_.run(1)
    assert site_.memory.served == {ONE: ""}


def test_a_robot_that_drives_away_before_it_was_charged_has_not_been_charged() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.seen[ONE] = Sighting(ONE, False, None, 40.0, "other work")
    site_.run(1)
    assert (site_.memory.wishes, site_.memory.served) == ((), {})


def test_a_request_made_before_a_rival_came_keeps_its_age_once_it_is_shown() -> None:
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


# ---- what a station shows


def test_another_nodes_request_for_our_robot_is_adopted_with_the_charge_that_it_has() -> None:
    for state, started in ((ASSIGNED, False), (CHARGING, True)):
        site_ = Alone()
        site_.shows[A] = StateHeard(A, state, "somebody-1", ONE)
        assert site_.run(3) == []
        assert site_.memory.grants == {
            A: Grant(ONE, "somebody-1", 1.0, shown=True, started=started)
        }
        assert site_.memory.wishes == (Wish(ONE, "operator"),)


def test_another_nodes_request_gives_a_robot_that_waits_no_second_wish() -> None:
    site_ = Alone()
    site_.shows = {A: busy(A), B: busy(B)}
    site_.wants(ONE)
    site_.run(1)
    site_.shows[A] = StateHeard(A, ASSIGNED, "somebody-1", ONE)
    site_.run(1)
    assert [(w.robot, w.by) for w in site_.memory.wishes] == [(ONE, "fleet")]


def test_a_second_station_that_still_shows_an_earlier_request_of_ours_is_told_to_let_go() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.shows[B] = StateHeard(B, ASSIGNED, "charger_coordinator/tiny/AMR01/0", ONE)
    site_.run(1)
    assert site_.sent[-1] == (2.0, "charger_b: cancel")
    assert (site_.memory.station_of(ONE), len(site_.memory.wishes)) == (A, 1)


def test_a_station_that_serves_somebody_else_has_let_our_robot_go() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.run(1)
    site_.shows[A] = busy(A)
    assert site_.run(1) == [(3.0, "charger_b: AMR01")]


@pytest.mark.parametrize(
    ("after_s", "failed", "said"),
    [
        (58, {}, [(60.0, "charger_a: AMR01")]),
        (59, {ONE: (A,)}, [(61.0, "charger_b: AMR01")]),
    ],
)
def test_a_request_that_a_station_drops_is_made_again_until_its_robot_should_have_started(
    after_s: int, failed: dict[Robot, tuple[str, ...]], said: list[tuple[float, str]]
) -> None:
    site_ = Alone()
    site_.wants(ONE, "charger_a")
    site_.run(1)
    site_.does(A, ASSIGNED)
    site_.run(after_s)
    site_.shows[A] = StateHeard(A, IDLE)
    assert site_.run(1) == said
    assert site_.memory.strikes == failed


@pytest.mark.parametrize(
    ("state", "robot", "gone"),
    [(ERROR, TWO, True), (CHARGING, TWO, True), (CHARGING, ONE, False), (ERROR, ONE, False)],
)
def test_a_request_is_given_up_when_the_station_will_not_take_it(
    state: d.ChargerStateValue, robot: Robot, gone: bool
) -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    text = f"wrong docking: {robot} is not assigned here" if state is ERROR else ""
    before = site_.memory.grants[A].request_id
    site_.hears(StateHeard(A, state, "unrequested/charger_a", robot, text))
    assert (before not in [g.request_id for g in site_.memory.grants.values()]) is gone


def test_only_the_robot_that_stands_there_may_have_a_station_in_error() -> None:
    site_ = Alone()
    text = "wrong docking: tiny/AMR02 is not assigned here"
    site_.shows = {A: StateHeard(A, ERROR, "unrequested/charger_a", TWO, text), B: busy(B)}
    site_.wants(ONE)
    assert site_.run(5) == []


def test_a_robot_waits_for_a_station_where_it_has_not_failed() -> None:
    site_ = Alone()
    site_.shows[B] = busy(B)
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ERROR, "robot: handshake timeout")
    site_.run(1)
    site_.shows[A] = StateHeard(A, IDLE)
    assert site_.run(5) == []
    site_.shows[B] = StateHeard(B, IDLE)
    assert site_.run(1) == [(8.0, "charger_b: AMR01")]


def test_a_robot_on_its_way_keeps_a_station_that_waits_for_it() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ASSIGNED)
    assert site_.run(200) == []


def test_a_charge_beside_it_does_not_keep_a_request_that_nobody_takes() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, CHARGING)
    site_.run(1)
    site_.wants(TWO)
    site_.run(11)
    assert site_.faults == ["REQUEST_NOT_TAKEN: charger_b: its daemon's log says why"]


def test_requests_are_numbered_one_after_the_other() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.wants(TWO)
    site_.run(1)
    assert [site_.memory.grants[name].request_id for name in (A, B)] == [
        "charger_coordinator/tiny/AMR01/1",
        "charger_coordinator/tiny/AMR02/2",
    ]


# ---- what is shown and told


def test_the_report_names_each_station_with_its_state_and_robot() -> None:
    site_ = Alone()
    site_.shows = {A: StateHeard(A, IDLE)}
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, CHARGING)
    site_.run(1)
    shown = report.report(site_.memory, site_.now, SITE)
    assert shown.read_at == 2.0
    assert shown.stations == ((A, "CHARGING tiny/AMR01, by the robot"), (B, "?"))
    site_.hears(Unwanted(site_.memory.grants[A].request_id))
    assert report.report(site_.memory, site_.now, SITE).stations[0] == (A, "CHARGING")


@pytest.mark.parametrize(
    ("error", "who"),
    [
        ("unknown receiver RX-99", "unknown receiver RX-99"),
        ("wrong docking: other/robot is not assigned here", "an unknown robot"),
    ],
)
def test_a_stranger_on_a_pad_is_named_as_far_as_it_is_known(error: str, who: str) -> None:
    site_ = Alone()
    site_.shows[A] = StateHeard(A, ERROR, "unrequested/charger_a", None, error)
    site_.run(1)
    assert site_.faults == [f"WRONG_STATION: {who} stands at charger_a, but nobody requested that"]


def test_a_fault_is_an_alert_with_its_title_its_reason_and_its_rank() -> None:
    site_ = Alone()
    site_.run(1)
    alerts = []
    for station, error in ((A, "station: fan"), (B, "unknown receiver RX-99")):
        heard = StateHeard(station, ERROR, f"unrequested/{station}", None, error)
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


# ---- what is kept


def test_a_restart_remembers_everything_that_it_keeps() -> None:
    site_ = Alone()
    site_.hears(Dedicated(((TWO, B),)))
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ERROR, "over temperature")
    site_.run(1)
    site_.hears(Wanted(TWO, B, "op-1", 33.0))
    site_.hears(Unwanted("op-1"))
    site_.hears(Wanted(TWO, A, "op-2", 44.0))
    site_.wants(THREE)
    site_.run(1)
    before = replace(site_.memory, served={THREE: "task of AMR03"})
    after = keep.restore(keep.persist({"site": before}), SETTINGS, 50.0)["site"]
    assert (after.wishes, after.strikes, after.served) == (
        before.wishes,
        before.strikes,
        before.served,
    )
    assert (after.over, after.count, after.preferred) == (
        before.over,
        before.count,
        before.preferred,
    )
    assert (before.strikes, before.over, before.preferred) == ({ONE: (A,)}, ("op-1",), {TWO: B})
    for name, grant in before.grants.items():
        kept = after.grants[name]
        assert (kept.robot, kept.request_id, kept.start_timeout_s, kept.made_at) == (
            grant.robot,
            grant.request_id,
            grant.start_timeout_s,
            50.0,
        )
    assert after.began_at == 50.0


def test_a_coordinator_that_remembers_nothing_keeps_an_empty_memory() -> None:
    kept = keep.restore(keep.persist({}), SETTINGS, 0.0)["site"]
    assert (kept.wishes, dict(kept.grants), kept.count) == ((), {}, 0)


def test_a_file_that_is_not_a_memory_is_refused_with_what_it_should_be() -> None:
    with pytest.raises(ValueError, match=r"^not a coordinator's memory: "):
        keep.restore(b"[]", SETTINGS, 0.0)


# ---- when it wakes


def wakes(site_: Alone) -> float:
    return core.decide(site_.memory, Woken(), site_.now, SITE).wake_at


def test_the_core_wakes_when_a_station_falls_silent_and_when_a_request_is_due_again() -> None:
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

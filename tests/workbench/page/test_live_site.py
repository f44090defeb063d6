"""The latest message of each device, as the page stores it. The memory stays bounded, even with
invented names."""

from collections import deque
from collections.abc import Iterator, Sized

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.messages.topics import AnyTopic
from bridges.observe.limits import FORGOTTEN_S, MOST_DEVICES
from bridges.runtime.diagnostics import diagnosis
from workbench.page.live_site import KEPT_S, MOST_ROBOTS, STEP_S, LiveSite, Stands

WALL = 1_700_000_000.0
LIFT = d.LiftState(
    lift_name="Lift1", available_floors=("L1", "L2"), current_floor="L1", door_state=2
)


def heard(at: float, topic: AnyTopic, message: d.Message) -> Heard:
    return Heard(at, WALL + at, topic.name, message)


def lift(at: float, name: str = "Lift1") -> Heard:
    state = replace(LIFT, lift_name=name, lift_time=stamp(WALL + at))
    return heard(at, topics.LIFT_STATES, state)


def names(site: LiveSite, now: float) -> list[str]:
    return [shown.row.name for shown in site.devices(now, WALL + now)]


def test_a_device_is_shown_with_its_state_and_its_row() -> None:
    site = LiveSite()
    site.take(lift(1.0))
    (shown,) = site.devices(1.2, WALL + 1.2)
    assert (shown.row.state, shown.row.age) == ("car at L1, door open, mode UNKNOWN", "0.2 s")
    assert isinstance(shown.state, d.LiftState)


def charger(at: float, robot: str = "") -> Heard:
    state = d.ChargerState(stamp(WALL + at), 2, "pad", robot_fleet="fleet", robot_name=robot)
    return heard(at, topics.CHARGER_STATES, state)


def test_how_long_a_robot_has_had_a_charger_is_shown_as_far_as_it_was_seen() -> None:
    site, told = LiveSite(), []
    for at in (0, 1, 2, 3, 4, 5, 6, 30, 31):  # no state comes between 6 s and 30 s
        site.take(charger(float(at), "R1" if at < 3 else "" if at == 3 else "R2"))
        told.append(next(one.stands for one in site.changed(at, WALL + at)))
    assert told == [
        Stands(0.0, at_least=True),
        Stands(1.0, at_least=True),
        Stands(2.0, at_least=True),
        None,
        Stands(0.0, at_least=False),
        Stands(1.0, at_least=False),
        Stands(2.0, at_least=False),
        Stands(0.0, at_least=True),
        Stands(1.0, at_least=True),
    ]
    assert [one.stands for one in site.devices(90.0, WALL + 90)] == [Stands(1.0, at_least=True)]


def test_only_devices_heard_since_the_last_drawing_are_drawn_again() -> None:
    site = LiveSite()
    site.take(lift(1.0))
    site.take(lift(1.0, "Lift2"))
    assert len(site.changed(1.1, WALL)) == 2
    assert site.changed(1.2, WALL) == []
    site.take(lift(2.0))
    assert [shown.row.name for shown in site.changed(2.1, WALL)] == ["Lift1"]


def test_ten_thousand_made_up_lifts_displace_no_known_one() -> None:
    site = LiveSite()
    site.take(lift(0.0))
    for number in range(10_000):
        site.take(lift(0.001 * number, f"made up {number}"))
    found = names(site, 10.0)
    assert len(found) == MOST_DEVICES
    assert "Lift1" in found
    assert site.crowded == {"lift"}


def test_a_device_that_went_silent_gives_way_to_a_new_one() -> None:
    site = LiveSite()
    for number in range(MOST_DEVICES):
        site.take(lift(0.0, f"old {number}"))
    later = FORGOTTEN_S + 1.0
    site.take(lift(later, "new"))
    found = names(site, later)
    assert len(found) == MOST_DEVICES
    assert "new" in found
    assert "old 0" not in found


def test_after_three_thousand_made_up_names_a_real_lift_is_explained_and_nothing_has_grown() -> (
    None
):
    site, later = LiveSite(), 0.0
    sizes = []
    for number in range(3000):
        later += FORGOTTEN_S
        site.take(lift(later, f"made up {number}"))
        made_up = d.FleetState("fleet", (d.RobotState(f"made up {number}"),))
        site.take(heard(later, topics.FLEET_STATES, made_up))
        status = {f"made up {number}": {"faults": [], "input_age_s": 0.1}}
        told = diagnosis(f"made up {number}", "lift", {}, status, stamp(WALL + later))
        site.take(heard(later, topics.DIAGNOSTICS, told))
        asked = d.LiftRequest(f"made up {number}", session_id=f"fleet/{number}")
        site.take(heard(later, topics.ADAPTER_LIFT_REQUESTS, asked))
        if number in (1499, 2999):
            site.changed(later, WALL + later)
            sizes.append(sum(map(len, tables(site))))
    assert sizes[0] == sizes[1] > MOST_DEVICES
    site.take(lift(later))
    explained = site.explain("lift", "Lift1", later, WALL + later, {})
    assert explained is not None
    assert explained.now[0].startswith("Nobody has had the lift since")
    assert len(names(site, later)) == MOST_DEVICES
    assert site.timeline("lift", "made up 0", later) is None
    real = d.FleetState("fleet", (d.RobotState("real"),))
    site.take(heard(later, topics.FLEET_STATES, real))
    assert "real" in [one.state.name for one in site.robots()]


def tables(root: object) -> Iterator[Sized]:
    """Yield every collection inside our objects, at any depth."""
    found, waiting = set[int](), [root]
    while waiting:
        one = waiting.pop()
        if id(one) in found or isinstance(one, str | bytes | type):
            continue
        found.add(id(one))
        if isinstance(one, dict | list | set | tuple | deque):
            yield one
            waiting += [*one.values()] if isinstance(one, dict) else one
        elif type(one).__module__.startswith(("bridges", "workbench")):
            slots = getattr(type(one), "__slots__", ())
            waiting += [*getattr(one, "__dict__", {}).values()]
            waiting += [getattr(one, name) for name in slots if hasattr(one, name)]


def test_requests_for_devices_that_nobody_has_seen_are_not_kept() -> None:
    site = LiveSite()
    asked = heard(0.0, topics.LIFT_REQUESTS, d.LiftRequest("nowhere", session_id="a/b"))
    for _ in range(1000):
        site.take(asked)
    assert site.timeline("lift", "nowhere", 0.0) is None
    assert names(site, 0.0) == []


def test_made_up_robots_are_bounded() -> None:
    site = LiveSite()
    robots = tuple(d.RobotState(f"r{n}") for n in range(10_000))
    site.take(heard(0.0, topics.FLEET_STATES, d.FleetState("fleet", robots)))
    assert len(site.robots()) == MOST_ROBOTS


def test_the_timeline_has_the_sessions_and_requests_of_its_own_device_only() -> None:
    site = LiveSite()
    held = replace(LIFT, session_id="fleet/a", lift_time=stamp(WALL))
    site.take(heard(0.0, topics.LIFT_STATES, held))
    asked = d.LiftRequest("Lift1", session_id="fleet/b", destination_floor="L2")
    site.take(heard(0.5, topics.ADAPTER_LIFT_REQUESTS, asked))
    site.take(lift(0.6, "Lift2"))
    timeline = site.timeline("lift", "Lift1", 1.0)
    assert timeline is not None
    found = {
        (lane.name, lane.row) for lane in timeline.lanes if lane.name in ("sessions", "requests")
    }
    assert found == {("sessions", ""), ("requests", "fleet/b")}


def test_a_day_of_rides_takes_no_more_room_than_ten_minutes() -> None:
    site = LiveSite()
    for at in range(0, 3600, 2):
        state = replace(LIFT, lift_time=stamp(WALL + at), session_id=f"fleet/robot{at}")
        site.take(heard(float(at), topics.LIFT_STATES, state))
    kept = site.timeline("lift", "Lift1", now=0.0)
    assert kept is not None
    sessions = kept.lanes[0].spans
    assert (sessions[0].from_s, sessions[-1].to_s) == (3596.0 - KEPT_S - STEP_S, 3598.0)


def test_faults_and_simulations_come_from_the_daemons_diagnostics() -> None:
    site = LiveSite()
    site.take(lift(0.0))
    fault = {"code": "OVERLOAD", "detail": "3 s"}
    status = {"Lift1": {"faults": [fault], "input_age_s": 0.1}}
    told = diagnosis("node", "lift", {"simulated": True}, status, stamp(WALL))
    site.take(heard(0.1, topics.DIAGNOSTICS, told))
    (shown,) = site.devices(0.2, WALL + 0.2)
    assert (shown.row.faults, shown.row.simulated) == ("OVERLOAD (3 s)", True)


def test_what_a_person_is_told_to_type_names_the_pages_graph() -> None:
    site = LiveSite(("--domain-id", "7"))
    for n in range(9):
        state = d.LiftState(stamp(WALL + n), "Lift1", ("L1",), "L1", session_id="fleet/red")
        site.take(heard(float(n), topics.LIFT_STATES, state))
    told = site.explain("lift", "Lift1", 9.0, WALL + 9.0, {})
    assert told is not None
    assert [step.what.split("`")[1] for step in told.next] == [
        "rmf-bridge release Lift1 --domain-id 7"
    ]

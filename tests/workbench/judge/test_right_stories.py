"""Stories that look wrong and are right, and the wrong stories beside them. What nobody can know
convicts no node and acquits none."""

from collections.abc import Callable

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from tests.workbench.judge.test_adapter_occasions import (
    alive,
    arrives,
    fleet,
    lists,
    many,
    opens,
    rides,
)
from tests.workbench.judge.test_adapter_occasions import asks as robot_wants
from tests.workbench.judge.test_adapter_occasions import ends as robot_ends
from tests.workbench.judge.test_limits import (
    AGV,
    ASSIGNED,
    BLUE,
    CHARGING,
    CLOSED,
    FIRE,
    IDLE,
    NAMES,
    NODE,
    OPEN,
    RED,
    Line,
    asks,
    cancel,
    car,
    charge,
    ends,
    held,
    leaf,
    seconds,
    station,
    to_door,
)
from workbench.judge.judge import Judge, JudgedKind

HUMAN, OFFLINE, UNKNOWN = 1, 4, 0
Lines = list[Line]


def judged(kind: JudgedKind, law: str, lines: Lines, end_s: float = 0.0) -> str:
    """Return the verdict on a law, `end_s` seconds after the last message."""
    judge = Judge(kind, NAMES.get(kind, "fleet"), only=[law])
    lines = sorted(lines, key=lambda line: line[0])
    for at, topic, message in lines:
        judge.hear(Heard(at, at, topic.name, message, None if kind == "adapter" else NODE))
    last = lines[-1][0] + end_s
    [found] = judge.end(last, last)
    return found.verdict.value


# ---- lifts


@pytest.mark.parametrize(
    ("mode", "found"), [(AGV, "broken"), (HUMAN, "broken"), (UNKNOWN, "not seen")]
)
def test_a_lift_whose_mode_is_unknown_owes_nobody_a_session(mode: int, found: str) -> None:
    lines = [*seconds(0.0, 45.0, lambda s: car(s, mode=mode)), *seconds(2.0, 42.0, asks)]
    assert judged("lift", "L4.grants", lines) == found


def shuts(asked_until: float, mode: int = AGV) -> Lines:
    """Return messages in which the door is OPEN for 4 s and shut for 6 s, again and again."""

    def shown(s: float) -> Line:
        opened = int(s - 2) % 10 < 4
        return held(s, to="L1", door=OPEN if opened else CLOSED, mode=AGV if opened else mode)

    asked = seconds(1.2, asked_until, lambda s: asks(s, floor="L1"))
    left = [asks(62.5), *seconds(63.0, 65.0, held)]
    return [car(0.0), car(1.0), *asked, *seconds(2.0, 62.0, shown), *left]


@pytest.mark.parametrize(
    ("lines", "found"),
    [
        (shuts(62.0), "broken"),
        (shuts(62.0, HUMAN), "not seen"),
        (shuts(62.0, FIRE), "not seen"),
        (shuts(2.0), "not seen"),
    ],
)
def test_a_door_may_close_only_outside_agv_mode_or_for_a_silent_robot(
    lines: Lines, found: str
) -> None:
    assert judged("lift", "L7.holds", lines) == found


def test_a_stamp_of_0_is_no_step_back() -> None:
    def flaps(s: float) -> Line:
        read_at = -1e3 if int(s) % 4 == 3 else s
        return car(s, mode=AGV if read_at == s else OFFLINE, read_at=read_at)

    assert judged("lift", "B0.one", [*seconds(0.0, 20.0, flaps)]) == "not seen"


def test_a_recording_without_lift_requests_tells_nothing_of_sessions() -> None:
    lines = [
        *seconds(0.0, 5.0, car),
        *seconds(5.0, 9.0, lambda s: held(s, to="L3")),
        *seconds(9.0, 15.0, car),
    ]
    assert judged("lift", "L4.own", lines) == "not seen"
    assert judged("lift", "L4.ends", lines[6:]) == "not seen"
    assert judged("lift", "L4.own", [*lines, asks(0.5, BLUE)]) == "broken"


@pytest.mark.parametrize(("read_at", "found"), [(3.0, "not seen"), (1.0, "broken")])
def test_a_link_that_flaps_may_hide_the_state_that_grants(read_at: float, found: str) -> None:
    granted = held(3.0, mode=OFFLINE, read_at=read_at)
    lines = [car(0.0), car(1.0, mode=OFFLINE), asks(1.5), granted]
    assert judged("lift", "L10.grant", lines) == found


@pytest.mark.parametrize("silent_s", [50.0, 0.5])
def test_a_doubt_at_the_end_of_the_network_is_no_breach(silent_s: float) -> None:
    ride = [
        *(car(0.0), car(1.0), asks(1.5), *seconds(2.0, 9.0, lambda s: held(s, to="L3"))),
        car(9.0),
    ]
    assert judged("lift", "L4.ends", ride, silent_s) == "not seen"
    assert judged("lift", "L4.ends", [*ride, *seconds(60.0, 62.0, car)]) == "not seen"
    assert judged("lift", "L4.ends", [*ride, *seconds(10.0, 12.0, car)]) == "broken"


# ---- doors


def passages(times: int, *later: Callable[[float], Line]) -> Lines:
    """Return passages of a door without MOVING. No CLOSE is heard."""
    lines: Lines = []
    for n in range(times):
        at = 20.0 * n
        lines += [*seconds(at, at + 2, leaf), to_door(at + 1.5)]
        lines += [
            *seconds(at + 2, at + 10, lambda s: leaf(s, OPEN)),
            *seconds(at + 10, at + 20, leaf),
        ]
        lines += [line(at + 10.2) for line in later]
    return lines


def test_one_lost_close_convicts_no_door() -> None:
    assert judged("door", "D2.stays", passages(1)) == "not seen"
    assert judged("door", "D2.stays", passages(1, to_door)) == "broken", "RMF still holds it"
    assert judged("door", "D2.stays", passages(2)) == "broken"


# ---- chargers


def turns(*lines: Line, state: int = CHARGING, to: int = ASSIGNED) -> Lines:
    """Return states of a station that shows r1 until 8 s, and r2 of another robot from 10 s on."""

    def blue(at: float) -> Line:
        at, topic, shown = station(at, to, "r2")
        return at, topic, replace(shown, robot_name="blue")

    shown = [station(2.0 * n, state, "r1") for n in range(1, 5)]
    return [station(0.0, IDLE), charge(0.5, 0), *shown, *lines, *map(blue, (10.0, 12.0, 14.0))]


def rival(at: float) -> Line:
    request = d.ChargerRequest("bay1", "fleet", "blue", d.Duration(20), "r2")
    return at, topics.CHARGER_REQUESTS, request


@pytest.mark.parametrize(
    ("lines", "found"),
    [
        (turns(cancel(8.3), rival(9.0)), "not seen"),
        (turns(cancel(8.3), rival(9.0), to=CHARGING), "not seen"),
        (turns(rival(9.0)), "not seen"),
        (turns(rival(9.0), to=CHARGING), "broken"),
        (turns(rival(9.0), cancel(10.2), state=ASSIGNED), "not seen"),
        (turns(rival(9.0), state=ASSIGNED), "broken"),
    ],
)
def test_a_station_may_have_been_freed_between_two_states(lines: Lines, found: str) -> None:
    assert judged("charger", "C1.keeps", lines) == found


def test_the_request_for_this_station_may_come_after_the_state() -> None:
    at, topic, request = charge(0.5)
    lines = [
        *(station(0.0, IDLE), (at, topic, replace(request, charger_name="bay2"))),
        *(station(5.0, ASSIGNED, "r1"), charge(5.1), station(7.0, ASSIGNED, "r1")),
    ]
    assert judged("charger", "C5.robot", lines) == "kept"


def test_a_text_of_spaces_is_blank() -> None:
    at, topic, state = station(0.0, 200, "r1")
    assert (
        judged("charger", "C5.text", [(at, topic, replace(state, error_message=" "))]) == "broken"
    )


# ---- fleet adapters: repeats

LIFT: Lines = [*alive(70.0), *many(0, 70, car)]
DOOR: Lines = [*alive(70.0), *many(0, 70, leaf)]


@pytest.mark.parametrize(
    ("law", "lines", "found"),
    [
        ("A7.repeats", [*LIFT, *many(5.5, 8, robot_wants)], "not seen"),
        ("A7.repeats", [*LIFT, *(robot_wants(5.5 + 5 * n) for n in range(12))], "broken"),
        ("A7.repeats", [*LIFT, *(robot_wants(5.5 + 3 * n) for n in range(12))], "not seen"),
        ("A7.repeats", [*LIFT, robot_wants(20.5), robot_wants(50.5)], "not seen"),
        ("A8.repeats", [*DOOR, *(opens(5.5 + 3.4 * n) for n in range(12))], "broken"),
        ("A8.repeats", [*DOOR, *(opens(5.5 + 5 * n) for n in range(12))], "broken"),
        ("A8.repeats", [*DOOR, *(opens(5.5 + 0.01 * n) for n in range(3))], "not seen"),
        (
            "A8.repeats",
            [
                *DOOR,
                *(opens(at + n / 100) for at in (5, 35) for n in range(3)),
                opens(25, 0),
                opens(60, 0),
            ],
            "broken",
        ),
    ],
)
def test_who_does_not_repeat_is_not_acquitted(law: str, lines: Lines, found: str) -> None:
    assert judged("adapter", law, lines) == found


def test_without_the_heartbeat_nobody_knows_whether_the_robot_still_waits() -> None:
    passes = [line for at in (5.0, 26.0, 50.0) for line in (opens(at + 0.5), opens(at + 12, 0))]
    lines = [*alive(70.0), *many(0, 70, lambda s: leaf(s, OPEN)), *passes]
    assert judged("adapter", "A8.repeats", lines) == "not seen"


# ---- fleet adapters: rides


def turned(*more: Line) -> Lines:
    return rides(robot_wants(15.5, "L1"), *many(15.0, 22.0, held), *more)


def at_lift2(at: float, mode: int = AGV) -> Line:
    at, topic, state = car(at, mode=mode)
    return at, topic, replace(state, lift_name="Lift2")


def blue_asks(at: float) -> Line:
    at, topic, request = robot_wants(at, "L1", BLUE)
    return at, topic, replace(request, lift_name="Lift2")


def test_only_the_hazard_of_the_robots_own_lift_excuses_it() -> None:
    in_fire = [*many(0.0, 23.0, lambda s: at_lift2(s, FIRE)), blue_asks(15.5001)]
    assert judged("adapter", "A7.rides", turned(*in_fire)) == "broken"
    excused = rides(robot_wants(15.5, "L1"), *many(16.0, 23.0, lambda s: held(s, mode=FIRE)))
    other = [*many(0.0, 23.0, at_lift2), *(blue_asks(15.6 + 0.2 * n) for n in range(20))]
    assert judged("adapter", "A7.rides", [*excused, *other]) == "not seen"


def later(lines: Lines, by_s: float) -> Lines:
    return [(at + by_s, topic, message) for at, topic, message in lines]


@pytest.mark.parametrize(("ends_at", "found"), [(None, "not seen"), (10.0, "broken")])
def test_an_alarm_excuses_a_change_of_floor_as_long_as_it_lasts(
    ends_at: float | None, found: str
) -> None:
    alarm = [(0.05, topics.FIRE_ALARM_TRIGGER, d.Bool(True))]
    over = [(ends_at, topics.FIRE_ALARM_TRIGGER, d.Bool(False))] if ends_at else []
    lines: Lines = [*alarm, *over, *many(0, 79, car), *later(turned(), 80.0)]
    assert judged("adapter", "A7.rides", lines) == found


def test_two_panels_that_repeat_their_all_clear_are_no_alarm() -> None:
    signals = [d.EmergencySignal((f"f{n % 2}",), False) for n in range(30)]
    clear = [(n + 0.01, topics.EMERGENCY_SIGNAL, one) for n, one in enumerate(signals)]
    assert judged("adapter", "A7.rides", turned(*clear)) == "broken"


def test_a_robot_that_joins_its_fleet_may_ask_before_the_fleet_lists_it() -> None:
    joins = [*many(0.1, 9.5, lambda s: fleet(s, robot="blue")), opens(10.0), opens(10.5)]
    both = d.FleetState("fleet", (d.RobotState(name="blue"), d.RobotState(name="red")))
    listed = [(10.4, topics.FLEET_STATES, both)]
    lines = [*many(0, 20, leaf), *joins]
    assert judged("adapter", "A7.id", [*lines, *listed]) == "kept"
    assert judged("adapter", "A7.id", lines) == "broken"


def test_an_end_of_an_unknown_node_starts_no_count_of_missing_ends() -> None:
    end = robot_ends(17.0)
    assert judged("adapter", "A7.again", [*arrives(30.0), end, *alive(30.0)]) == "not seen"
    assert judged("adapter", "A7.again", [*arrives(90.0), end, *alive(90.0)]) == "broken"


# ---- fleet adapters: doors


def stands_open(until: float, *more: Line) -> Lines:
    """Return messages in which the door opens for RED at 6 s."""
    shown = many(6, until, lambda s: leaf(s, OPEN))
    listed = many(5.6, until, lambda s: lists(s, RED))
    return [*alive(until), *many(0, 6, leaf), opens(5.5), *shown, *listed, *more]


def test_another_open_before_the_held_door_is_no_passage() -> None:
    again = opens(15.5), opens(25.5)
    assert judged("adapter", "A8.closes", stands_open(60.0, *again, opens(50.0, 0))) == "kept"
    away = [robot_wants(at) for at in (10.5, 20.5)]
    assert judged("adapter", "A8.closes", stands_open(60.0, *again, *away)) == "broken"


def test_a_robot_may_ask_for_a_door_that_is_no_longer_open_for_it() -> None:
    shut = [*alive(90.0), *many(0, 6, leaf), *many(7, 90, leaf), *many(5.5, 90, opens)]
    forgets = [lists(6.05, RED), leaf(6.1, OPEN), lists(6.5)]
    assert judged("adapter", "A8.stops", [*shut, *forgets]) == "not seen"


@pytest.mark.parametrize(("for_s", "found"), [(3.0, "kept"), (12.0, "broken")])
def test_open_is_not_repeated_passage_after_passage(for_s: float, found: str) -> None:
    lines: Lines = []
    for at in (5.0, 75.0):
        opened = many(at, at + 60, lambda s: leaf(s, OPEN))
        lines += [*opened, *many(at + 0.5, at + for_s, opens), lists(at + 0.6, RED)]
        lines += [opens(at + 57.0, 0), *many(at + 60, at + 70, leaf)]
    assert judged("adapter", "A8.stops", lines) == found


def test_the_robots_own_end_after_a_late_state_excuses_the_lift() -> None:
    ride = [car(0.0), car(1.0), asks(1.5), *seconds(2.0, 9.0, held), car(9.0), ends(9.3)]
    assert judged("lift", "L4.ends", [*ride, *seconds(10.0, 13.0, car)]) != "broken"

"""The laws for fleet adapters. Each law has an occasion: the event at which a wrong adapter would break
the law. If the messages contain no such event, the verdict is "not seen"."""

from collections.abc import Callable, Iterable

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard, Sender
from bridges.messages.stamps import stamp
from tests.workbench.judge.script import door, lift
from tests.workbench.judge.test_limits import OPEN, RED, Line, car, held, leaf, seconds
from workbench.judge.judge import LAWS, Judge
from workbench.judge.law import Verdict

BLUE = "fleet/blue"
Lines = list[Line]


def verdict(law: str, lines: Lines, name: str = "fleet") -> tuple[str, str]:
    """Return the verdict on a law, and the text of the first evidence."""
    judge = Judge("adapter", name, only=[law])
    lines = sorted(lines, key=lambda line: line[0])
    for at, topic, message in lines:
        judge.hear(Heard(at, at, topic.name, message))
    last = lines[-1][0]
    [found] = judge.end(last, last)
    return found.verdict.value, found.evidence[0].text if found.evidence else ""


def broken(lines: Iterable[Heard], name: str = "fleet") -> set[str]:
    """Return the laws that this adapter breaks."""
    judge = Judge("adapter", name)
    told = sorted(lines, key=lambda one: one.at)
    for one in told:
        judge.hear(one)
    last = told[-1].at
    return {one.law.id for one in judge.end(last, last) if one.verdict is Verdict.BROKEN}


def asks(at: float, floor: str = "L1", who: str = RED, clock_s: float = 1e3, **fields: int) -> Line:
    request = replace(lift(who, floor), request_time=stamp(clock_s + at), **fields)
    return at, topics.ADAPTER_LIFT_REQUESTS, request


def ends(at: float) -> Line:
    return at, topics.ADAPTER_LIFT_REQUESTS, lift(RED, "", kind=0)


def opens(at: float, mode: int = OPEN, late_s: float = 0.0) -> Line:
    request = replace(door(mode, RED), request_time=stamp(1e3 + at - late_s))
    return at, topics.ADAPTER_DOOR_REQUESTS, request


def lists(at: float, *who: str) -> Line:
    sessions = d.DoorSessions("ward", tuple(d.Session(stamp(at), one) for one in who))
    return at, topics.DOOR_SUPERVISOR_HEARTBEAT, d.SupervisorHeartbeat((sessions,))


def fleet(at: float, task: str = "1", robot: str = "red") -> Line:
    states = (d.RobotState(name=robot, task_id=task),)
    return at, topics.FLEET_STATES, d.FleetState("fleet", states)


def many(begin: float, end: float, line: Callable[[float], Line]) -> Lines:
    return [*seconds(begin, end, line)]


def alive(until: float, **robot: str) -> Lines:
    return many(0.1, until, lambda s: fleet(s, **robot))


def boards(open_at: float = 8.0, until: float = 12.0) -> Lines:
    """Return messages in which RED boards at L1.

    RED asks from 5.5 s on and has the lift from 6 s on. OPEN at L1 begins at `open_at`.
    """
    return [
        *many(0.0, 6.0, car),
        *many(5.5, until, asks),
        *many(6.0, open_at, lambda s: held(s, floor="L3")),
        *many(open_at, until, lambda s: held(s, door=OPEN)),
    ]


def rides(*more: Line) -> Lines:
    """Return messages in which RED boards, and then asks for L3 from 12.5 s on."""
    return [*boards(), *many(12.5, 15.0, lambda s: asks(s, "L3")), held(13.0), held(14.0), *more]


def arrives(until: float = 18.0) -> Lines:
    return rides(*many(15.0, until, lambda s: held(s, floor="L3", door=OPEN)))


def passes(at: float, *, closes: bool = True) -> Lines:
    """Return messages in which RED passes the door within 10 s."""
    way = [leaf(at), opens(at + 0.5), lists(at + 0.6, RED)]
    stands_open = many(at + 1.0, at + 9.0, lambda s: leaf(s, OPEN))
    return [*way, *stands_open, *([opens(at + 8.0, 0)] if closes else [])]


STORIES: dict[str, tuple[Lines, Lines, Lines]] = {
    "T1.numbers": (many(0, 5, car), boards(), [*boards(), asks(13.0, request_type=2)]),
    "A7.id": (
        boards(),
        [*boards(), *alive(13.0)],
        [*boards(), *alive(13.0, robot="robot_1")],
    ),
    "A7.stamp": (
        [car(0.0), asks(0.5)],
        boards(),
        [*passes(5.0), opens(15.0), opens(16.0, 0, 9.0), opens(17.0), opens(18.0, 0, 9.0)],
    ),
    "A7.floor": ([asks(0.5), asks(1.5)], boards(), [*boards(), asks(12.5, "l3")]),
    "A7.repeats": (
        [*many(0, 30, car), asks(5.5)],
        boards(),
        [
            *(*alive(40.0), *many(0.0, 6.0, car), asks(5.5)),
            *many(6.0, 13.0, lambda s: held(s, floor="L3")),
            *(held(13.0, door=OPEN), asks(14.5, "L3"), *many(14.0, 30.0, held)),
        ],
    ),
    "A7.enters": (
        boards(),
        rides(),
        [*boards(30.0), *many(12.5, 20.0, lambda s: asks(s, "L3")), held(21.0)],
    ),
    "A7.rides": (rides(), arrives(), rides(asks(15.5, "L2"), *many(15.0, 22.0, held))),
    "A7.ends": (
        [*arrives(), car(19.0)],
        [*arrives(), ends(18.5)],
        [*arrives(90.0), *alive(90.0)],
    ),
    "A7.again": (
        [*arrives(), ends(18.5), car(19.0)],
        [*arrives(20.0), ends(18.5), ends(19.5)],
        [*arrives(90.0), ends(18.5), *alive(90.0)],
    ),
    "A7.stops": (
        [*arrives(), ends(18.5), car(19.0)],
        [*arrives(), ends(18.5), *many(19.0, 25.0, car)],
        [*arrives(), *many(18.5, 28.0, ends), *many(19.0, 28.0, car)],
    ),
    "A8.repeats": (
        [*many(0, 30, leaf), opens(5.5)],
        [*many(0, 12, leaf), *many(5.5, 12, opens), lists(11.6, RED), leaf(12.0, OPEN)],
        [*alive(40.0), *many(0, 40, leaf), opens(5.5), opens(20.5, 0), opens(22.5), opens(39.5, 0)],
    ),
    "A8.closes": (
        passes(5.0, closes=False),
        passes(5.0),
        [line for at in (5.0, 17.0, 29.0) for line in passes(at, closes=False)],
    ),
    "A8.stops": (
        passes(5.0, closes=False),
        passes(5.0),
        [*passes(5.0, closes=False), *many(6.5, 70.0, opens)],
    ),
}


@pytest.mark.parametrize("law", STORIES)
def test_a_law_needs_its_occasion(law: str) -> None:
    found = [verdict(law, story)[0] for story in STORIES[law]]
    assert found == ["not seen", "kept", "broken"]


def test_every_law_has_its_stories() -> None:
    assert list(STORIES) == [law.id for law in LAWS["adapter"]]


@pytest.mark.parametrize(
    ("law", "lines", "thread"),
    [
        ("A7.enters", STORIES["A7.enters"][2], "rmf_ros2#389"),
        ("A7.rides", rides(asks(15.5, "L1"), *many(15.0, 22.0, held)), "rmf_ros2#555"),
        ("A7.stops", STORIES["A7.stops"][2], "rmf_ros2#382, #415"),
    ],
)
def test_a_known_defect_of_rmf_is_named_by_its_thread(law: str, lines: Lines, thread: str) -> None:
    found, text = verdict(law, lines)
    assert (found, thread in text) == ("broken", True), text


@pytest.mark.parametrize(
    "excuse",
    [
        *([fleet(14.0)], [fleet(14.0, "1"), fleet(16.5, "2")]),
        [(15.0, topics.FIRE_ALARM_TRIGGER, d.Bool(True))],
        [(15.0, topics.EMERGENCY_SIGNAL, d.EmergencySignal((), True))],
        [held(15.2, mode=3)],
    ],
)
def test_another_task_or_an_alarm_excuses_another_floor_on_the_ride(excuse: Lines) -> None:
    lines = rides(asks(15.5, "L2"), *many(16.0, 22.0, lambda s: held(s, mode=3 if s < 0 else 2)))
    assert verdict("A7.rides", [*lines, *excuse])[0] == "not seen"


def test_a_state_that_arrives_late_excuses_the_entry() -> None:
    lines = [*boards(13.2, 13.0), asks(13.1, "L3"), held(13.2, door=OPEN)]
    assert verdict("A7.enters", lines)[0] == "not seen"


def test_retained_requests_of_yesterday_are_no_new_ones() -> None:
    again = [(20.0, topic, message) for _, topic, message in rides() if "adapter" in topic.name]
    for law in ("A7.stamp", "A7.rides", "A7.enters"):
        assert verdict(law, [*rides(), *again, car(21.0)])[0] != "broken"


def test_one_robot_is_judged_by_its_own_requests() -> None:
    wrong = [asks(12.5, "l3", BLUE)]
    assert verdict("A7.floor", [*boards(), *wrong])[0] == "broken"
    assert verdict("A7.floor", [*boards(), *wrong], RED)[0] == "kept"


# ---- the adapter, or a dashboard: rmf-web sends END for every robot that it knows

ADAPTER, WEB = Sender("/fleet_adapter"), Sender("/rmf_web")


def sent(lines: Lines, by: Sender | None = None) -> list[Heard]:
    """Return these messages, with their publisher. None: the wire or the recording does not name it."""
    return [Heard(at, at, topic.name, message, by) for at, topic, message in lines]


def end_of(at: float, who: str = RED, clock_s: float = 1e3) -> Line:
    request = replace(lift(who, "", kind=0), request_time=stamp(clock_s + at))
    return at, topics.ADAPTER_LIFT_REQUESTS, request


DAY: Lines = [*many(0.0, 80.0, car), *alive(80.0)]
RIDE: Lines = [*arrives(), ends(18.5), *many(19.0, 80.0, car), *alive(80.0)]


def test_an_end_for_a_robot_that_is_gone_is_no_id_of_the_adapter() -> None:
    pressed = [end_of(30.0, "fleet/old"), end_of(30.0), end_of(30.0, "other/old")]
    assert broken(sent([*DAY, *pressed])) == set()
    asked = [asks(30.0, "L1", "fleet/old"), *pressed]
    assert broken(sent([*DAY, *asked])) == {"A7.id"}


def test_a_persons_presses_do_not_add_up_to_an_adapter_that_ends_for_ever() -> None:
    pressed = [end_of(10.0 + 8.0 * n) for n in range(8)]
    assert broken(sent([*DAY, *pressed])) == set()
    repeated = [end_of(10.0 + 2.0 * n) for n in range(8)]
    assert broken(sent([*DAY, *repeated])) == {"A7.stops"}


def test_on_a_wire_that_names_publishers_only_the_adapters_own_requests_count() -> None:
    repeated = many(30.0, 40.0, end_of)
    ride = sent(RIDE, ADAPTER)
    assert broken([*ride, *sent(repeated, WEB)]) == set()
    assert broken([*ride, *sent(repeated, ADAPTER)]) == {"A7.stops"}
    assert broken([*ride, *sent(repeated, Sender())]) == {"A7.stops"}, "not yet discovered"


def test_a_close_that_a_person_sends_for_a_robot_does_not_acquit_its_adapter() -> None:
    times = (5.0, 17.0, 29.0)
    passages = [line for at in times for line in passes(at, closes=False)]
    closes = [opens(at + 8.5, 0) for at in times]
    assert broken(sent([*passages, *closes], ADAPTER)) == set()
    assert broken([*sent(passages, ADAPTER), *sent(closes, WEB)]) == {"A8.closes"}


def test_a_person_who_asks_in_a_robots_name_is_not_its_adapter() -> None:
    asked = [opens(70.0), *many(71.0, 79.0, end_of)]
    assert broken([*sent(RIDE, ADAPTER), *sent(asked, Sender("/rmf_bridge_send"))]) == set()


def test_the_clock_of_a_dashboard_is_not_the_adapters() -> None:
    pressed = [end_of(at, clock_s=5e3) for at in (7.2, 9.2, 25.0)]
    lines = [*RIDE, *many(19.5, 30.0, asks), *pressed]
    for one in (sent(lines), [*sent(lines[: -len(pressed)], ADAPTER), *sent(pressed, WEB)]):
        assert "A7.stamp" not in broken(one)


def test_a_clock_that_is_set_back_once_convicts_no_adapter_though_both_kinds_go_back() -> None:
    def back_s(at: float) -> float:
        return 3600.0 if at > 50.0 else 0.0

    def at_lift(at: float) -> Line:
        return asks(at, clock_s=1e4 - back_s(at))

    lines = [
        *(*DAY, *many(20.0, 25.0, at_lift), *many(60.0, 65.0, at_lift)),
        *(opens(at, mode, back_s(at)) for at, mode in ((10.0, 2), (11.0, 0), (55.0, 2), (56.0, 0))),
    ]
    assert verdict("A7.stamp", lines)[0] == "kept"


@pytest.mark.parametrize(("apart_s", "wrong"), [(29.0, True), (31.0, False)])
def test_stamps_that_go_back_twice_count_only_within_half_a_minute(
    apart_s: float, wrong: bool
) -> None:
    steps = [(0.0, 0.0), (20.0, 30.0), (20.0 + apart_s, 90.0)]
    lines = [*DAY, *(opens(at, 2, late_s) for at, late_s in steps)]
    assert (verdict("A7.stamp", lines)[0] == "broken") == wrong


@pytest.mark.parametrize("returns_at", [80.1, 60.1])
def test_an_adapter_that_has_restarted_without_a_robot_cannot_end_its_session(
    returns_at: float,
) -> None:
    """The robot was switched off while it had the lift. From its return on, its adapter is to blame."""
    lines = [
        *arrives(140.0),
        *many(0.1, 20.0, fleet),
        *many(30.1, returns_at, lambda s: fleet(s, robot="blue")),
    ]
    assert broken(sent(lines)) == set()
    back = many(returns_at, 140.0, fleet)
    assert broken(sent([*lines, *back])) == ({"A7.ends"} if returns_at < 70.0 else set())

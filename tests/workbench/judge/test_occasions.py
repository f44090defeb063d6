"""The laws and their occasions. An occasion is the event at which a wrong node would break the law.
Without an occasion the verdict is "not seen". With an occasion a correct node keeps the law, and a
wrong node breaks it."""

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from msgspec.structs import replace

from bridges.messages import topics, words
from bridges.messages.definitions import Bool
from bridges.messages.heard import Heard, Sender
from tests.workbench.judge.test_limits import (
    ASSIGNED,
    BLUE,
    CHARGING,
    CLOSED,
    FIRE,
    IDLE,
    NAMES,
    OPEN,
    Line,
    answered,
    asked_for_long,
    asks,
    cancel,
    car,
    charge,
    ends,
    flaps,
    frozen,
    held,
    leaf,
    open_at_once,
    pushed,
    reopens,
    robot_asks,
    robot_closes,
    seconds,
    station,
    stays_shut,
    to_door,
)
from tests.workbench.judge.workcell_stories import WorkcellLines, stories
from workbench.judge.judge import LAWS, Judge, JudgedKind

LIFTS, PANEL = Sender("/lift_node"), Sender("/fire_panel")
ERROR, RELEASED = 200, 4
HUMAN, OFFLINE = 1, 4
NEVER_READ = -1e3
Look = Callable[[Judge], None]
Lines = list[Line | Look]


def senders(*names: str) -> Look:
    """Return a function that tells the judge which nodes publish the states."""

    def look(judge: Judge) -> None:
        judge.history.senders = names

    return look


def fire_publisher(retaining: int) -> Look:
    """Return a function that tells the judge twice which nodes publish the fire alarm. `retaining`
    tells whether the publisher retains its message."""

    def look(judge: Judge) -> None:
        judge.history.senders = ("/a",)
        for _ in range(2):
            judge.alarm_ends(["/a", "/b"], ["/a"] * retaining, 0.0, 0.0)

    return look


def verdict(kind: JudgedKind, law: str, lines: Lines) -> str:
    judge = Judge(kind, NAMES[kind], only=[law])
    told = sorted((line for line in lines if isinstance(line, tuple)), key=lambda line: line[0])
    for look in lines:
        if not isinstance(look, tuple):
            look(judge)
    by: list[Sender]
    for at, topic, message, *by in told:
        judge.hear(Heard(at, at, topic.name, message, *by))
    last = told[-1][0]
    [found] = judge.end(last, last)
    return found.verdict.value


FALSES = ((1.0, False), (2.0, False), (3.0, False))


def moving(at: float, door: int = CLOSED) -> Line:
    at, topic, state = car(at, door=door)
    return at, topic, replace(state, motion_state=1)


def alarms(*lines: tuple[float, bool], by: Sender | None = LIFTS) -> Lines:
    """Return a state of the lift's node, and alarm messages of the node `by`."""
    state: Any = (*car(0.0), LIFTS)
    return [state, *((at, topics.FIRE_ALARM_TRIGGER, Bool(on), by) for at, on in lines)]


def twins(line: Callable[[float], Line]) -> Lines:
    """Return the states of two nodes. The second node publishes 0.3 s after the first."""
    return [senders("/a", "/b"), *(line(n + by) for n in range(8) for by in (0.0, 0.3))]


def cars(until: float = 12.0) -> Lines:
    return [*seconds(0.0, until, car)]


def leaves(until: float = 12.0, mode: int = CLOSED) -> Lines:
    return [*seconds(0.0, until, lambda s: leaf(s, mode))]


def bay(until: float, state: int = IDLE, request_id: str = "", begin: float = 0.0) -> Lines:
    return [*seconds(begin, until, lambda s: station(s, state, request_id))]


def rides(*more: Line, until: float = 6.0, **state: Any) -> Lines:
    """Return messages in which RED asks at 0.5 s, and has the lift from 1 s on."""
    return [car(0.0), asks(0.5), *seconds(1.0, until, lambda s: held(s, **state)), *more]


def opens(*more: Line, until: float = 8.0) -> Lines:
    """Return messages in which RMF requests OPEN at 0.5 s, and the door shows OPEN from 3 s on."""
    way = [leaf(0.0), to_door(0.5), leaf(1.0), leaf(2.0, 1)]
    return [*way, *seconds(3.0, until, lambda s: leaf(s, OPEN)), *more]


def served(*more: Line, until: float = 6.0, state: int = ASSIGNED) -> Lines:
    """Return messages in which RMF requests r1 at 0.5 s, and the charger serves r1 from 1 s on."""
    return [station(0.0, IDLE), charge(0.5), *bay(until, state, "r1", 1.0), *more]


def changed(line: Line, **fields: object) -> Line:
    at, topic, message = line
    return at, topic, replace(message, **fields)


BOARDS: dict[str, Any] = {"to": "L1", "door": OPEN}
RIVAL = changed(charge(2.5), request_id="r2", robot_name="blue")
ELSEWHERE = changed(charge(0.5), charger_name="bay2")
ASKED = [asks(8.5 + n) for n in range(8)]
TO_FIRE: Lines = [*seconds(0.0, 8.0, lambda s: car(s, mode=FIRE))]

STORIES: dict[tuple[JudgedKind, str], tuple[Lines, Lines, Lines]] = {
    ("lift", "L2.rate"): ([car(0.0)], cars(2.0), [car(0.0), car(6.0)]),
    ("lift", "L2.answer"): (
        cars(20.0),
        [*cars(20.0), *ASKED],
        [*cars(), *(car(12.0 + i / 100) for i in range(21))],
    ),
    ("lift", "B0.one"): (cars(), [senders("/a"), *cars()], twins(car)),
    ("lift", "L3.stamp"): (
        [car(0.0, mode=OFFLINE, read_at=NEVER_READ)],
        [car(0.0)],
        [car(0.0, read_at=NEVER_READ)],
    ),
    ("lift", "T1.numbers"): ([asks(0.0)], [car(0.0)], [car(0.0, door=3)]),
    ("lift", "L1.other"): (
        rides(),
        [*cars(6.0), asks(1.5, lift="Lift2")],
        [*cars(3.0), asks(1.5, lift="Lift2"), *seconds(3.0, 6.0, held)],
    ),
    ("lift", "L1.bypass"): (
        [*rides(), asks(0.2, BLUE, lift="Lift2"), robot_asks(0.4)],
        [*cars(6.0), asks(0.2, BLUE, lift="Lift2"), robot_asks(1.5)],
        [*cars(3.0), asks(0.2, BLUE, lift="Lift2"), robot_asks(1.5), *seconds(3.0, 6.0, held)],
    ),
    ("lift", "L4.own"): (
        cars(6.0),
        rides(),
        [*cars(4.0), asks(0.5, BLUE), *seconds(4.0, 7.0, held)],
    ),
    ("lift", "L4.grants"): (cars(6.0), rides(), [*asked_for_long(31.5)]),
    ("lift", "L5.ends"): (
        rides(ends(5.5, floor="L1"), car(6.0)),
        rides(ends(5.5), car(6.0)),
        rides(ends(1.5)),
    ),
    ("lift", "L5.foreign"): (
        rides(ends(5.5), car(6.0)),
        rides(ends(4.5, BLUE)),
        rides(ends(5.5, BLUE), car(6.0), car(8.0)),
    ),
    ("lift", "L4.ends"): (
        rides(ends(5.5), car(6.0)),
        rides(held(6.0, floor="L3"), held(7.0, floor="L3")),
        rides(car(6.0), car(8.0)),
    ),
    ("lift", "L7.stopped"): (
        [car(0.0, door=OPEN)],
        [car(0.0), moving(1.0)],
        [car(0.0), moving(1.0, OPEN)],
    ),
    ("lift", "L7.floor"): (cars(), [car(0.0, door=OPEN)], [car(0.0, door=OPEN, floor="")]),
    ("lift", "L7.jump"): (
        [*seconds(0.0, 6.0, lambda s: car(s, door=OPEN))],
        [car(0.0), car(1.0, door=OPEN), car(3.0), car(5.0, door=OPEN, floor="L3")],
        [car(0.0), car(1.0, door=OPEN), car(2.0, door=OPEN, floor="L3")],
    ),
    ("lift", "L7.fresh"): (
        [car(0.0), *seconds(1.0, 6.0, lambda s: car(s, door=OPEN)), car(6.0)],
        [*seconds(0.0, 8.0, lambda s: car(s, door=OPEN))],
        [*frozen(car, OPEN, 6.0)],
    ),
    ("lift", "L7.agv"): (rides(), rides(**BOARDS), rides(**BOARDS, mode=HUMAN)),
    ("lift", "L7.holds"): (
        [car(0.0), asks(0.5, floor="L1"), held(1.0, **BOARDS), held(2.0)],
        rides(asks(0.6, floor="L1"), asks(5.5), held(6.0, to="L3"), **BOARDS),
        [*reopens(3, 8.0, 0.5)],
    ),
    ("lift", "L8.floor"): ([car(0.0, floor="")], [car(0.0)], [car(0.0, floor="L9")]),
    ("lift", "L8.destination"): (rides(), rides(to="L3"), rides(to="L1")),
    ("lift", "L9.unserved"): (
        rides(to="L3"),
        rides(asks(2.5, floor="L9")),
        rides(asks(2.5, floor="L9"), held(6.0, to="L9")),
    ),
    ("lift", "L10.board"): (
        rides(),
        rides(mode=FIRE),
        rides(asks(0.6, floor="L1"), mode=FIRE, **BOARDS),
    ),
    ("lift", "L10.grant"): (
        TO_FIRE,
        [*TO_FIRE, asks(2.5)],
        [*TO_FIRE, asks(7.5), held(8.0, mode=FIRE)],
    ),
    ("lift", "L12.false"): (
        alarms((1.0, False), (2.0, True)),
        alarms((1.0, True), (2.0, False)),
        alarms(*FALSES),
    ),
    ("lift", "L12.retained"): (
        cars(),
        [*cars(), fire_publisher(retaining=1)],
        [*cars(), fire_publisher(retaining=0)],
    ),
    ("door", "D1.rate"): ([leaf(0.0)], leaves(2.0), [leaf(0.0), leaf(6.0)]),
    ("door", "D1.answer"): (
        leaves(20.0),
        [*leaves(20.0), *(to_door(8.5 + n) for n in range(8))],
        [*answered(8, 0.4, 0.05)],
    ),
    ("door", "B0.one"): (leaves(), [senders("/a"), *leaves()], twins(leaf)),
    ("door", "D3.stamp"): (
        [leaf(0.0, 3, NEVER_READ)],
        [leaf(0.0)],
        [leaf(0.0, CLOSED, NEVER_READ)],
    ),
    ("door", "T1.numbers"): ([to_door(0.0)], [leaf(0.0)], [leaf(0.0, 5)]),
    ("door", "D2.opens"): ([*leaves(6.0, OPEN), to_door(2.5)], opens(), [*stays_shut(31.0)]),
    ("door", "D2.stays"): (opens(), opens(until=16.0), opens(leaf(8.0), to_door(8.5), leaf(10.0))),
    ("door", "D1.bypass"): (
        opens(),
        opens(robot_closes(5.5)),
        opens(robot_closes(7.5), leaf(8.0), to_door(8.5), leaf(10.0)),
    ),
    ("door", "D2.holds"): (opens(until=4.0), opens(), [*flaps(3, 8.0, 0.5)]),
    ("door", "D2.people"): (
        [leaf(0.0), leaf(2.0, OPEN), leaf(5.0)],
        [*pushed(1, shuts_s=3.0)],
        [*pushed(3, closes_s=2.0, shuts_s=0.4)],
    ),
    ("door", "D3.travel"): (leaves(), opens(), [*open_at_once(2, 0.1)]),
    ("door", "D3.fresh"): (opens(until=8.0), opens(until=10.0), [*frozen(leaf, OPEN, 6.0)]),
    ("charger", "C4.rate"): (
        [station(0.0, IDLE)],
        bay(2.0),
        [station(0.0, IDLE), station(6.0, IDLE)],
    ),
    ("charger", "C4.answer"): (
        bay(20.0),
        [*bay(20.0), *(charge(8.5 + n) for n in range(8))],
        [*bay(12.0), *(station(12.0 + i / 100, IDLE) for i in range(21))],
    ),
    ("charger", "B0.one"): (
        bay(12.0),
        [senders("/a"), *bay(12.0)],
        twins(lambda s: station(s, IDLE)),
    ),
    ("charger", "C4.stamp"): (
        [station(0.0, ERROR, read_at=NEVER_READ)],
        bay(1.0),
        [station(0.0, IDLE, read_at=NEVER_READ)],
    ),
    ("charger", "C1.numbers"): ([charge(0.0)], bay(1.0), [station(0.0, 238)]),
    ("charger", "C5.id"): (bay(3.0), served(), [station(0.0, ASSIGNED)]),
    ("charger", "C5.robot"): (
        [*bay(6.0), ELSEWHERE],
        served(),
        [station(0.0, IDLE), ELSEWHERE, station(1.0, ASSIGNED, "r1"), station(3.0, IDLE)],
    ),
    ("charger", "C5.text"): ([charge(0.0)], bay(1.0), [station(0.0, ERROR, "r1")]),
    ("charger", "C1.keeps"): (
        served(),
        served(RIVAL),
        [*served(RIVAL), *bay(9.0, ASSIGNED, "r2", 6.0)],
    ),
    ("charger", "C2.start"): (
        served(station(6.0, RELEASED, "r1")),
        served(station(21.5, RELEASED, "r1"), until=21.0),
        served(until=34.0),
    ),
    ("charger", "C3.cancel"): (
        served(station(6.0, RELEASED, "r1")),
        served(cancel(5.5), station(6.0, RELEASED, "r1")),
        served(cancel(2.5), until=10.0),
    ),
    ("charger", "C3.foreign"): (
        served(cancel(5.5), station(6.0, IDLE)),
        served(cancel(4.5, "r9")),
        served(cancel(5.5, "r9"), station(6.0, IDLE), station(8.0, IDLE)),
    ),
    ("charger", "C4.fresh"): (
        bay(15.0),
        bay(20.0),
        [*seconds(0.0, 18.0, lambda s: station(s, IDLE, read_at=0.0))],
    ),
    **stories("dispenser", senders, twins),
    **stories("ingestor", senders, twins),
}


@pytest.mark.parametrize(("kind", "law"), STORIES)
def test_a_law_needs_its_occasion(kind: JudgedKind, law: str) -> None:
    found = [verdict(kind, law, story) for story in STORIES[kind, law]]
    assert found == ["not seen", "kept", "broken"]


@pytest.mark.parametrize("by", [None, Sender(), PANEL])
def test_a_false_of_an_unknown_node_or_of_a_panel_is_not_the_lifts(by: Sender | None) -> None:
    """A fire panel that repeats `false` is real, and `ros2` and rosbag2 name no sender."""
    assert verdict("lift", "L12.false", alarms(*FALSES, by=by)) == "not seen"


@pytest.mark.parametrize(
    ("shown", "names", "volatile", "found"),
    [
        ([], ("/a", "/b"), "/b", "not seen"),
        ([], ("/a", "/b"), "/a", "not seen"),
        ([], ("/a", "?"), "/a", "not seen"),
        ([], ("/a",), "/a", "broken"),
        ([Sender("/a")], ("/a", "/b"), "/b", "not seen"),
        ([Sender("/a")], ("/a", "/b"), "/a", "broken"),
    ],
)
def test_a_volatile_alarm_is_the_lifts_only_if_its_own_node_publishes_it(
    shown: list[Sender], names: tuple[str, ...], volatile: str, found: str
) -> None:
    """`shown` names the states' publisher, and `names` all nodes that publish states of lifts."""

    def look(judge: Judge, *, others: bool = False) -> None:
        judge.hear(Heard(0.0, 0.0, "lift_states", car(0.0)[2], *shown))
        judge.history.others |= {"Lift2"} if others else set()
        judge.history.senders = names
        for _ in range(2):
            judge.alarm_ends([volatile], [], 0.0, 0.0)

    assert verdict("lift", "L12.retained", [*cars(), look]) == found
    assert verdict("lift", "L12.retained", [*cars(), partial(look, others=True)]) == "not seen"


def test_the_publisher_of_another_lift_makes_no_second_node_of_this_one() -> None:
    uneven = [car(n + by) for n in range(8) for by in (0.0, 0.3)]
    assert verdict("lift", "B0.one", [senders("/a", "/b"), *uneven]) == "broken"

    def two_lifts(judge: Judge) -> None:
        judge.history.others.add("Lift2")

    assert verdict("lift", "B0.one", [senders("/a", "/b"), two_lifts, *uneven]) == "not seen"


@pytest.mark.parametrize(
    ("floor", "to", "found"), [("L3", "L3", "kept"), ("L3", "L1", "kept"), ("L1", "L1", "broken")]
)
def test_an_open_door_at_the_recall_floor_lets_in_only_a_robot_that_waits_there(
    floor: str, to: str, found: str
) -> None:
    """The robot waits at `floor`. The lift is recalled to L1, and shows `to` as its destination."""
    lines = [
        *(*seconds(0.0, 3.0, car), *seconds(2.5, 20.0, lambda s: asks(s, floor=floor))),
        *seconds(3.0, 6.0, lambda s: held(s, floor="L3" if floor == "L1" else "L1", to=floor)),
        *seconds(6.0, 20.0, lambda s: held(s, to=to, mode=FIRE, door=OPEN)),
    ]
    assert verdict("lift", "L10.board", [*lines]) == found


def test_every_law_has_its_stories() -> None:
    assert list(STORIES) == [(kind, law.id) for kind in words.KINDS for law in LAWS[kind]]


def test_a_charge_may_be_taken_over_only_after_its_end() -> None:
    other = station(6.0, ASSIGNED, "r2")
    assert verdict("charger", "C1.keeps", served(RIVAL, cancel(5.5), other)) == "kept"
    late = served(RIVAL, station(21.0, ASSIGNED, "r2"), until=21.0)
    assert verdict("charger", "C1.keeps", late) == "kept"
    taken = [*served(RIVAL, state=CHARGING), *bay(9.0, CHARGING, "r2", 6.0)]
    assert verdict("charger", "C1.keeps", taken) == "broken"


def test_a_listing_state_that_was_lost_or_comes_late_accuses_no_workcell() -> None:
    """Check with a state that is older than the acknowledgement. RMF compares the stamps, and ignores
    such a state."""
    of = WorkcellLines("dispenser")
    story = [of.ask(0.1), of.result(0.3, 0), of.state(0.4, read_at=0.2), of.state(3.0, "a", mode=1)]
    assert verdict("dispenser", "W2.lists", [of.state(0.0), *story]) == "not seen"
    quick = [of.ask(0.1), of.result(0.3, 0), of.state(0.9), of.result(1.5, 1), of.state(2.0)]
    assert verdict("dispenser", "W2.lists", [of.state(0.0), *quick]) == "not seen"


@pytest.mark.parametrize(
    ("asks_until", "delisted_at", "found"),
    [
        (4.0, 600.0, "not seen"),
        (4.0, 8.0, "not seen"),
        (4.0, 5.0, "broken"),
        (600.0, 600.0, "broken"),
    ],
)
def test_a_failed_request_may_leave_the_queue_when_rmf_no_longer_asks_for_it(
    asks_until: float, delisted_at: float, found: str
) -> None:
    of = WorkcellLines("dispenser")
    served = [of.ask(0.1), of.state(0.2, "a", mode=1), of.result(0.3, 0), of.result(3.5, 2)]
    asked = [of.ask(float(n)) for n in range(1, int(asks_until) + 1)]
    listed = of.states(delisted_at - 1.0, "a", begin=1.0)
    lines: Lines = [*served, *asked, *listed, *of.states(delisted_at + 5.0, begin=delisted_at)]
    assert verdict("dispenser", "W2.done", lines) == found


def test_a_request_that_leaves_without_a_result_is_a_breach_the_second_time() -> None:
    of = WorkcellLines("dispenser")

    def dropped(at: float, guid: str) -> Lines:
        listed = [
            of.state(at, guid, mode=1),
            of.result(at + 0.1, 0, guid),
            of.state(at + 0.5, guid),
        ]
        return [of.ask(at - 0.1, guid), *listed, of.state(at + 1.0), of.state(at + 3.0)]

    assert verdict("dispenser", "W2.done", [of.state(0.0), *dropped(1.0, "a")]) == "not seen"
    twice: Lines = [of.state(0.0), *dropped(1.0, "a"), *dropped(5.0, "b")]
    assert verdict("dispenser", "W2.done", twice) == "broken"
    failed = [of.state(1.0, "a"), of.result(1.5, 2), of.state(6.0), *of.states(9.0, begin=7.0)]
    assert (
        verdict("dispenser", "W2.done", [of.state(0.0), *failed, *dropped(10.0, "b")]) == "not seen"
    )

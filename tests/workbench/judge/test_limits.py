"""The limits of the laws. Values just inside and just outside a limit get different verdicts."""

from collections.abc import Callable, Iterator

import msgspec
import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard, Sender
from bridges.messages.stamps import stamp
from bridges.messages.topics import AnyTopic
from tests.site.timeline import EPOCH
from tests.workbench.judge.script import door as door_request
from tests.workbench.judge.script import lift as lift_request
from workbench.judge.judge import Judge, JudgedKind
from workbench.judge.law import Verdict

RED, BLUE = "fleet/red", "fleet/blue"
OPEN, CLOSED = 2, 0
AGV, FIRE = 2, 3
IDLE, ASSIGNED, CHARGING = 1, 2, 3
NAMES: dict[JudgedKind, str] = {
    "lift": "Lift1",
    "door": "ward",
    "charger": "bay1",
    "dispenser": "store",
    "ingestor": "intake",
}
NODE = Sender("/node")
Line = tuple[float, AnyTopic, d.Message]
Story = Callable[[float], list[Line]]


def is_broken(kind: JudgedKind, law: str, lines: list[Line]) -> bool:
    """Return whether the judge finds the law broken. The judge gets the messages in order of time, and
    gives its verdict 2 s after the last message. A fleet is heard then, so the network still
    delivers."""
    judge = Judge(kind, NAMES[kind])
    lines.sort(key=lambda line: line[0])
    for at, topic, message in lines:
        judge.hear(Heard(at, at, topic.name, message, NODE))
    at = lines[-1][0]
    judge.end(at, at)
    judge.hear(Heard(at + 2.0, at, topics.FLEET_STATES.name, d.FleetState("other")))
    return law in {j.law.id for j in judge.end(at + 2.0, at) if j.verdict is Verdict.BROKEN}


# ---- messages


def car(
    at: float,
    session: str = "",
    *,
    floor: str = "L1",
    door: int = CLOSED,
    to: str = "",
    mode: int = AGV,
    read_at: float | None = None,
) -> Line:
    """Return a LiftState. Its stamp is `read_at`, or `at` by default."""
    read = stamp(1e3 + (at if read_at is None else read_at))
    state = d.LiftState(read, "Lift1", ("L1", "L3"), floor, to, door, 0, (AGV,), mode, session)
    return at, topics.LIFT_STATES, state


def asks(at: float, session: str = RED, floor: str = "L3", lift: str = "Lift1") -> Line:
    return at, topics.LIFT_REQUESTS, lift_request(session, floor, lift)


def robot_asks(at: float, session: str = RED) -> Line:
    return at, topics.ADAPTER_LIFT_REQUESTS, lift_request(session, "L3")


def ends(at: float, session: str = RED, floor: str = "", by_clock_s: float = 0.0) -> Line:
    """Return an END. Its sender's clock is `by_clock_s` seconds ahead of the requests' clock."""
    end = lift_request(session, floor, kind=0)
    end = msgspec.structs.replace(end, request_time=stamp(EPOCH + by_clock_s))
    return at, topics.LIFT_REQUESTS, end


def leaf(at: float, mode: int = CLOSED, read_at: float | None = None) -> Line:
    """Return a DoorState."""
    read = stamp(1e3 + (at if read_at is None else read_at))
    return at, topics.DOOR_STATES, d.DoorState(read, "ward", d.DoorMode(mode))


def to_door(at: float, mode: int = OPEN) -> Line:
    return at, topics.DOOR_REQUESTS, door_request(mode)


def robot_closes(at: float) -> Line:
    return at, topics.ADAPTER_DOOR_REQUESTS, door_request(CLOSED, RED)


def station(at: float, state: int, request_id: str = "", read_at: float | None = None) -> Line:
    """Return a ChargerState."""
    read = stamp(1e3 + (at if read_at is None else read_at))
    robot = ("fleet", "red") if request_id else ("", "")
    shown = d.ChargerState(read, state, "bay1", "", request_id, *robot)
    return at, topics.CHARGER_STATES, shown


def charge(at: float, timeout_s: int = 20) -> Line:
    request = d.ChargerRequest("bay1", "fleet", "red", d.Duration(timeout_s), "r1")
    return at, topics.CHARGER_REQUESTS, request


def cancel(at: float, request_id: str = "r1") -> Line:
    return at, topics.CHARGER_CANCELS, d.ChargerCancel("bay1", request_id)


def seconds(begin: float, end: float, line: Callable[[float], Line]) -> Iterator[Line]:
    """Yield one line each second. The first line is at `begin`, and the last is before `end`."""
    n = 0
    while begin + n < end:
        yield line(begin + n)
        n += 1


def held(at: float, **state: int | str | float) -> Line:
    """Return a LiftState in which RED has the lift."""
    return car(at, RED, **state)  # type: ignore[arg-type]


# ---- laws that all three kinds share


def answered(times: int, early_s: float, after_s: float) -> list[Line]:
    """Return a state each second, and then `times` requests.

    Each request gets a state `after_s` seconds later. In the regular rhythm of one second, this state
    would come `early_s` seconds later.
    """
    lines, at = list(seconds(0.0, 12.0, leaf)), 11.0
    for _ in range(times):
        at += 1.0 - early_s
        lines += [to_door(at - after_s, CLOSED), leaf(at), leaf(at + 1.0)]
        at += 1.0
    return lines


def back_and_forth(times: int, each_s: float, by_s: float) -> list[Line]:
    """Return states whose stamps go back by `by_s` seconds, `times` times."""
    steps = [(n * each_s, n) for n in range(times + 1)]
    return [
        line
        for at, n in steps
        for line in (
            leaf(at, read_at=100.0 + n * 1e-3),
            leaf(at + 0.25, read_at=100.0 + by_s + n * 1e-3),
        )
    ]


def frozen(line: Callable[..., Line], opened: int, for_s: float) -> list[Line]:
    """Return open states for `for_s` seconds. All these states have the old stamp 1 s."""
    open_ = {"mode" if line is leaf else "door": opened, "read_at": 1.0}
    shown = seconds(1.0, 1.0 + for_s, lambda s: line(s, **open_))
    return [line(0.0), *shown, line(1.0 + for_s, **open_)]


SHARED: list[tuple[str, Story, float, float]] = [
    ("D1.rate", lambda x: [leaf(0.0), leaf(1.0), leaf(1.0 + x)], 5.0, 5.1),
    ("D1.rate", lambda x: [leaf(0.0), to_door(x - 2.0, CLOSED)], 5.0, 5.1),
    ("D1.answer", lambda x: [leaf(i * x / 19) for i in range(21)], 1.02, 0.98),
    ("D1.answer", lambda x: [leaf(i / 100) for i in range(int(x))], 20, 21),
    ("D1.answer", lambda x: answered(int(x), 0.4, 0.05), 4, 5),
    ("D1.answer", lambda x: answered(5, 0.4, x), 0.105, 0.095),
    ("D1.answer", lambda x: answered(5, x, 0.05), 0.14, 0.16),
    ("B0.one", lambda x: back_and_forth(int(x), 4.0, 10.0), 3, 4),
    ("B0.one", lambda x: back_and_forth(4, x / 3, 10.0), 30.1, 29.9),
    ("B0.one", lambda x: back_and_forth(4, 4.0, x), 0.45, 0.55),
    ("D3.fresh", lambda x: frozen(leaf, OPEN, x), 5.0, 5.1),
    ("D3.fresh", lambda x: [leaf(n, OPEN, n % 2 * x) for n in range(8)], 0.051, 0.049),
]


@pytest.mark.parametrize(("law", "story", "right", "wrong"), SHARED)
def test_a_shared_law_is_broken_just_beyond_its_limit_and_not_before(
    law: str, story: Story, right: float, wrong: float
) -> None:
    assert [is_broken("door", law, story(x)) for x in (right, wrong)] == [False, True]


# ---- lifts


def asked_for_long(ends_at: float, last_ask_s: float = 0.5, gap_s: float = 1.0) -> list[Line]:
    """Return messages in which RED asks each second from 1 s on. The lift never grants the session.

    A gap of `gap_s` seconds follows the request at 16 s.
    """
    last_at = ends_at - last_ask_s
    return [
        *seconds(0.0, ends_at, car),
        *seconds(1.0, 16.5, asks),
        *seconds(16.0 + gap_s, last_at, asks),
        asks(last_at),
        car(ends_at),
    ]


def asked_so_often(times: int) -> list[Line]:
    return [
        *seconds(0.0, 34.0, car),
        *(asks(1.0 + n * 32.0 / (times - 1)) for n in range(times)),
        car(34.0),
    ]


def asked_after_a_ride(free_s: float) -> list[Line]:
    """Return messages in which RED rides, and ends its session. From then on BLUE asks each second. The
    lift is free for `free_s` seconds, but never serves BLUE."""
    over_at = 4.0 + free_s
    return [
        *(car(0.0), asks(0.5, floor="L1"), held(1.0, to="L1", door=OPEN), ends(3.5)),
        held(3.9, to="L1"),
        *seconds(4.0, over_at, car),
        *seconds(3.6, over_at, lambda at: asks(at, BLUE)),
        car(over_at),
    ]


def rides_with_bare_ends(times: int, waits_s: float = 0.5, goes_s: float = 0.2) -> list[Line]:
    """Return `times` sessions that continue after an END without a floor.

    Each session ends `goes_s` seconds after an END with a floor.
    """
    lines = [car(0.0)]
    for n in range(times):
        at = 10.0 * n
        lines += [asks(at + 1.0), held(at + 1.2, to="L3"), ends(at + 4.0), held(at + 4.1, to="L3")]
        floor_at = at + 4.0 + waits_s
        lines += [ends(floor_at, floor="L3"), car(floor_at + goes_s), car(at + 8.0)]
    return lines


def reopens(times: int, each_s: float, shut_s: float) -> list[Line]:
    """Return messages in which the lift holds its door for RED. The door shuts `times` times, for
    `shut_s` seconds each."""
    lines = [car(0.0), asks(0.5, floor="L1"), held(1.0, to="L1", door=OPEN)]
    for n in range(times):
        at = 2.0 + n * each_s
        lines += [held(at, to="L1"), held(at + shut_s, to="L1", door=OPEN)]
        lines += seconds(at + shut_s + 1.0, at + each_s, lambda s: held(s, to="L1", door=OPEN))
    return lines


def false_alarms(times: int, each_s: float) -> list[Line]:
    return [
        car(0.0),
        *((1.0 + n * each_s, topics.FIRE_ALARM_TRIGGER, d.Bool(False)) for n in range(times)),
    ]


LIFT: list[tuple[str, Story, float, float]] = [
    # The two numbers of a law are values of `x`: the law is kept with the first, and broken with the
    # second. In L1.other, `x` is a time (s). A session may appear `x` before the request that explains
    # the session.
    (
        "L1.other",
        lambda x: [
            *(car(0.0), asks(1.0, lift="Lift2"), car(4.0), held(5.0)),
            *(held(5.0 + x), asks(5.0 + x + 0.01), held(8.0)),
        ],
        1.0,
        1.1,
    ),
    ("L4.own", lambda x: [asks(0.5, BLUE), car(1.0), held(1.0 + x)], 2.9, 3.1),
    ("L4.grants", lambda x: asked_for_long(1.0 + x), 30.0, 30.1),
    ("L4.grants", lambda x: asked_so_often(int(x)), 9, 10),
    ("L4.grants", asked_after_a_ride, 94.8, 95.0),
    ("L4.grants", lambda x: asked_for_long(31.5, last_ask_s=x), 3.1, 2.9),
    ("L4.grants", lambda x: asked_for_long(44.0, gap_s=x), 5.1, 4.9),
    (
        "L1.bypass",
        lambda x: [
            *(*seconds(0.0, 5.0 + x, car), asks(5.0, BLUE), robot_asks(5.0), held(5.0 + x)),
        ],
        10.1,
        9.9,
    ),
    (
        "L4.ends",
        lambda x: [car(0.0), asks(0.5), held(1.0), ends(4.0, BLUE), held(4.0), car(4.0 + x)],
        1.9,
        2.1,
    ),
    (
        "L5.foreign",
        lambda x: [car(0.0), asks(0.5), held(1.0), ends(4.0, BLUE), held(4.0), car(4.0 + x)],
        2.1,
        1.9,
    ),
    (
        "L4.ends",
        lambda x: [car(0.0), asks(0.5), ends(1.0), car(3.0), held(1.0 + x), car(7.0)],
        4.9,
        5.1,
    ),
    (  # the robot asks again after an END of its earlier ride, and the lift drops the new session
        "L4.ends",
        lambda x: [
            *(car(0.0), asks(0.5), held(1.0), *seconds(1.5, 6.0, held), ends(6.4), car(7.0)),
            *seconds(8.0, 30.0, asks),
            *seconds(8.5, 6.4 + x, held),
            car(6.4 + x),
        ],
        8.9,
        9.1,
    ),
    (  # the session has survived an END of a restarted supervisor, which then forwards requests again
        "L4.ends",
        lambda x: [
            *(car(0.0), *seconds(0.5, 30.0, asks), *seconds(0.6, 30.0, robot_asks)),
            *(ends(6.2), *seconds(1.0, 6.2 + x, held), car(6.2 + x)),
        ],
        8.9,
        9.1,
    ),
    (  # the supervisor has ended the session, but the robot in the car goes on asking, until it dies
        "L4.ends",
        lambda x: [
            *(car(0.0), asks(0.5), held(1.0), ends(4.0), car(4.1), robot_asks(4.0 + x)),
            *(held(10.0), car(15.0)),
        ],
        5.9,
        -0.1,
    ),
    ("L5.ends", lambda x: [car(0.0), asks(0.5), held(1.0), ends(2.0), held(2.0 + x)], 2.9, 3.1),
    (
        "L5.ends",
        lambda x: [
            *(car(0.0), asks(0.5), robot_asks(1.9), held(1.0), ends(2.0)),
            *(held(3.0), held(5.1), held(1.9 + x)),
        ],
        5.9,
        6.1,
    ),
    (  # an END by a clock that is behind the requests' clock counts after it has been repeated
        "L5.ends",
        lambda x: [
            *(car(0.0), asks(0.5), held(1.0)),
            *(
                ends(2.0, by_clock_s=-9.0),
                held(2.1),
                ends(2.0 + x, by_clock_s=-9.0),
                held(4.0),
                held(7.0),
            ),
        ],
        0.9,
        1.1,
    ),
    (  # such an END after a long pause is a first END again
        "L5.ends",
        lambda x: [
            *(car(0.0), asks(0.5), held(1.0), ends(2.0, by_clock_s=-9.0), held(4.0)),
            *(ends(2.0 + x, by_clock_s=-9.0), held(8.0), held(9.0)),
        ],
        3.1,
        2.9,
    ),
    ("L5.ends", lambda x: rides_with_bare_ends(int(x)), 2, 3),
    ("L5.ends", lambda x: rides_with_bare_ends(3, goes_s=x), 0.31, 0.29),
    ("L5.ends", lambda x: rides_with_bare_ends(3, waits_s=x), 0.29, 0.31),
    (
        "L7.jump",
        lambda x: [car(0.0), car(1.0, door=OPEN), car(1.0 + x, floor="L3", door=OPEN)],
        1.6,
        1.4,
    ),
    ("L7.holds", lambda x: reopens(int(x), 8.0, 0.5), 2, 3),
    ("L7.holds", lambda x: reopens(3, x / 2, 0.5), 30.1, 29.9),
    ("L7.holds", lambda x: reopens(3, 8.0, x), 1.1, 0.9),
    (
        "L7.fresh",
        lambda x: frozen(car, OPEN, x),
        5.0,
        5.1,
    ),
    (
        "L8.destination",
        lambda x: [
            *(car(0.0), *(asks(0.1 + n * 1e-2, floor=f"F{n}") for n in range(int(x)))),
            held(1.0, to="F0"),
        ],
        8,
        9,
    ),
    (  # a resumed session has its former destination
        "L8.destination",
        lambda x: [
            *(car(0.0), asks(0.5, floor="L1"), held(1.0, to="L1"), ends(2.0)),
            *(car(float(t)) for t in range(2, int(2.0 + x))),
            *(asks(2.0 + x), held(2.0 + x, to="L1"), held(4.0 + x, to="L1")),
        ],
        69.9,
        70.1,
    ),
    (
        "L10.board",
        lambda x: [
            *(car(0.0), asks(0.5, floor="L1"), held(1.0, to="L1", door=OPEN), car(2.0, door=OPEN)),
            *(car(float(t), door=OPEN) for t in range(3, int(2.0 + x))),
            held(2.0 + x, to="L1", door=OPEN, mode=FIRE),
        ],
        64.9,
        65.1,
    ),
    (
        "L10.grant",
        lambda x: [
            *(car(0.0), asks(0.5), held(1.0), ends(2.0), car(2.0, mode=FIRE)),
            *(car(float(t), mode=FIRE) for t in range(3, int(2.0 + x))),
            held(2.0 + x, mode=FIRE),
        ],
        69.9,
        70.1,
    ),
    ("L12.false", lambda x: false_alarms(int(x), 5.0), 2, 3),
    ("L12.false", lambda x: false_alarms(3, x / 2), 30.1, 29.9),
]


@pytest.mark.parametrize(("law", "story", "right", "wrong"), LIFT)
def test_a_lifts_law_is_broken_just_beyond_its_limit_and_not_before(
    law: str, story: Story, right: float, wrong: float
) -> None:
    assert [is_broken("lift", law, story(x)) for x in (right, wrong)] == [False, True]


# ---- doors


def stays_shut(for_s: float, asked: int = 20) -> list[Line]:
    """Return messages in which RMF asks for OPEN `asked` times, but the door stays closed."""
    return [
        *seconds(0.0, 1.0 + for_s, leaf),
        *(to_door(1.0 + n * 29.0 / (asked - 1)) for n in range(asked)),
        leaf(1.0 + for_s),
    ]


def flaps(times: int, each_s: float, shut_s: float) -> list[Line]:
    """Return messages in which the held door shuts `times` times, for `shut_s` seconds each."""
    lines = [leaf(0.0), to_door(0.5), leaf(1.0, OPEN)]
    for n in range(times):
        at = 2.0 + n * each_s
        lines += [leaf(at), leaf(at + shut_s, OPEN)]
        lines += seconds(at + shut_s + 1.0, at + each_s, lambda s: leaf(s, OPEN))
    return lines


def open_at_once(times: int, after_s: float) -> list[Line]:
    """Return `times` openings. The door shows OPEN `after_s` seconds after each request."""
    lines = [leaf(0.0)]
    for n in range(times):
        at = 1.0 + 4.0 * n
        lines += [to_door(at), leaf(at + after_s, OPEN), to_door(at + 2, CLOSED), leaf(at + 3)]
    return lines


def pushed(
    times: int, closes_s: float = 2.0, shuts_s: float = 0.4, opens_s: float | None = 0.0
) -> list[Line]:
    """Return messages in which people open the door `times` times.

    RMF sends CLOSE `closes_s` seconds later, and the door shows CLOSED `shuts_s` seconds after CLOSE.
    The door takes `opens_s` seconds to open. With None the door never shows OPEN.
    """
    lines = [leaf(0.0)]
    for n in range(times):
        at = 2.0 + 8.0 * n
        lines.append(leaf(at, 1 if opens_s is None or opens_s else OPEN))
        if opens_s:
            lines.append(leaf(at + opens_s, OPEN))
        lines += [to_door(at + closes_s, CLOSED), leaf(at + closes_s + shuts_s, CLOSED)]
        lines.append(leaf(at + 6.0))
    return lines


DOOR: list[tuple[str, Story, float, float]] = [
    ("D2.opens", stays_shut, 29.9, 30.1),
    ("D2.opens", lambda x: stays_shut(31.0, asked=int(x)), 4, 5),
    (
        "D2.stays",
        lambda x: [
            *(leaf(0.0), to_door(0.5), leaf(1.0, OPEN), leaf(3.0), leaf(3.0 + x, OPEN)),
            *(to_door(3.1), leaf(5.0, OPEN)),
        ],
        0.89,
        0.91,
    ),
    (
        "D2.stays",
        lambda x: [
            *(leaf(0.0), to_door(0.5), leaf(1.0, OPEN), robot_closes(3.0), leaf(5.0, OPEN)),
            *(leaf(3.0 + x), to_door(3.1 + x), leaf(9.5)),
        ],
        4.9,
        5.1,
    ),
    (
        "D1.bypass",
        lambda x: [
            *(leaf(0.0), to_door(0.5), leaf(1.0, OPEN), robot_closes(3.0), leaf(5.0, OPEN)),
            *(leaf(3.0 + x), to_door(3.1 + x), leaf(9.5)),
        ],
        5.1,
        4.9,
    ),
    ("D2.holds", lambda x: flaps(int(x), 8.0, 0.5), 2, 3),
    ("D2.holds", lambda x: flaps(3, x / 2, 0.5), 30.1, 29.9),
    ("D2.holds", lambda x: flaps(3, 8.0, x), 1.1, 0.9),
    ("D3.travel", lambda x: open_at_once(int(x), 0.1), 1, 2),
    ("D3.travel", lambda x: open_at_once(2, x), 0.31, 0.29),
    ("D2.people", lambda x: pushed(int(x), closes_s=0.4, shuts_s=0.05), 2, 3),
    ("D2.people", lambda x: pushed(3, closes_s=2.0, shuts_s=x), 0.51, 0.49),
    ("D2.people", lambda x: pushed(3, closes_s=-x, shuts_s=x + 0.05), 0.51, 0.49),
    ("D2.people", lambda x: pushed(3, closes_s=0.2, shuts_s=x, opens_s=None), 1.1, 0.9),
]


@pytest.mark.parametrize(("law", "story", "right", "wrong"), DOOR)
def test_a_doors_law_is_broken_just_beyond_its_limit_and_not_before(
    law: str, story: Story, right: float, wrong: float
) -> None:
    assert [is_broken("door", law, story(x)) for x in (right, wrong)] == [False, True]


# ---- chargers


def promised(for_s: float, cancelled: bool = False, charging: bool = False) -> list[Line]:
    """Return states in which the station is promised to r1 from 1 s on, or charges r1.

    With `cancelled` a cancel comes at 2 s.
    """
    state = CHARGING if charging else ASSIGNED
    lines = [station(0.0, IDLE), charge(0.5), *([cancel(2.0)] if cancelled else [])]
    begun = 2.0 if cancelled else 1.0
    shown = seconds(1.0, begun + for_s, lambda s: station(s, state, "r1"))
    return [*lines, *shown, station(begun + for_s, state, "r1")]


CHARGER: list[tuple[str, Story, float, float]] = [
    ("C2.start", promised, 30.0, 30.1),
    ("C3.cancel", lambda x: promised(x, cancelled=True), 5.0, 5.1),
    ("C3.cancel", lambda x: promised(x, cancelled=True, charging=True), 120.0, 120.1),
    (
        "C3.foreign",
        lambda x: [
            *(station(0.0, IDLE), charge(0.5), station(1.0, ASSIGNED, "r1"), cancel(3.0, "r9")),
            *(station(3.0, ASSIGNED, "r1"), station(3.0 + x, IDLE)),
        ],
        2.1,
        1.9,
    ),
    (
        "C4.fresh",
        lambda x: [
            *seconds(0.0, 1.0 + x, lambda s: station(s, IDLE, read_at=min(s, 1.0))),
            station(1.0 + x, IDLE, read_at=1.0),
        ],
        15.0,
        15.1,
    ),
]


@pytest.mark.parametrize(("law", "story", "right", "wrong"), CHARGER)
def test_a_chargers_law_is_broken_just_beyond_its_limit_and_not_before(
    law: str, story: Story, right: float, wrong: float
) -> None:
    assert [is_broken("charger", law, story(x)) for x in (right, wrong)] == [False, True]

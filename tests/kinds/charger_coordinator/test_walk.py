"""Rules that hold in every history. Tests check all short histories, and random long histories.

`make test` checks all histories of three moves. `make deep` checks all 10^4 histories of four moves.
STEP_S passes after each move. Two robots and two stations behave as the rules of RMF's charger messages
demand.

After the last move the test repairs everything. Then every robot that wants to charge must be charged.
"""

from copy import copy
from typing import Any

from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import core, keep
from bridges.kinds.charger_coordinator.memory import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    RELEASED,
    STATION_SILENT_S,
    SiteLimits,
    SiteMemory,
)
from bridges.kinds.charger_coordinator.signals import (
    ChargerStateHeard,
    ChargeUnwanted,
    ChargeWanted,
    Dedicated,
    FleetSeen,
    Sighting,
)
from bridges.kinds.shared.decision import OperatorReset
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages import definitions as d
from tests.depth import depth, examples
from tests.kinds.charger_coordinator.virtual_site import settings
from tests.walk import histories

SETTINGS = settings()
SITE = SiteLimits.of(SETTINGS)
ONE, TWO = RobotName("tiny", "AMR01"), RobotName("tiny", "AMR02")
A, B = "charger_a", "charger_b"
WAYPOINTS = set(SETTINGS.fleets["tiny"].waypoints)
STEP_S = 1.25


class Node:
    """A charger's daemon that obeys the rules of the charger messages.

    `holder` is the id and robot of the present request. `ends` says that this request was cancelled.
    `on_pad` is the robot that was charging when the daemon restarted.
    """

    def __init__(self) -> None:
        self.state = IDLE
        self.holder: tuple[str, RobotName] | None = None
        self.error = ""
        self.ends = False
        self.on_pad: RobotName | None = None
        self.known: set[str] = set()

    def takes(self, who: RobotName) -> bool:
        """Return whether the station is free for this robot."""
        return self.state is IDLE or (self.holder is None and self.on_pad == who)

    def restarts(self) -> None:
        """Restart the charger's daemon, which forgets the coordinator's request. A robot that was being
        charged stays on the pad, and the charger goes on charging."""
        self.on_pad = self.holder[1] if self.holder and self.state is CHARGING else None
        self.state = CHARGING if self.on_pad else IDLE
        self.holder, self.error, self.known = None, "", set()

    def hears(self, message: Any) -> None:
        if isinstance(message, d.ChargerRequest):
            who = RobotName(message.fleet_name, message.robot_name)
            if self.takes(who) and message.request_id not in self.known:
                self.known.add(message.request_id)
                self.state, self.holder, self.ends = ASSIGNED, (message.request_id, who), False
                self.error, self.on_pad = "", None
        elif self.holder and self.holder[0] == message.request_id:
            self.ends = True
            if self.state is not ERROR:
                self.state = RELEASED

    def goes_on(self) -> None:
        """Let the station go to the next state of a charge. If it shows an error, the error ends
        instead.

        A robot that charges without a request makes the station show an error.
        """
        if self.on_pad and self.state is CHARGING:
            self.fails(f"wrong docking: {self.on_pad} is not assigned here")
            return
        if self.state is ERROR:
            self.error, self.on_pad = "", None
            self.state = RELEASED if self.holder else IDLE
            return
        after = {ASSIGNED: CHARGING, CHARGING: RELEASED, RELEASED: IDLE, IDLE: IDLE}
        self.state = after[self.state]
        if self.state is IDLE:
            self.holder = None

    def fails(self, error: str) -> None:
        self.state, self.error = ERROR, error

    def shown(self, name: str) -> ChargerStateHeard:
        request_id, who = self.holder or ("", self.on_pad)
        if not request_id and self.state is not IDLE:
            request_id = f"unrequested/{name}"
        return ChargerStateHeard(name, self.state, request_id, who, self.error)


class Ledger:
    """The coordinator's core with two stations and two robots. `_check` checks each message of the
    core."""

    def __init__(self) -> None:
        self.now = 0.0
        self.speaks = False
        self.memory: SiteMemory = core.initial("site", 0.0)
        self.nodes = {A: Node(), B: Node()}
        self.wants = {ONE: False, TWO: False}
        self.charged = {ONE: 0, TWO: 0}
        self.said = 0
        self.hears(MaySpeak(True))
        self.passes()

    def copy(self) -> "Ledger":
        """Return a copy, so that several histories can begin with the same moves."""
        made = copy(self)
        made.nodes = {name: copy(node) for name, node in self.nodes.items()}
        for node in made.nodes.values():
            node.known = set(node.known)
        made.wants, made.charged = dict(self.wants), dict(self.charged)
        return made

    def hears(self, event: Any) -> None:
        if isinstance(event, MaySpeak):
            self.speaks = event.yes
        decided = core.decide(self.memory, event, self.now, SITE)
        self.memory = decided.memory
        assert decided.wake_at > self.now
        for _, message in decided.publish:
            assert self.speaks
            self.said += 1
            self._check(message)

    def passes(self) -> None:
        """Let STEP_S pass. Then let the stations and the fleet show their states."""
        self.now += STEP_S
        for name, node in self.nodes.items():
            self.hears(node.shown(name))
        for who, wants in self.wants.items():
            sighting = Sighting(who, wants, SITE.waits_at[who], 40.0, "task" if wants else "work")
            self.hears(FleetSeen((sighting,)))
        self.hears(Woken())

    def check_all_are_charged_in_the_end(self) -> None:
        """Repair everything and let time pass. Fail if a robot that wants to charge does not get
        charged."""
        if not self.speaks:
            self.hears(MaySpeak(True))
        before = dict(self.charged)
        waits = {who for who, wants in self.wants.items() if wants and not self.memory.faulty(who)}
        for _ in range(80):
            for node in self.nodes.values():
                node.goes_on()
                if node.state is CHARGING and node.holder:
                    self.charged[node.holder[1]] += 1
            self.passes()
            if all(self.charged[who] > before[who] for who in waits):
                return
        raise AssertionError(f"{waits} waited for ever: {self.memory}")

    def _check(self, message: Any) -> None:
        match message:
            case d.ChargerRequest(charger_name=name):
                node, who = self.nodes[name], RobotName(message.fleet_name, message.robot_name)
                if message.request_id in node.known:
                    return  # the coordinator has repeated a request
                assert node.takes(who), "asked for a station that is not free"
                assert who not in self._live(), "a robot that has a station gets a second station"
                assert not self.memory.faulty(who)
                node.hears(message)
            case d.ChargerCancel(charger_name=name):
                self.nodes[name].hears(message)
            case d.ChargingAssignments(assignments=assignments):
                places = [a.waypoint_name for a in assignments]
                assert len(set(places)) == len(places)
                assert set(places) <= WAYPOINTS
        live = self._live()
        assert len(set(live)) == len(live), "one robot has two stations"

    def _live(self) -> list[RobotName]:
        """Return each robot that has a station with a valid request. A cancelled or released request is
        not valid."""
        return [
            node.holder[1]
            for node in self.nodes.values()
            if node.holder and not node.ends and node.state is not RELEASED
        ]

    def restarts(self) -> None:
        """Restart the coordinator from its stored memory. It publishes nothing before its quiet start
        is over."""
        memory = self.memory
        kept = keep.persist({"site": memory})
        self.memory = keep.restore(kept, SETTINGS, self.now)["site"]
        self.speaks = False
        assert self.memory.wishes == memory.wishes
        assert self.memory.strikes == memory.strikes
        assert {n: g.robot for n, g in self.memory.grants.items()} == {
            n: g.robot for n, g in memory.grants.items()
        }
        for _ in range(3):
            self.passes()
        self.hears(MaySpeak(True))


def flip(who: RobotName) -> Any:
    def move(ledger: Ledger) -> None:
        ledger.wants[who] = not ledger.wants[who]
        ledger.passes()
        ledger.passes()

    return move


MOVES: list[Any] = [
    flip(ONE),
    flip(TWO),
    lambda ledger: ledger.nodes[A].goes_on(),
    lambda ledger: ledger.nodes[B].goes_on(),
    lambda ledger: ledger.nodes[A].fails("station: over temperature"),
    lambda ledger: ledger.nodes[A].fails("robot: authentication timeout"),
    lambda ledger: ledger.hears(MaySpeak(not ledger.speaks)),
    lambda ledger: ledger.restarts(),
    lambda ledger: ledger.nodes[A].restarts(),
    lambda ledger: ledger.hears(ChargeWanted(TWO, A, "op-1", 0.0)),
]


def after(ledger: Ledger, move: Any) -> Ledger:
    """Return a copy of the ledger after this move, and after STEP_S more seconds."""
    ledger = ledger.copy()
    move(ledger)
    ledger.passes()
    return ledger


def test_every_short_history_ends_with_all_robots_charged() -> None:
    ledger = Ledger()
    ledger.wants[ONE] = True
    ledger.passes()
    ledger.passes()
    for end, _ in histories(ledger, MOVES, depth(3, 4), after):
        end.check_all_are_charged_in_the_end()


@hypothesis_settings(max_examples=examples(150))
@given(st.lists(st.integers(0, len(MOVES) - 1), max_size=25))
def test_every_long_history_ends_with_all_robots_charged(history: list[int]) -> None:
    ledger = Ledger()
    for move in history:
        MOVES[move](ledger)
        ledger.passes()
    ledger.check_all_are_charged_in_the_end()


ROBOTS = st.sampled_from([ONE, TWO, RobotName("tiny", "AMR03")])
STATIONS = st.sampled_from([A, B])
TEXTS = st.sampled_from(
    [
        "",
        "station: fan",
        "robot: handshake timeout",
        "over temperature",
        "Charger unreachable",
        "wrong docking: tiny/AMR01 is not assigned here",
        "unknown receiver RX-2",
        "out of service after: station: fan",
    ]
)
IDS = st.sampled_from(
    [
        "",
        "unrequested/charger_a",
        "somebody-1",
        *(f"charger_coordinator/tiny/AMR01/{n}" for n in (1, 2)),
    ]
)
EVENTS = st.one_of(
    st.builds(
        ChargerStateHeard,
        STATIONS,
        st.sampled_from([IDLE, ASSIGNED, CHARGING, RELEASED, ERROR]),
        IDS,
        st.one_of(st.none(), ROBOTS),
        TEXTS,
    ),
    st.builds(
        Sighting,
        ROBOTS,
        st.booleans(),
        st.sampled_from([None, "charger_a", "dock_b", "wait_1"]),
        st.sampled_from([0.0, 40.0, 95.0, 100.0, float("nan")]),
        st.sampled_from(["", "task"]),
    ).map(lambda sighting: FleetSeen((sighting,))),
    st.builds(
        ChargeWanted,
        ROBOTS,
        st.sampled_from(["", A, B]),
        st.sampled_from(["op-1", "op-2"]),
        st.just(9.0),
    ),
    st.builds(ChargeUnwanted, st.sampled_from(["op-1", "op-2", "somebody-1"])),
    st.tuples(ROBOTS, STATIONS).map(lambda pair: Dedicated((pair,))),
    st.booleans().map(MaySpeak),
    st.just(OperatorReset()),
    st.just(Woken()),
)
HISTORIES = st.lists(st.tuples(st.sampled_from([0.0, 0.5, 2.0, 11.0, 31.0]), EVENTS), max_size=40)


@hypothesis_settings(max_examples=examples(400))
@given(HISTORIES)
def test_in_every_history_no_two_robots_share_a_station_and_requests_go_out_in_turn(
    history: list[tuple[float, Any]],
) -> None:
    memory, now, speaks = core.initial("site", 0.0), 0.0, False
    for passed, event in history:
        now += passed
        speaks = event.yes if isinstance(event, MaySpeak) else speaks
        decided = core.decide(memory, event, now, SITE)
        memory = decided.memory
        assert speaks or not decided.publish
        assert decided.wake_at > now
        live = [grant.robot for grant in memory.grants.values() if not grant.over]
        assert len(set(live)) == len(live)
        assert len({wish.robot for wish in memory.wishes}) == len(memory.wishes)
        for _, message in decided.publish:
            if isinstance(message, d.ChargingAssignments):
                places = [a.waypoint_name for a in message.assignments]
                assert len(set(places)) == len(places)
                assert set(places) <= WAYPOINTS
            if isinstance(message, d.ChargerRequest):
                seen = memory.stations[message.charger_name]
                assert now < seen.at + STATION_SILENT_S or memory.grants[message.charger_name]
        kept = keep.persist({"site": memory})
        assert keep.persist(keep.restore(kept, SETTINGS, now)) == kept


@hypothesis_settings(max_examples=examples(200))
@given(st.binary(max_size=60))
def test_a_damaged_memory_of_the_coordinator_is_refused_as_a_whole(kept: bytes) -> None:
    try:
        keep.restore(kept, SETTINGS, 0.0)
    except ValueError:
        return
    raise AssertionError("a damaged memory was accepted")

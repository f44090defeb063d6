"""Stories of a door with its daemon, a door supervisor, and robots that follow RMF's rules."""

from bridges.kinds.door_supervisor import keep
from bridges.messages import definitions as d
from bridges.messages import topics
from tests.kinds.door_supervisor.world import (
    WARD,
    DoorDaemon,
    OurSupervisor,
    RmfsSupervisor,
    Walker,
    to_door,
)
from tests.runtime.virtual_graph import EPOCH, Disk, World, in_order
from workbench.rmf_model import NEVER, door_request

A, B = "fleet/a", "fleet/b"


class Site:
    """One door, robots and a door supervisor. Each robot has a plan of its passages.

    The supervisor is our supervisor with its disk, or a stand-in for RMF's supervisor (`theirs`).
    """

    def __init__(
        self, *plans: list[tuple[float, float]], theirs: bool = False, **changes: object
    ) -> None:
        self.world = World(in_order)
        self.disk = Disk()
        self.door = DoorDaemon(self.world)
        if theirs:
            self.rmfs = RmfsSupervisor(self.world)
        else:
            self.ours = OurSupervisor(self.world, self.disk, **changes)
        self.walkers = [
            Walker(self.world, name, plan) for name, plan in zip((A, B), plans, strict=False)
        ]

    def restarts(self, after_s: float = 0.0) -> None:
        """Kill our supervisor, and start it again `after_s` seconds later."""
        self.ours.leave()
        self.world.run(self.world.now + after_s)
        self.ours.restart()

    def asks(self, who: str, mode: d.DoorModeValue, door: str = WARD) -> None:
        request = door_request(door, who, mode, EPOCH + self.world.now)
        self.world.send(who, topics.ADAPTER_DOOR_REQUESTS, request)

    @property
    def relay(self) -> list[tuple[float, bool]]:
        return self.door.door.relay

    def first_close(self) -> tuple[float, str]:
        return next((at, word) for at, word in self.words() if word == "CLOSED")

    def words(self) -> list[tuple[float, str]]:
        return [(at, word) for at, _, word in to_door(self.world)]


# ---- DOOR-SUPERVISOR-1, DOOR-SUPERVISOR-2: robots that pass the door


def test_a_robot_passes_a_door_through_the_supervisor() -> None:
    site = Site([(10.0, 8.0)])
    (a,) = site.walkers
    site.world.run(60.0)
    assert a.log == [(10.0, "asks"), (12.062, "enters"), (20.062, "leaves"), (20.062, "done")]
    assert site.words() == [
        *[(float(s), "OPEN") for s in range(10, 16)],
        (20.062, "CLOSED"),
        *[(at, "CLOSED") for at in (21.062, 22.062, 23.062, 24.062, 25.062, 26.062, 27.062)],
    ]
    assert [round(at, 2) for at, _ in site.relay] == [10.0, 23.06]
    assert [on for _, on in site.relay] == [True, False]


def test_only_an_open_door_and_a_heartbeat_with_the_robots_name_let_a_robot_in() -> None:
    site = Site([(10.0, 8.0)])
    (a,) = site.walkers
    site.asks("web", d.DoorModeValue.MODE_OPEN)
    site.world.run(9.9)
    site.ours.leave()
    site.world.run(20.0)
    assert site.door.door.told[-1][1] == "OPEN"
    assert a.log == [(10.0, "asks")]
    site.ours.restart()
    site.world.run(24.0)
    assert a.log[1:] == [(23.0, "enters")]


def test_a_close_goes_out_only_when_the_second_of_two_robots_has_left() -> None:
    site = Site([(10.0, 3.0)], [(13.0, 30.0)])
    a, b = site.walkers
    site.world.run(80.0)
    assert [what for _, what in a.log] == ["asks", "enters", "leaves", "done"]
    assert b.log[1:] == [(13.125, "enters"), (43.125, "leaves"), (43.2, "done")]
    assert [round(at, 3) for at, _ in site.relay] == [10.0, 46.125]


# ---- DOOR-SUPERVISOR-4: restarts


def test_a_supervisor_restarted_with_a_robot_in_the_doorway_closes_nothing() -> None:
    site = Site([(10.0, 60.0)])
    (a,) = site.walkers
    site.world.run(20.0)
    site.restarts(after_s=5.0)
    site.world.run(60.0)
    site.restarts()
    site.world.run(110.0)
    assert a.log[2:] == [(72.062, "leaves"), (72.1, "done")]
    assert site.first_close() == (72.062, "CLOSED")
    assert [round(at, 3) for at, _ in site.relay] == [10.0, 75.062]


def test_the_supervisor_of_rmf_would_close_the_door_on_the_robot() -> None:
    site = Site([(10.0, 60.0)], theirs=True)
    site.world.run(20.0)
    site.rmfs.restart()
    site.world.run(60.0)
    assert site.words()[-1][1] == "CLOSED"
    assert [round(at) for at, _ in site.relay] == [10, 23]


def test_a_supervisor_that_lost_its_memory_closes_nothing_before_its_quiet_start_is_over() -> None:
    site = Site([(10.0, 60.0)])
    site.world.run(20.0)
    site.disk.kept = None
    site.restarts()
    site.world.run(22.9)
    assert site.words()[-1] == (15.0, "OPEN")
    site.asks(A, d.DoorModeValue.MODE_OPEN)
    site.world.run(60.0)
    assert {word for _, word in site.words()} == {"OPEN"}


def test_supervisor_and_door_daemon_restart_together_and_open_again_for_the_robot() -> None:
    site = Site([(10.0, 60.0)])
    site.world.run(20.0)
    site.door.restart()
    site.restarts(after_s=2.0)
    site.world.run(60.0)
    assert [(round(at), on) for at, on in site.relay] == [(10, True), (20, False), (22, True)]
    assert site.door.door.told[-1][1] == "OPEN"


def test_the_session_of_a_restarted_fleet_adapter_is_cleared_at_the_next_heartbeat() -> None:
    site = Site([(10.0, 60.0)])
    (a,) = site.walkers
    site.world.run(20.5)
    a.restart()
    site.world.run(40.0)
    assert site.first_close() == (21.1, "CLOSED")
    assert site.disk.kept == keep.persist({})


def test_with_the_supervisor_of_rmf_the_session_of_a_restarted_adapter_stays_for_ever() -> None:
    site = Site([(10.0, 60.0)], theirs=True)
    (a,) = site.walkers
    site.world.run(20.5)
    a.restart()
    site.world.run(1000.0)
    assert [on for _, on in site.relay] == [True]


# ---- DOOR-SUPERVISOR-2: a door that was offline


def test_a_door_that_was_offline_opens_again_for_an_open_session() -> None:
    site = Site([(10.0, 60.0)])
    (a,) = site.walkers
    site.door.door.bus.down = "no reply"
    site.world.run(30.0)
    assert a.log == [(10.0, "asks")]
    site.door.door.bus.down = ""
    site.world.run(40.0)
    assert [(round(at), what) for at, what in a.log[1:]] == [(32, "enters")]


def test_after_a_power_loss_a_door_opens_again_for_the_robot_inside() -> None:
    site = Site([(10.0, 60.0)])
    site.world.run(20.0)
    site.door.restart()
    site.world.run(40.0)
    assert [on for _, on in site.relay] == [True, False, True]
    assert site.relay[-1][0] <= 21.25


# ---- DOOR-SUPERVISOR-3: a door left open


def test_a_door_left_open_from_the_web_raises_an_alarm_and_stays_open() -> None:
    site = Site(open_alarm_s=60.0)
    site.world.run(10.0)
    site.asks("web", d.DoorModeValue.MODE_OPEN)
    site.world.run(69.9)
    assert site.ours.faults() == {}
    site.world.run(600.0)
    assert site.ours.faults() == {WARD: ["DOOR_HELD_OPEN: longer than 60 s by web"]}
    assert [on for _, on in site.relay] == [True]
    site.asks("web", d.DoorModeValue.MODE_CLOSED)
    site.world.run(610.0)
    assert site.ours.faults() == {}
    assert [on for _, on in site.relay] == [True, False]


# ---- DOOR-SUPERVISOR-4: another supervisor


def test_our_supervisor_is_passive_beside_another_and_takes_over_without_a_close() -> None:
    site = Site([(10.0, 60.0)])
    theirs = RmfsSupervisor(site.world)
    site.world.run(30.0)
    assert {who for _, who, topic, _ in site.world.sent if topic in SUPERVISORS} == {theirs.name}
    theirs.leave()
    site.world.run(60.0)
    after = [(at, who, word) for at, who, word in to_door(site.world) if at > 30.0]
    assert after == [(33.25, "supervisor", "OPEN")]
    theirs.restart()
    site.world.run(60.25)
    at = len(site.world.sent)
    site.world.run(70.0)
    assert "supervisor" not in {who for _, who, _, _ in site.world.sent[at:]}


SUPERVISORS = (topics.DOOR_REQUESTS, topics.DOOR_SUPERVISOR_HEARTBEAT)


# ---- the heartbeat, and several doors


def test_the_heartbeat_goes_out_each_second_and_when_the_table_changes() -> None:
    site = Site([(5.25, 2.0)])
    site.world.run(8.5)
    beats = [
        (at, [(s.door_name, [h.requester_id for h in s.sessions]) for s in beat.all_sessions])
        for at, _, topic, beat in site.world.sent
        if topic == topics.DOOR_SUPERVISOR_HEARTBEAT
    ]
    listed = [(WARD, [A])]
    assert beats == [
        (3.0, []),
        (4.0, []),
        (5.0, []),
        (5.25, listed),
        (6.25, listed),
        (6.35, listed),  # the robot has repeated its request
        (7.25, listed),
        (8.25, listed),  # the robot is inside
    ]


def test_each_door_has_its_own_table() -> None:
    site = Site(doors=None)
    DoorDaemon(site.world, "lab")
    site.world.run(5.0)
    site.asks(A, d.DoorModeValue.MODE_OPEN)
    site.asks(A, d.DoorModeValue.MODE_CLOSED, "lab")
    site.world.run(20.0)
    asked = {
        (said.door_name, said.requested_mode.value)
        for _, _, topic, said in site.world.sent
        if topic == topics.DOOR_REQUESTS
    }
    assert asked == {(WARD, d.DoorModeValue.MODE_OPEN)}


def test_a_door_that_falls_silent_is_forgotten() -> None:
    site = Site()
    site.world.run(5.0)
    site.world.remove("ward")
    site.world.run(63.9)
    assert site.ours.subjects == [WARD]
    site.world.run(66.0)
    assert site.ours.subjects == []
    assert site.ours.wake_at() < NEVER


def doorway(*, rival: bool = False, quiet_s: float = 3.0) -> Site:
    """Return a site in which the door's daemon and our supervisor were killed and restarted.

    A robot stands in the doorway and sends nothing.
    """
    site = Site([(10.0, 60.0)], quiet_start_s=quiet_s)
    site.world.run(25.0)
    assert site.walkers[0].passing
    if rival:
        site.ours.leave()
        RmfsSupervisor(site.world)
        site.ours.restart()
        site.door.restart()
    else:
        site.ours.leave()
        site.door.restart()
        site.ours.restart()
    site.world.run(40.0)
    return site


# ---- DOOR-SUPERVISOR-4: holders that a restart has restored from the disk


def test_a_robot_in_the_doorway_keeps_its_door_when_the_door_and_our_supervisor_die_together() -> (
    None
):
    site = doorway()
    off = [at for at, on in site.relay if not on and at >= 25.0]
    on = [at for at, on in site.relay if on and at >= 25.0]
    assert [round(at, 1) for at in off] == [25.0]
    assert on[0] - off[0] < 0.5
    assert {word for at, word in site.words() if at >= 25.0} == {"OPEN"}


def test_beside_a_rival_no_open_is_sent_for_restored_holders() -> None:
    site = doorway(rival=True)
    assert {who for at, who, _ in to_door(site.world) if at >= 25.0} == {"rmf_supervisor"}


def test_a_door_that_shows_closed_is_not_opened_for_restored_holders() -> None:
    site = Site([(10.0, 60.0)])
    site.world.run(25.0)
    site.ours.leave()
    site.door.restart()
    site.world.run(32.0)
    assert site.door.door.report.mode == d.DoorModeValue.MODE_CLOSED
    site.ours.restart()
    site.world.run(34.9)
    assert [word for at, word in site.words() if at >= 32.0] == []
    site.world.run(36.0)
    assert site.words()[-1][1] == "OPEN"

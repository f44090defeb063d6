"""Stories of a dispenser in virtual time. They contain RMF's phase DispenseItem, the daemon, its disk
and the machine."""

from collections.abc import Callable

import pytest
from msgspec.structs import replace

from bridges.kinds.dispenser.settings import WorkcellDurations
from bridges.messages import definitions as d
from tests.kinds.dispenser.world import BOX, NAME, SETTINGS, World
from workbench.rmf_model.workcells import WorkcellPhase

JAR = (d.DispenserRequestItem("jar", 1),)


def over(*phases: WorkcellPhase) -> Callable[[], bool]:
    return lambda: all(phase.outcome for phase in phases)


def finished(world: World, guid: str = "task", seconds: float = 20.0) -> WorkcellPhase:
    """Let RMF repeat its request until its phase is completed or has failed, or until `seconds` have
    passed."""
    phase = world.ask(guid)
    world.run(seconds, until=over(phase))
    return phase


# ---- DISPENSER-1: one cycle for one guid


def test_a_dispensing_is_acknowledged_runs_once_and_succeeds() -> None:
    world = World()
    phase = finished(world)
    assert (phase.outcome, world.plant.moved) == ("completed", 1)
    assert world.results() == ["ACKNOWLEDGED", "SUCCESS"]
    assert world.relays() == [True, False]
    assert world.relays("select_box") == [True, False]
    assert world.run(1.0).state.mode == d.WorkcellMode.IDLE
    assert world.state.request_guid_queue == ()


def test_a_repeated_request_repeats_its_result_and_moves_nothing() -> None:
    world = World()
    finished(world)
    again = finished(world, seconds=3.0)
    assert (again.outcome, again.why) == ("completed", "a result SUCCESS")
    assert world.plant.moved == 1


def test_two_robots_are_served_in_turn_each_with_its_own_result() -> None:
    world = World()
    one, other = world.ask("one"), world.ask("other")
    world.run(2.0)
    assert world.state.request_guid_queue == ("one", "other")
    assert world.plant.moved == 0
    world.run(12.0, until=over(one, other))
    assert (one.outcome, other.outcome, world.plant.moved) == ("completed", "completed", 2)


# ---- DISPENSER-2: the daemon acts only after a write to its disk


def test_nothing_is_listed_acknowledged_or_started_while_the_disk_is_full() -> None:
    world = World()
    world.run(1.0)
    world.disk.full = "no space left on device"
    phase = world.ask()
    world.run(5.0)
    assert (phase.outcome, world.results(), world.relays()) == ("", [], [])
    assert world.state.request_guid_queue == ()
    assert world.faults == ["NOT_KEPT"]
    assert world.state.mode == d.WorkcellMode.OFFLINE
    world.disk.full = ""
    world.run(10.0, until=over(phase))
    assert (phase.outcome, world.plant.moved, world.faults) == ("completed", 1, [])


def test_a_request_that_rmf_gave_up_while_its_start_was_not_on_disk_does_not_run() -> None:
    world = World()
    world.run(1.0)
    phase = world.ask()
    world.run(5.0, until=lambda: world.state.request_guid_queue == ("task",))
    world.disk.full = "no space left on device"
    world.run(0.5)
    phase.outcome = "failed"  # RMF's task has ended for another reason
    world.run(10.0)
    world.disk.full = ""
    world.run(10.0)
    assert (world.relays(), world.plant.moved) == ([], 0)


def test_an_outcome_is_published_only_after_it_is_on_disk() -> None:
    world = World()
    phase = world.ask()
    world.run(5.0, until=lambda: world.relays() == [True])
    world.disk.full = "no space left on device"
    world.run(6.0)
    assert (world.plant.moved, phase.outcome) == (1, "")
    assert world.state.request_guid_queue == ("task",)
    world.disk.full = ""
    world.run(3.0, until=over(phase))
    assert phase.outcome == "completed"


# ---- DISPENSER-3: a failed request stays listed


def test_a_lost_failure_is_repeated_and_no_state_completes_the_request_meanwhile() -> None:
    world = World(lose=lambda topic, number: topic == "dispenser_results" and 0 < number < 30)
    world.plant.fail("conveyor", "stuck")
    phase = finished(world, seconds=60.0)
    assert (phase.outcome, phase.why) == ("failed", "a result FAILED")
    assert world.state.request_guid_queue == ("task",)


# ---- DISPENSER-4: when a cycle starts


def test_a_request_that_rmf_no_longer_repeats_stays_listed_and_does_not_run() -> None:
    world = World()
    world.plant.press("hatch", True, 0.0)
    phase = world.ask()
    world.run(3.0)
    assert world.status["waits"] == "for the workcell to be ready"
    phase.outcome = "failed"
    world.run(8.0)
    world.plant.press("hatch", False, world.now)
    world.run(5.0)
    assert (world.relays(), world.state.request_guid_queue) == ([], ("task",))
    assert world.status["waits"] == "for RMF to repeat the request"
    assert finished(world).outcome == "completed"


def test_no_cycle_starts_while_done_of_the_last_cycle_is_on() -> None:
    world = World()
    world.run(1.0)
    world.plant.fail("done", "stuck")
    world.plant.fail("done", "wrong")
    world.ask()
    world.run(4.0)
    assert world.relays() == []
    assert world.status["waits"] == "for done of the last cycle to end"
    assert world.results() == ["ACKNOWLEDGED"]


def test_no_cycle_starts_with_a_rival_a_fault_or_a_dead_bus() -> None:
    for hinder, code in (
        (lambda world: world.rival(), "TWO_NODES_FOR_ONE_DEVICE"),
        (lambda world: world.plant.press("fault", True, world.now), "WORKCELL_FAULT"),
        (lambda world: setattr(world.far, "down", "no answer"), "COMMUNICATION_LOST"),
    ):
        world = World()
        world.run(1.0)
        hinder(world)
        world.run(2.0)
        world.ask()
        world.run(2.5)
        assert (world.relays(), world.faults) == ([], [code])
        assert world.state.mode == d.WorkcellMode.OFFLINE
        assert world.state.request_guid_queue == ("task",)
        assert world.status["waits"] == f"because of {code}"


# ---- DISPENSER-5: how a cycle ends


@pytest.mark.parametrize(
    ("failure", "why"),
    [
        ("stuck", "done did not come within 8 s"),
        ("wrong", "it reports a fault: its fault contact is on"),
        ("garbage", "it has stopped, and done did not come within 1 s"),
    ],
)
def test_a_failed_cycle_is_reported_with_outputs_off_and_waits_for_a_reset(
    failure: str, why: str
) -> None:
    world = World()
    world.plant.fail("conveyor", failure)  # type: ignore[arg-type]
    phase = finished(world)
    assert (phase.outcome, world.plant.moved) == ("failed", 0)
    assert world.relays()[-1:] == [False]
    assert world.relays("select_box")[-1:] == [False]
    assert "WORKCELL_HALTED" in world.faults
    assert why in str(world.status["faults"])
    world.plant.fail("conveyor", None)
    world.plant.press("restart", True, world.now)
    world.plant.press("restart", False, world.now)
    following = finished(world, "next", seconds=6.0)
    assert (following.outcome, world.plant.moved) == ("", 0)
    world.reset()
    world.run(10.0, until=over(following))
    assert (following.outcome, world.plant.moved) == ("completed", 1)


def test_a_slow_machine_succeeds_within_the_limit_and_fails_beyond() -> None:
    for limit_s, outcome in ((20.0, "completed"), (5.0, "failed")):
        world = World(replace(SETTINGS, limits=WorkcellDurations(cycle_limit_s=limit_s)))
        world.plant.fail("conveyor", "slow")
        assert finished(world, seconds=30.0).outcome == outcome


def test_a_steady_start_is_on_until_done() -> None:
    world = World(replace(SETTINGS, pulse_s=None))
    phase = world.ask()
    world.run(10.0, until=lambda: world.relays() == [True])
    world.run(1.875)
    assert (world.plant.moved, world.relays()) == (0, [True])
    world.run(2.0)
    assert (phase.outcome, world.relays()) == ("completed", [True, False])


# ---- DISPENSER-6: failures during a cycle


def test_a_plc_that_restarts_in_mid_cycle_does_not_dispense_twice() -> None:
    """After a restart a PLC would count a start signal that is still on as a new start."""
    limits = WorkcellDurations(cycle_limit_s=8.0, settle_s=4.0)
    world = World(replace(SETTINGS, pulse_s=None, limits=limits))
    phase = world.ask()
    world.run(5.0, until=lambda: world.relays() == [True])
    world.run(0.5)
    world.plant.press("restart", True, world.now)
    world.run(0.25)
    world.plant.press("restart", False, world.now)
    world.run(20.0, until=over(phase))
    assert (phase.outcome, world.plant.moved) == ("failed", 0)
    assert world.relays() == [True, False]


def test_after_a_failed_reading_the_start_stays_off_and_done_still_counts() -> None:
    world = World(replace(SETTINGS, pulse_s=0.75))
    phase = world.ask()
    world.run(5.0, until=lambda: world.relays() == [True])
    world.far.down = "no answer"
    world.run(0.25)
    world.far.down = ""
    world.run(10.0, until=over(phase))
    assert (phase.outcome, world.plant.moved) == ("completed", 1)
    assert world.relays() == [True, False]


# ---- DISPENSER-7: requests in doubt


def doubtful(world: World) -> WorkcellPhase:
    """Kill the daemon in the middle of a dispensing cycle, so that the outcome is in doubt. Return
    RMF's phase."""
    phase = world.ask()
    world.run(5.0, until=lambda: world.relays() == [True])
    world.run(0.25)
    world.kill()
    world.run(6.0)
    assert (world.faults, phase.outcome) == (["OUTCOME_UNKNOWN"], "")
    assert world.state.mode == d.WorkcellMode.OFFLINE
    assert world.state.request_guid_queue == ("task",)
    assert "ended in the middle" in str(world.status["faults"])
    return phase


@pytest.mark.parametrize(
    ("verdict", "outcome", "moved"),
    [("done", "completed", 1), ("failed", "failed", 1), ("again", "completed", 2)],
)
def test_a_person_decides_a_cycle_whose_end_the_daemon_did_not_see(
    verdict: str, outcome: str, moved: int
) -> None:
    world = World()
    phase = doubtful(world)
    before = world.plant.moved
    world.decide(verdict)
    world.run(10.0, until=over(phase))
    assert (before, phase.outcome, world.plant.moved) == (1, outcome, moved)
    assert world.faults == []


def test_a_decision_about_another_request_changes_nothing() -> None:
    world = World()
    phase = doubtful(world)
    world.decide("done", "another")
    world.run(3.0)
    assert (phase.outcome, world.faults) == ("", ["OUTCOME_UNKNOWN"])
    assert world.status["refused"] == {"nothing in doubt": 1}
    world.decide("done", "task")
    world.run(3.0, until=over(phase))
    assert phase.outcome == "completed"


def test_a_doubt_outlives_a_further_restart() -> None:
    world = World()
    doubtful(world)
    world.kill()
    world.run(3.0)
    assert world.faults == ["OUTCOME_UNKNOWN"]


@pytest.mark.parametrize("content", [None, b"", b'{"version":2}', b'{"version":1,"devices":{}}'])
def test_a_daemon_without_its_memory_is_offline_and_gives_no_result_until_a_person_decides(
    content: bytes | None,
) -> None:
    world = World(new=False)
    world.disk.content = content
    phase = world.ask()
    world.run(8.0)
    assert world.faults == ["MEMORY_LOST", "OUTCOME_UNKNOWN"]
    assert (phase.outcome, world.results(), world.relays()) == ("", [], [])
    assert world.state.mode == d.WorkcellMode.OFFLINE
    world.kill()
    world.run(4.0)
    assert world.faults == ["MEMORY_LOST", "OUTCOME_UNKNOWN"]
    world.decide("again")
    world.run(10.0, until=over(phase))
    assert (phase.outcome, world.plant.moved, world.faults) == ("completed", 1, [])


def test_a_lost_memory_completes_no_request_that_the_daemon_has_acknowledged_before() -> None:
    """After the restart the daemon's first states list no request. RMF must not take this for the end
    of the request. RMF ignores these states, because their stamp is 0."""
    world = World(new=False)
    world.decide("again")
    world.run(1.0)
    world.plant.fail("conveyor", "stuck")
    phase = world.ask()
    world.run(3.0)
    assert world.results() == ["ACKNOWLEDGED"]
    world.kill()
    world.disk.content = None
    world.run(8.0)
    assert (phase.outcome, world.plant.moved) == ("", 0)
    assert world.state.time == d.Time()
    assert world.faults == ["MEMORY_LOST", "OUTCOME_UNKNOWN"]


def test_a_damaged_entry_loses_the_memory_of_its_device() -> None:
    world = World(new=False)
    world.disk.content = b'{"version":1,"devices":{"store":{"version":1,"jobs":[{"guid":"x"}]}}}'
    world.run(2.0)
    assert world.faults == ["MEMORY_LOST"]
    assert "damaged" in str(world.status["faults"])


def test_the_guid_of_a_finished_request_with_other_items_is_in_doubt() -> None:
    """RMF uses the same guid for two pickups of one task (tasks/Delivery.cpp)."""
    world = World()
    finished(world)
    second = world.ask(items=JAR)
    world.run(3.0)
    assert (second.outcome, world.faults) == ("", ["OUTCOME_UNKNOWN"])
    assert "1 jar" in str(world.status["faults"])
    world.decide("again", "task")
    world.run(10.0, until=over(second))
    assert (second.outcome, world.plant.moved) == ("completed", 2)
    assert world.relays("select_jar") == [True, False]


def test_the_guid_of_a_waiting_request_with_other_items_is_refused() -> None:
    world = World()
    world.plant.press("hatch", True, 0.0)
    world.ask()
    world.run(2.0)
    world.ask(items=JAR)
    world.run(2.0)
    assert world.status["refused"] == {"guid of another request": 2}


def test_the_guid_of_a_finished_request_is_in_doubt_after_a_long_silence() -> None:
    """Guids can repeat, because rmf_task_ros2 makes them from five random hexadecimal digits, or counts
    from 0 after each start."""
    world = World()
    finished(world)
    world.run(301.0)
    phase = world.ask()
    world.run(3.0)
    assert (phase.outcome, world.faults) == ("", ["OUTCOME_UNKNOWN"])
    world.decide("again")
    world.run(10.0, until=over(phase))
    assert (phase.outcome, world.plant.moved) == ("completed", 2)


def test_a_restart_does_not_forget_that_rmf_had_been_silent() -> None:
    world = World()
    finished(world)
    world.run(301.0)
    world.kill()
    world.run(1.0)
    world.ask()
    world.run(3.0)
    assert world.faults == ["OUTCOME_UNKNOWN"]


# ---- DISPENSER-8: when the daemon forgets a request


def test_a_request_is_forgotten_a_day_after_rmfs_last_request() -> None:
    world = World()
    finished(world)
    world.now += 86400.0
    assert world.daemon
    world.run(1.0)
    assert finished(world).why == "a newer state that does not list it"
    assert world.plant.moved == 2


# ---- requests that the daemon cannot obey


@pytest.mark.parametrize(
    "items",
    [
        (),
        (*BOX, *JAR),
        (d.DispenserRequestItem("coke", 1),),
        (d.DispenserRequestItem("box", 2),),
        (d.DispenserRequestItem("box", 0),),
        (d.DispenserRequestItem("box", 1, "left"),),
    ],
)
def test_items_that_the_wiring_cannot_express_fail_at_once(items: object) -> None:
    world = World()
    phase = world.ask(items=items)
    world.run(3.0, until=over(phase))
    assert (phase.outcome, world.relays(), world.faults) == ("failed", [], [])
    assert world.state.request_guid_queue == ()


def test_a_doubt_names_the_content_and_the_fleet() -> None:
    world = World()
    doubtful(world)
    assert "task (1 box for robot): the daemon ended" in str(world.status["faults"])


def test_a_guid_that_cannot_be_printed_is_refused() -> None:
    world = World()
    world.run(1.0)
    world.ask("a\nb")
    world.run(1.5)
    assert world.status["refused"] == {"impossible request_guid": 2}


def test_a_request_without_a_guid_is_refused_without_an_answer() -> None:
    world = World()
    world.run(1.0)
    phase = world.ask("")
    world.run(2.5)
    assert (phase.outcome, world.results("")) == ("", [])
    assert world.status["refused"] == {"empty request_guid": 3}


def test_more_requests_than_robots_are_refused() -> None:
    world = World()
    world.plant.press("hatch", True, 0.0)
    for number in range(101):
        world.ask(f"task {number}")
    world.run(1.5)
    assert len(world.state.request_guid_queue) == 100
    assert world.status["refused"] == {"queue is full": 1}
    assert world.state.guid == NAME

"""What `explain` says of a door when a supervisor, a daemon or a topic is missing."""

from collections.abc import Iterable

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard, Own
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from bridges.runtime.faults import for_explain
from tests.site.network import Place
from tests.site.timeline import EPOCH
from tests.workbench.explain.story import Guest, Scene
from workbench.explain.explanation import Explanation
from workbench.explain.heard_devices import HeardDevices

BOTH = pytest.mark.parametrize("rmf", [False, True])
SUPERVISOR = {False: "door_supervisor", True: "rmf_door_supervisor"}
OPEN = d.DoorModeValue.MODE_OPEN
CUT_OFF_S = 1000.0


def explained(heard: Iterable[Heard | Own], without: tuple[str, ...] = ()) -> Explanation:
    """Explain the door ward, from a recording without these topics."""
    site = HeardDevices("ward")
    for one in heard:
        if one.topic.rpartition("/")[2] not in without:
            site.take(one)
    return site.explain("door", "ward", None, for_explain())


def told(found: Explanation) -> str:
    return " ".join(found.now)


def does(found: Explanation) -> str:
    (step,) = found.next
    return f"{step.who}: {step.what}"


def passes(rmf: bool) -> tuple[Scene, Guest]:
    """Let a robot stand in the open doorway."""
    scene = Scene("ward", rmf=rmf)
    red = scene.robot("fleet/red")
    red.opens("ward")
    scene.until(red)
    scene.run(2.0)
    return scene, red


def stuck(*, rmf: bool = False, diagnoses: bool = True) -> Scene:
    """Let a robot wait for a door that does not move."""
    scene = Scene("ward", rmf=rmf, diagnoses=diagnoses)
    scene.fail("ward", "operator", "stuck")
    scene.robot("fleet/red").opens("ward")
    scene.run(20.0)
    return scene


# ---- the supervisor


@BOTH
def test_a_supervisor_that_died_after_its_heartbeat_is_restarted(rmf: bool) -> None:
    scene, _ = passes(rmf)
    scene.supervisors[SUPERVISOR[rmf]].kill()
    scene.run(1.0)
    scene.robot("fleet/blue").opens("ward")
    scene.run(15.0)
    found = explained(scene.heard)
    assert "No heartbeat has come since 08:00:" in told(found)
    assert "fleet/red held it" in told(found)
    assert "has been held by" not in told(found)
    assert does(found).startswith("a person: restart the door supervisor")


@BOTH
def test_a_supervisor_that_died_before_close_is_restarted(rmf: bool) -> None:
    scene, red = passes(rmf)
    scene.supervisors[SUPERVISOR[rmf]].kill()
    red.closes("ward")
    scene.run(2.0)
    assert does(explained(scene.heard)).startswith("the supervisor: remove fleet/red")
    scene.run(13.0)
    found = explained(scene.heard)
    assert "No heartbeat has come since 08:00:" in told(found)
    assert does(found).startswith("a person: restart the door supervisor")


@BOTH
def test_an_old_heartbeat_without_requests_accuses_no_supervisor(rmf: bool) -> None:
    """RMF's supervisor sends a heartbeat only after a request."""
    scene, red = passes(rmf)
    red.closes("ward")
    scene.run(40.0)
    scene.robot("fleet/blue").opens("ward")
    scene.run(0.05)
    assert "No heartbeat" not in told(explained(scene.heard))
    scene.run(1.0)
    assert "held by fleet/blue" in told(explained(scene.heard))


@pytest.mark.parametrize("closes", [False, True])
def test_our_supervisor_that_does_not_hear_the_robot_is_not_accused_of_refusing(
    closes: bool,
) -> None:
    scene = Scene("ward")
    red = scene.robot("fleet/red")
    if closes:
        red.opens("ward")
        scene.until(red)
    scene.air.cut_off("fleet/red", scene.timeline.now + CUT_OFF_S)
    red.closes("ward") if closes else red.opens("ward")
    scene.run(15.0)
    found = explained(scene.heard)
    assert "the requests do not reach it" in told(found)
    assert does(found).startswith("a person: check the network between the fleet adapter of")


def test_our_supervisor_that_only_listens_has_taken_the_request() -> None:
    """Another node's publisher on `door_requests` keeps our supervisor silent."""
    scene = Scene("ward")
    Place(scene.air, "forgotten_pub", lambda: None).publisher(topics.DOOR_REQUESTS)
    scene.run(5.0)
    scene.robot("fleet/red").opens("ward")
    scene.run(15.0)
    found = explained(scene.heard)
    assert "reports that it has taken the request, but no heartbeat says so" in told(found)
    assert does(found).startswith("a person: see what the supervisor waits for")


@BOTH
def test_a_close_stamped_before_its_open_names_the_clock(rmf: bool) -> None:
    scene, red = passes(rmf)
    red.behind_s = 3600.0
    red.closes("ward")
    scene.run(6.0)
    found = explained(scene.heard)
    assert "the stamp of this CLOSE is 59 min 52 s older" in told(found)
    assert does(found).startswith("a person: set the clock of the machine with the fleet adapter")


def test_a_clock_that_was_always_slow_is_not_named() -> None:
    scene = Scene("ward", rmf=True)
    red = scene.robot("fleet/red")
    red.behind_s = 3600.0
    red.opens("ward")
    scene.until(red)
    scene.supervisors["rmf_door_supervisor"].kill()
    red.closes("ward")
    scene.run(10.0)
    assert "restart the door supervisor" in does(explained(scene.heard))


# ---- the door's own daemon and node


@BOTH
def test_a_daemon_that_does_not_hear_the_request_is_to_act(rmf: bool) -> None:
    scene = Scene("ward", rmf=rmf)
    scene.air.cut_off("ward", scene.timeline.now + CUT_OFF_S)
    scene.robot("fleet/red").opens("ward")
    scene.run(15.0)
    found = explained(scene.heard)
    assert "The daemon does not hear the request, or does not obey it." in told(found)
    assert does(found).startswith("a person: see in the log of the daemon of ward")


@pytest.mark.parametrize("door", ["ward", "icu"])
def test_a_healthy_door_is_not_called_deaf(door: str) -> None:
    scene = Scene(door)
    red = scene.robot("fleet/red")
    red.opens(door)
    while not red.robot.done:
        scene.run(0.2)
        site = HeardDevices(door)
        for one in scene.heard:
            site.take(one)
        assert "a person" not in {one.who for one in site.explain("door", door, None).next}


def test_whether_a_foreign_node_asks_its_controller_is_not_known() -> None:
    found = explained(stuck(diagnoses=False).heard)
    assert "Whether the node of ward asks its controller to open is not known." in told(found)
    assert does(found).startswith("the device's node: open ward")


# ---- recordings without a topic


@BOTH
def test_without_the_heartbeat_the_order_to_the_door_counts(rmf: bool) -> None:
    found = explained(stuck(rmf=rmf).heard, ("door_supervisor_heartbeat",))
    assert "perhaps it is not recorded" in told(found)
    assert does(found).startswith("the controller: open ward fully")


@pytest.mark.parametrize("more", [(), ("door_supervisor_heartbeat",)])
def test_without_door_requests_the_report_of_the_daemon_counts(more: tuple[str, ...]) -> None:
    found = explained(stuck().heard, ("door_requests", *more))
    assert "Nothing was heard on `door_requests` (perhaps it is not recorded)." in told(found)
    assert does(found).startswith("the controller: open ward fully")


def test_without_door_requests_and_diagnostics_the_order_is_not_known() -> None:
    found = explained(stuck().heard, ("door_requests", "diagnostics"))
    assert "the supervisor sends no OPEN, or this topic is not recorded" in told(found)
    assert does(found).startswith("a person: see whether the log of the node of ward")


def test_states_alone_do_not_prove_that_nobody_waits() -> None:
    missing = (
        "diagnostics",
        "door_requests",
        "adapter_door_requests",
        "door_supervisor_heartbeat",
    )
    found = explained(stuck().heard, missing)
    assert "So nobody waits for the door, or these topics are not recorded." in told(found)
    assert "record `/adapter_door_requests`" in does(found)


def test_the_file_of_a_door_daemon_names_the_robot_that_died_in_the_doorway() -> None:
    scene, red = passes(rmf=False)
    red.dies()
    scene.run(30.0)
    at = scene.timeline.now
    note = '{"subject": "ward", "faults": []}'
    kept: list[Heard | Own] = [*scene.heard, Own(at, EPOCH + at, "rmf_bridge/faults", note)]
    missing = ("diagnostics", "door_supervisor_heartbeat")
    assert does(explained(kept, missing)).startswith("the robot: fleet/red has to drive through")
    scene.run(90.0)
    found = explained([*kept, *scene.heard[len(kept) - 1 :]], missing)
    assert "fleet/red sent OPEN and no CLOSE." in told(found)
    assert does(found) == (
        "a person: look into the doorway; only when the doorway is clear:"
        " `rmf-bridge send door ward close --requester fleet/red`"
    )


# ---- a door that no robot waits for


@BOTH
@pytest.mark.parametrize("door", ["ward", "icu", "gate"])
def test_a_door_that_was_just_released_closes_by_itself(door: str, rmf: bool) -> None:
    scene = Scene(door, rmf=rmf)
    red = scene.robot("fleet/red")
    red.opens(door)
    scene.until(red)
    scene.run(20.0)
    red.closes(door)
    for _ in range(40):
        scene.run(0.25)
        site = HeardDevices(door)
        for one in scene.heard:
            site.take(one)
        steps = site.explain("door", door, None).next
        assert {one.who for one in steps} <= {"nobody", "the supervisor"}, steps


@BOTH
@pytest.mark.parametrize("for_s", [20.0, 80.0])
def test_a_dashboard_is_not_told_to_drive(rmf: bool, for_s: float) -> None:
    scene = Scene("ward", rmf=rmf)
    at = stamp(EPOCH + scene.timeline.now)
    request = d.DoorRequest(at, "dashboard", "ward", d.DoorMode(OPEN))
    scene.says(topics.ADAPTER_DOOR_REQUESTS, request)
    scene.run(for_s)
    found = explained(scene.heard)
    assert "dashboard is no robot's name (FLEET/ROBOT)" in told(found)
    assert "close --requester dashboard" in does(found)
    assert does(found).startswith("a person")


@pytest.mark.parametrize(
    ("code", "do"),
    [
        ("DOOR_OPENING_FAULT", "a person: check the door's command and its relay"),
        ("HAZARD_INPUTS_UNSTEADY", "a person: "),
        ("UNREQUESTED_CHARGING", "nobody: there is nothing to do"),
    ],
)
def test_a_fault_of_an_idle_door_needs_a_person(code: str, do: str) -> None:
    scene = Scene("ward", diagnoses=False)
    status = {"ward": {"mode": "CLOSED", "faults": [{"code": code, "detail": "so it is"}]}}
    scene.says(topics.DIAGNOSTICS, diagnosis("rmf_bridge_ward", "door", {}, status, d.Time()))
    scene.says(topics.DOOR_REQUESTS, d.DoorRequest(door_name="ward", requester_id="x"))
    scene.run(1.0)
    found = explained(scene.heard)
    assert does(found).startswith(do)
    (fault,) = found.faults
    assert not (fault.do and fault.do in does(found))

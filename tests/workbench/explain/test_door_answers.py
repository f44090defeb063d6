"""What `explain` says of a door when a supervisor, a daemon or a topic is missing."""

from collections.abc import Iterable

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard, Own
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from bridges.runtime.faults import for_explain
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

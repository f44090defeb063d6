"""Lifts whose cause is easily mistaken: a floor that is not served, a supervisor that is silent, and
messages that are not heard."""

from typing import Any

import pytest
from msgspec.structs import replace

from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.observe.requesters import DeviceRequester, Moment
from bridges.runtime.faults import for_explain
from tests.site.network import Place
from tests.site.timeline import EPOCH
from tests.workbench.explain.heard_lift import ASKS_AGV, END, RED, asks, each_second, shows
from tests.workbench.explain.story import Scene
from workbench.explain.answer import RELAYS_OFF, clock_of
from workbench.explain.explanation import Explanation
from workbench.explain.heard_devices import HeardDevices

NO_ONE: dict[str, list[str]] = {"lift_requests": [], "adapter_lift_requests": ["adapter"]}


def explained(
    heard: list[Heard], without: tuple[str, ...] = (), senders: dict[str, list[str]] | None = None
) -> Explanation:
    """Explain Lift1 from these messages, without the messages on some topics."""
    site = HeardDevices("Lift1")
    site.senders = senders
    for one in heard:
        if one.topic.rpartition("/")[2] not in without:
            site.take(one)
    return site.explain("lift", "Lift1", None, for_explain())


def said(found: Explanation) -> str:
    return " ".join(found.now)


def steps(found: Explanation) -> dict[str, str]:
    return {step.who: step.what for step in found.next}


def who_acts(found: Explanation) -> list[str]:
    return [step.who for step in found.next]


def boarded(*, rmf: bool = False, diagnoses: bool = True) -> tuple[Scene, Any, Any]:
    """Return a scene in which fleet/red has Lift1 with its door open at L2, and a robot fleet/blue."""
    scene = Scene("Lift1", rmf=rmf, diagnoses=diagnoses)
    red, blue = scene.robot(RED), scene.robot("fleet/blue")
    red.asks("Lift1", "L2")
    scene.until(red)
    scene.run(3.0)
    return scene, red, blue


# ---- a floor that the lift does not serve


@pytest.mark.parametrize("rmf", [False, True])
@pytest.mark.parametrize("diagnoses", [False, True])
@pytest.mark.parametrize("others", [False, True])
def test_a_robot_in_the_car_asks_for_a_floor_that_is_not_served(
    rmf: bool, diagnoses: bool, others: bool
) -> None:
    scene, red, blue = boarded(rmf=rmf, diagnoses=diagnoses)
    if others:
        blue.asks("Lift1", "L3")
    red.asks("Lift1", "B9", inside=True)
    scene.run(20.0)
    found = explained(scene.heard)
    assert "Lift1 serves L1, L2, L3, L4, not B9" in said(found)
    assert who_acts(found) == ["a person"]
    assert "floor that fleet/red asks for the same name" in steps(found)["a person"]


@pytest.mark.parametrize("first", [False, True])
def test_a_robot_behind_another_asks_for_a_floor_that_is_not_served(first: bool) -> None:
    """The robot that asks in vain may have come before or after another robot that waits."""
    scene, _, blue = boarded()
    green = scene.robot("fleet/green")
    for one, floor in [(blue, "B9"), (green, "L1")][:: 1 if first else -1]:
        one.asks("Lift1", floor)
        scene.run(1.0)
    scene.run(10.0)
    found = explained(scene.heard)
    assert "not B9, so it never fulfils the request of fleet/blue" in said(found)
    assert "floor that fleet/blue asks for" in steps(found)["a person"]
    assert "fleet/red has to drive" in steps(found)["the robot"]


# ---- a supervisor that passes nothing on


@pytest.mark.parametrize("behind_s", [3600.0, -3600.0])
@pytest.mark.parametrize("senders", [None, NO_ONE])
def test_without_a_supervisor_a_robots_clock_is_not_the_cause(
    behind_s: float, senders: dict[str, list[str]] | None
) -> None:
    """A recording does not tell whether a supervisor of another make drops the requests."""
    scene = Scene("Lift1")
    scene.supervisors["lift_supervisor"].kill()
    scene.run(1.0)
    red = scene.robot(RED)
    red.behind_s = behind_s
    red.asks("Lift1", "L2")
    scene.run(20.0)
    found = explained(scene.heard, senders=senders)
    assert "the lift supervisor is not running" in said(found)
    assert ("NTP" in steps(found)["a person"]) == (senders is None)
    assert "RMF's lift supervisor does not compare stamps" in found.notes[0]


def test_a_passive_supervisor_names_its_reason_though_a_robots_clock_is_wrong() -> None:
    scene = Scene("Lift1")
    Place(scene.air, "forgotten_pub", lambda: None).publisher(topics.LIFT_REQUESTS)
    scene.run(5.0)
    red = scene.robot(RED)
    red.behind_s = 3600.0
    red.asks("Lift1", "L2")
    scene.run(20.0)
    found = explained(scene.heard)
    assert "the lift supervisor is running, but does not pass it on" in said(found)
    assert steps(found) == {
        "a person": "the supervisor waits while /forgotten_pub publishes lift_requests: remove this"
        " cause"
    }


@pytest.mark.parametrize("free", [False, True])
def test_a_supervisor_that_has_just_started_needs_nobody(free: bool) -> None:
    scene, red, blue = boarded()
    if free:
        red.ends("Lift1")
        scene.until(red)
    supervisor = scene.supervisors["lift_supervisor"]
    supervisor.kill()
    scene.run(3.0)
    blue.asks("Lift1", "L1")
    supervisor.start()
    scene.run(2.5)
    found = explained(scene.heard)
    assert "has just started, and only listens" in said(found)
    assert steps(found) == {"nobody": "wait a moment"}


def test_a_lift_that_never_grants_does_not_prove_a_dead_supervisor_without_lift_requests() -> None:
    lines = [*each_second(0, 30, shows), *each_second(4.1, 30, lambda s: asks(s, "L3"))]
    lines.sort(key=lambda one: one.at)
    found = explained(lines)
    assert "or is cut off, or this topic was not recorded." in said(found)
    assert steps(found)["a person"].startswith("see whether the lift supervisor runs; if not,")
    live = explained(lines, senders=NO_ONE)
    assert steps(live)["a person"].startswith("restart the lift supervisor")


def test_a_supervisor_that_waits_for_the_lift_sends_requests_that_are_not_recorded() -> None:
    scene = Scene("Lift1")
    scene.robot(RED).asks("Lift1", "L2")
    scene.daemons["Lift1"].kill()
    scene.run(1.0)
    scene.heard.clear()
    state = shows(0.0).message
    mouth = Place(scene.air, "other", lambda: None).publisher(topics.LIFT_STATES)
    for _ in range(12):
        mouth.publish(state)
        scene.run(1.0)
    found = explained(scene.heard, without=("lift_requests",))
    assert "gives no reason not to pass it on, so its messages may be lost" in said(found)
    assert "the request waits for the lift to take fleet/red" in said(found)
    assert steps(found)["a person"].startswith("see whether the log of the lift's node")


def test_a_supervisor_that_waits_for_the_holders_end_has_no_cause_to_remove() -> None:
    """The recorder of the supervisor's requests has stopped in the middle."""
    scene, red, blue = boarded()
    blue.asks("Lift1", "L1")
    scene.run(10.0)
    stopped = scene.timeline.now - 6.0
    heard = [one for one in scene.heard if one.at < stopped or one.topic != "lift_requests"]
    found = explained(heard)
    assert red.robot.done
    assert "its messages may be lost, or missing in the recording" in said(found)
    assert "remove this cause" not in steps(found)["a person"]


@pytest.mark.parametrize("ends", [False, True])
def test_a_recording_that_begins_in_a_ride_does_not_tell_what_is_passed_on(ends: bool) -> None:
    scene, red, _ = boarded(rmf=True)
    red.asks("Lift1", "L2")
    scene.supervisors["rmf_lift_supervisor"].kill()
    scene.heard.clear()
    if ends:
        red.ends("Lift1")
    scene.run(10.0)
    found = explained(scene.heard)
    assert "supervisor is not running" not in said(found)
    assert ("not known whether the supervisor passed the END on" in said(found)) == ends
    assert who_acts(found) == ["a person" if ends else "the robot"]


# ---- messages that are not heard


@pytest.mark.parametrize("diagnoses", [False, True])
def test_a_recording_without_requests_does_not_tell_what_the_holder_does(diagnoses: bool) -> None:
    scene, _, _ = boarded(diagnoses=diagnoses)
    scene.run(25.0)
    found = explained(scene.heard, without=("adapter_lift_requests", "lift_requests"))
    assert "it is not known whether fleet/red still requests the lift" in said(found)
    assert "has sent no request" not in said(found)
    assert "record `/adapter_lift_requests`" in steps(found)["a person"]


def test_a_holder_that_its_supervisor_misses_is_silent_though_no_request_was_recorded() -> None:
    scene, red, _ = boarded()
    red.dies()
    scene.run(70.0)
    found = explained(scene.heard, without=("adapter_lift_requests", "lift_requests"))
    assert "fleet/red has sent no request and no END" in said(found)


@pytest.mark.parametrize("rides", [False, True])
def test_states_that_reach_only_the_listener(rides: bool) -> None:
    scene, red, blue = boarded()
    if not rides:
        red.ends("Lift1")
        scene.until(red)
        scene.run(3.0)
    scene.air.cut_off("Lift1", scene.timeline.now + 1000.0)
    (red if rides else blue).asks("Lift1", "L4", inside=rides)
    scene.run(30.0)
    found = explained(scene.heard)
    assert "The supervisor of Lift1 has missed the lift's states since" in said(found)
    assert "look at the network between the daemon of Lift1" in steps(found)["a person"]
    assert "Nobody requests the lift" not in said(found)


@pytest.mark.parametrize("ends", [False, True])
def test_a_supervisor_that_is_cut_off_from_a_lift_whose_states_arrive(ends: bool) -> None:
    scene, red, blue = boarded()
    scene.air.cut_off("lift_supervisor", scene.timeline.now + 1000.0)
    blue.asks("Lift1", "L1")
    if ends:
        blue.ends("Lift1")
        red.ends("Lift1")
    scene.run(20.0)
    found = explained(scene.heard)
    assert "though fleet adapters answer them: the supervisor is cut off" in said(found)
    assert steps(found)["a person"].startswith("look at the network of the lift supervisor")


def test_states_that_have_come_back_reach_the_supervisor() -> None:
    """The supervisor's last report is older than the lift's first new state."""
    scene, _, blue = boarded()
    blue.asks("Lift1", "L1")
    daemon = scene.daemons["Lift1"]
    daemon.kill()
    scene.run(20.0)
    daemon.start()
    for _ in range(20):
        scene.run(0.2)
        assert "has missed the lift's states" not in said(explained(scene.heard))


def test_a_robot_may_not_hear_the_states_of_a_lift_that_nobody_requests() -> None:
    scene = Scene("Lift1", rmf=True, diagnoses=False)
    red = scene.robot(RED)
    scene.air.cut_off("Lift1", scene.timeline.now + 1000.0)
    red.asks("Lift1", "L3")
    scene.run(30.0)
    found = explained(scene.heard)
    assert "fleet/red asked for it at L3 until" in said(found)
    assert "or does not hear the lift's states" in said(found)
    assert who_acts(found) == ["a person"]
    scene.run(600.0)
    assert who_acts(explained(scene.heard)) == ["nobody"]


@pytest.mark.parametrize("ends", [False, True])
def test_a_robot_that_has_ended_or_asks_elsewhere_waits_no_longer(ends: bool) -> None:
    last = asks(20.0, kind=END if ends else ASKS_AGV)
    message = last.message if ends else replace(last.message, lift_name="Lift2")
    lines = [*each_second(0, 40, shows), asks(5.0), replace(last, message=message)]
    found = explained(sorted(lines, key=lambda one: one.at))
    assert who_acts(found) == ["nobody"]


# ---- a lift at rest, and a healthy ride


def test_the_fault_of_an_idle_lift_is_somebodys() -> None:
    """RMF's supervisor restarts while the robot's adapter is dead, and ends the session."""
    scene, red, _ = boarded(rmf=True)
    supervisor = scene.supervisors["rmf_lift_supervisor"]
    supervisor.kill()
    red.dies()
    scene.run(2.0)
    supervisor.start()
    scene.run(20.0)
    found = explained(scene.heard)
    assert "Nobody requests the lift. But Lift1 has a fault, ROBOT_LEFT_IN_CAR" in said(found)
    assert who_acts(found) == ["a person"]
    assert steps(found)["a person"].startswith("look into the car")


@pytest.mark.parametrize("name", ["Lift1", "Lift2"])
def test_a_healthy_ride_needs_no_person_and_no_relay_is_off(name: str) -> None:
    scene = Scene(name)
    red = scene.robot(RED)
    site, taken = HeardDevices(name), 0
    for floor, inside in (("L3", False), ("L1", True)):
        red.asks(name, floor, inside=inside)
        for _ in range(75):
            scene.run(0.2)
            for one in scene.heard[taken:]:
                site.take(one)
            taken = len(scene.heard)
            site.pass_time(scene.timeline.now, EPOCH + scene.timeline.now)
            found = site.explain("lift", name, None, for_explain())
            assert "a person" not in steps(found), found.now
            assert RELAYS_OFF not in said(found)


# ---- clocks


@pytest.mark.parametrize(
    ("age_s", "kind", "note"),
    [
        (60.0, "lift", "our lift supervisor may take the first request only when it has been"),
        (-60.0, "lift", "our lift supervisor takes such requests at once"),
        (60.0, "door", "RMF's door supervisor drops a CLOSE that is older than the OPEN"),
        (-60.0, "door", "RMF's door supervisor drops a CLOSE that is older than the OPEN"),
    ],
)
def test_a_clocks_note_tells_what_the_supervisors_of_this_kind_do(
    age_s: float, kind: Any, note: str
) -> None:
    at = Moment(0.0, EPOCH)
    one = DeviceRequester(RED, "L2", at, at, at, at, stamped=True, stamp_age_s=age_s)
    told = clock_of(one, kind)
    assert len(told) == 1
    assert note in told[0]
    assert ("ahead of" in told[0]) == (age_s < 0)

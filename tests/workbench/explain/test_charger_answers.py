"""What `explain` says of a charger's faults and refusals, and of a robot that waits for a charger. The
coordinator's own code writes the queue."""

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.observe.diagnosis import Diagnosis
from bridges.observe.requesters import Moment
from bridges.runtime.diagnostics import diagnosis
from bridges.runtime.faults import for_explain
from tests.site.charging import Charge, settings
from tests.site.network import Place
from tests.workbench.explain.story import Scene
from workbench.explain.charger_wishes import steps
from workbench.explain.explanation import Explanation, NextStep
from workbench.explain.heard_devices import HeardDevices
from workbench.graph.board import Board

BAYS = ("bay1", "bay2", "bay3")


class Fleet:
    """A fleet adapter that publishes the states of these robots at 1 Hz."""

    def __init__(self, scene: Scene, *robots: str) -> None:
        known = settings(BAYS, robots)
        self.robots = {name: Charge(name, known) for name in robots}
        self.place = Place(scene.air, "fleet_adapter", lambda: None)
        self._publisher = self.place.publisher(topics.FLEET_STATES)
        self._timeline = scene.timeline
        self.place.subscribe(topics.CHARGING_ASSIGNMENTS, self._hear)
        self._tick()

    def wants(self, name: str) -> None:
        """Send the robot to charge, as its RMF task does."""
        robot = self.robots[name]
        robot.begins()
        robot.place = robot.dedicated

    def _hear(self, message: d.ChargingAssignments) -> None:
        for one in self.robots.values():
            one.hear(message)

    def _tick(self) -> None:
        states = (one.state() for one in self.robots.values())
        self._publisher.publish(d.FleetState("fleet", tuple(states)))
        self._timeline.after(1.0, self._tick)


def site(*serves: str) -> tuple[Scene, Fleet]:
    scene = Scene(*serves)
    scene.coordinate("red", "blue")
    fleet = Fleet(scene, "red", "blue")
    scene.run(6.0)
    return scene, fleet


def told(kind: str, name: str, *heard: Heard) -> Explanation:
    devices = HeardDevices()
    for one in heard:
        devices.take(one)
    assert kind in devices.kinds(name)
    return devices.explain(kind, name, None, for_explain())


def wish(charger: str, robot: str) -> d.ChargerRequest:
    return d.ChargerRequest(charger, "fleet", robot, d.Duration(60), "q1")


# ---- the queue


def test_a_robot_waits_for_the_robot_that_has_the_charger_and_for_silent_daemons() -> None:
    scene, fleet = site("bay1")
    fleet.wants("red")
    fleet.wants("blue")
    scene.run(10.0)
    assert told("robot", "fleet/blue", *scene.heard).next == (
        NextStep("a person", "start the daemon of bay2, or end what cuts it off"),
        NextStep("a person", "start the daemon of bay3, or end what cuts it off"),
        NextStep("nobody", "wait until fleet/red leaves bay1"),
    )


def test_a_robot_that_stands_in_the_way_has_to_be_driven_off() -> None:
    scene, fleet = site(*BAYS[:1])
    fleet.robots["red"].place = "bay1"
    scene.press("bay1", "robot", True)
    scene.run(10.0)
    fleet.wants("blue")
    scene.run(30.0)
    drive = NextStep("a person", "drive fleet/red away from bay1")
    assert drive in told("robot", "fleet/blue", *scene.heard).next
    red = told("robot", "fleet/red", *scene.heard)
    assert red.now == ("fleet/red stands at bay1, for which fleet/blue waits.",)
    assert red.next == (drive,)


@pytest.mark.parametrize(
    ("why", "who", "what"),
    [
        ("bay1 takes no request", "a person", "read in the daemon's log why bay1 takes no request"),
        ("bay1 is out of service", "a person", "mend bay1"),
        ("bay1 is not free yet", "nobody", "wait until bay1 is free"),
        ("a/b charges a/c, a is free in 5 s", "nobody", "wait until a/c leaves a/b"),
        (
            "a/c was last seen at bay1 and its fleet says nothing of it (if it is gone, reset)",
            "a person",
            "look whether a/c has left bay1; if so, reset the coordinator",
        ),
        (
            "the charging schedule has no station for this robot",
            "a person",
            "give the robot a station in the schedule",
        ),
        ("for the end of the quiet start", "the coordinator", "finish its quiet start"),
        ("while /desk publishes charging_assignments", "a person", "stop one of the two nodes"),
        ("some other reason", "a person", "look at the coordinator's log"),
    ],
)
def test_the_reason_in_the_queue_names_the_next_step(why: str, who: str, what: str) -> None:
    (step,) = steps(f"by the robot: {why}")
    assert step.who == who
    assert step.what.startswith(what)


def test_a_dead_coordinator_is_named_to_a_robot_that_asks_for_a_charger() -> None:
    scene, _ = site("bay1")
    scene.supervisors["coordinator"].kill()
    scene.run(10.0)
    scene.says(topics.ADAPTER_CHARGER_REQUESTS, wish("", "blue"))
    scene.run(10.0)
    blue = told("robot", "fleet/blue", *scene.heard)
    assert blue.now[0].startswith("A charger was requested for fleet/blue at ")
    assert blue.now[1].startswith("The last report of the charger coordinator came at ")
    assert blue.next[0].what.startswith("look at the coordinator's daemon")
    red = told("robot", "fleet/red", *scene.heard)
    assert red.now[0].startswith("The last report of the charger coordinator came at ")


def test_what_became_of_a_request_is_not_known_without_a_coordinator() -> None:
    request = Heard(1.0, 1.0, "adapter_charger_requests", wish("", "blue"))
    cancel = Heard(2.0, 2.0, "charger_cancels", d.ChargerCancel("", "q1"))
    blue = told("robot", "fleet/blue", request)
    assert "what became of it is not known" in blue.now[1]
    devices = HeardDevices()
    for one in (request, cancel):
        devices.take(one)
    assert devices.kinds("fleet/blue") == []


def test_an_old_request_does_not_hide_the_mission_of_a_robot_of_our_fleet() -> None:
    def report(at: float) -> Heard:
        robot = {"doing": "nothing", "faults": [], "input_age_s": 0.2}
        message = diagnosis("robots", "fleet", {"fleet": "fleet"}, {"blue": robot}, stamp(at))
        return Heard(at, at, "/diagnostics", message)

    request = Heard(1.0, 1.0, "adapter_charger_requests", wish("", "blue"))
    assert "is not known" in told("robot", "fleet/blue", request, report(9.0)).now[1]
    assert "has no mission" in told("robot", "fleet/blue", request, report(99.0)).now[0]


def test_a_request_for_a_charger_that_does_not_exist_was_refused_by_no_charger() -> None:
    scene, _ = site("bay1")
    scene.says(topics.ADAPTER_CHARGER_REQUESTS, wish("bay9", "red"))
    scene.run(10.0)
    bay9 = told("charger", "bay9", *scene.heard)
    assert "a request of fleet/red for bay9 (request q1) was refused: unknown" in bay9.now[1]
    assert [one.text for one in bay9.story][-1].startswith("a request of fleet/red is refused")


# ---- faults


def reported(kind: str, name: str, *faults: tuple[str, str]) -> list[Heard]:
    """Return five reports with these faults (code, detail), and states of an idle charger bay1."""
    found = []
    for at in range(5):
        said = {"bay2": "silent", "faults": [{"code": c, "detail": text} for c, text in faults]}
        message = diagnosis("node", kind, {}, {name: said}, stamp(at))
        found.append(Heard(at, at, "/diagnostics", message))
        found.append(
            Heard(at + 0.1, at + 0.1, "/charger_states", d.ChargerState(d.Time(at), 1, "bay1"))
        )
    return found


@pytest.mark.parametrize("bays", [("bay1", "bay2"), ("bay2", "bay1")])
def test_every_fault_of_one_code_counts(bays: tuple[str, str]) -> None:
    faults = [("STATION_SILENT", f"{bay}: no ChargerState comes") for bay in bays]
    heard = reported("charger_coordinator", "site", *faults)
    bay1 = told("charger", "bay1", *heard)
    assert "The coordinator has the fault STATION_SILENT: bay1: no ChargerState comes." in bay1.now
    assert not any("STATION_SILENT: bay2" in text for text in bay1.now)
    assert [step.who for step in bay1.next] == ["a person"]
    board = Board()
    for one in heard:
        board.take(one)
    shown = {row.faults for row in board.rows(5.0, 5.0) if row.faults}
    assert shown == {"; ".join(f"STATION_SILENT ({bay}: no ChargerState comes)" for bay in bays)}


def test_faults_of_one_code_are_one_fault_with_all_details() -> None:
    faults = [{"code": "A", "detail": text} for text in ("x", "-", "y")]
    (_, status) = diagnosis("n", "charger", {}, {"bay1": {"faults": faults}}, d.Time()).status
    known = Diagnosis("charger", Moment(0.0, 0.0), "n: bay1")
    news = [*known.take(Moment(1.0, 1.0), status)]
    assert [(one.what, one.text) for one in news] == [("fault", "A")]
    assert known.every_fault == (("A", "x"), ("A", ""), ("A", "y"))
    assert known.faults["A"][0] == known.value("A") == "x; y"


@pytest.mark.parametrize(
    ("code", "who"),
    [("CHARGER_NOT_COMMANDED", "a person"), ("PROTECTION", "a person"), ("", "nobody")],
)
def test_an_idle_charger_with_a_fault_needs_the_person_of_the_fault(code: str, who: str) -> None:
    heard = reported("charger", "bay1", *([(code, "detail")] if code else []))
    (step,) = told("charger", "bay1", *heard).next
    assert step == NextStep(who, for_explain()[code][1] if code else "there is nothing to do")  # type: ignore[arg-type]


def test_each_further_fault_of_an_idle_charger_keeps_its_remedy() -> None:
    heard = reported("charger", "bay1", ("CHARGER_NOT_COMMANDED", "x"), ("PROTECTION", "y"))
    found = told("charger", "bay1", *heard)
    assert [step.what for step in found.next] == [for_explain()["CHARGER_NOT_COMMANDED"][1]]
    assert [bool(fault.do) for fault in found.faults] == [False, True]

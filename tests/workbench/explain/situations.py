"""Situations for `explain`. The daemons' real decision code and drivers run with simulated devices, in
virtual time.

Each function returns the messages on the graph, and the device that a person asks about.
"""

from collections.abc import Callable, Mapping
from typing import Final

from msgspec.structs import replace

from bridges.kinds.charger.pad import Misplaced
from bridges.kinds.charger.settings import RobotName
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.messages.words import Kind
from bridges.runtime.diagnostics import diagnosis
from tests.site.network import Place
from tests.site.timeline import EPOCH
from tests.workbench.explain.story import Guest, Scene

Case = tuple[list[Heard], Kind, str]


def held_by_another() -> Case:
    """A robot waits because another robot has the lift."""
    scene, red, blue = _two("Lift1")
    scene.until(red)
    scene.run(8.0)
    assert not blue.robot.done
    return scene.heard, "lift", "Lift1"


def holder_rides() -> Case:
    """A robot waits, because another robot has the lift. The robot with the lift waits for the car to
    arrive."""
    scene, red, _ = _two("Lift1")
    scene.until(red)
    red.asks("Lift1", "L4", inside=True)
    scene.run(3.0)
    return scene.heard, "lift", "Lift1"


def holder_is_dead() -> Case:
    """Two robots want the lift. The first robot has the lift, but its fleet adapter has died without
    END."""
    scene, red, _ = _two("Lift1")
    scene.until(red)
    red.dies()
    scene.run(70.0)
    return scene.heard, "lift", "Lift1"


def holder_alone_is_dead() -> Case:
    """A robot has the lift, and its fleet adapter has died without END. No other robot asks for the
    lift."""
    scene = Scene("Lift1")
    red = scene.robot("fleet/red")
    red.asks("Lift1", "L2")
    scene.until(red)
    red.dies()
    scene.run(20.0)
    return scene.heard, "lift", "Lift1"


def fire() -> Case:
    """The lift goes into fire mode before the robot has boarded."""
    scene, _, _ = _two("Lift1")
    scene.press("Lift1", "fire_alarm", True)
    scene.run(30.0)
    return scene.heard, "lift", "Lift1"


def fire_with_an_open_door_before_the_robot() -> Case:
    """A node of another maker shows OPEN in fire mode at the floor of a robot that is still outside."""
    return _recalled_to_the_robot(d.LiftMode.MODE_FIRE)


def fire_is_over_and_latched() -> Case:
    """The fire is over, and the lift waits for an operator. A robot has the lift, and another waits for
    it."""
    scene, red, _ = _two("Lift2")
    scene.until(red)
    red.asks("Lift2", "L4", inside=True)
    scene.press("Lift2", "fire_alarm", True)
    scene.run(20.0)
    scene.press("Lift2", "fire_alarm", False)
    scene.run(20.0)
    return scene.heard, "lift", "Lift2"


def fire_with_a_robot_inside() -> Case:
    """The lift goes into fire mode when the robot is in the car."""
    scene, red, _ = _two("Lift1")
    scene.until(red)
    red.asks("Lift1", "L4", inside=True)
    scene.run(1.0)
    scene.press("Lift1", "fire_alarm", True)
    scene.run(20.0)
    return scene.heard, "lift", "Lift1"


def open_but_at_no_floor() -> Case:
    """A node reports an open door, but does not know the floor of its car."""
    scene = Scene()
    red = scene.robot("fleet/red")
    node = _Foreign(scene, session_id="fleet/red", current_floor="", door_state=2, motion_state=0)
    scene.run(1.0)
    red.asks("Lift9", "L2")
    scene.run(20.0)
    assert node
    return scene.heard, "lift", "Lift9"


def floor_contact_lost() -> Case:
    """The car stands at a floor, but the floor's contact shows nothing."""
    return _asked_with_a_cut_contact("floor_L3", "L3", for_s=150.0)


def stopped_contact_lost() -> Case:
    """The car stands at its floor, but the contact for that shows nothing."""
    return _asked_with_a_cut_contact("stopped", "L2", for_s=30.0)


def forgotten_by_rmf() -> Case:
    """RMF's supervisor has restarted, and asks for a second robot. The first robot still has the lift,
    but its fleet adapter is dead."""
    scene = Scene("Lift1", rmf=True)
    red, blue = scene.robot("fleet/red"), scene.robot("fleet/blue")
    red.asks("Lift1", "L2")
    scene.until(red)
    supervisor = scene.supervisors["rmf_lift_supervisor"]
    red.dies()
    supervisor.kill()
    blue.asks("Lift1", "L1")
    scene.run(1.0)
    supervisor.start()
    scene.run(20.0)
    return scene.heard, "lift", "Lift1"


def unknown_floor() -> Case:
    """A robot asks for a floor that the lift does not serve."""
    scene = Scene("Lift1")
    scene.robot("fleet/red").asks("Lift1", "B2")
    scene.run(30.0)
    return scene.heard, "lift", "Lift1"


def foreign_node_refuses() -> Case:
    """Another maker's node never grants a session, and gives no reason."""
    scene = Scene(diagnoses=False)
    _Foreign(scene, available_floors=("L1", "L2"))
    scene.robot("fleet/red").asks("Lift9", "L2")
    scene.run(20.0)
    return scene.heard, "lift", "Lift9"


def no_supervisor() -> Case:
    """No supervisor runs, so nobody passes on the requests of the fleet adapters."""
    scene = Scene("Lift1")
    scene.supervisors["lift_supervisor"].kill()
    scene.run(1.0)
    scene.heard.clear()
    scene.robot("fleet/red").asks("Lift1", "L2")
    scene.run(20.0)
    return scene.heard, "lift", "Lift1"


def supervisor_is_passive() -> Case:
    """A foreign node has a publisher on `lift_requests`, but publishes nothing. Because of that
    publisher, our supervisor only listens."""
    scene = Scene("Lift1")
    Place(scene.air, "forgotten_pub", lambda: None).publisher(topics.LIFT_REQUESTS)
    scene.run(5.0)
    scene.heard.clear()
    scene.robot("fleet/red").asks("Lift1", "L2")
    scene.run(20.0)
    return scene.heard, "lift", "Lift1"


def reading_is_old() -> Case:
    """The lift's bus has stopped answering, so the last reading grows old."""
    scene, red, _ = _two("Lift2")
    scene.devices["Lift2"].far.down = "the module does not answer"
    scene.run(30.0)
    assert not red.robot.done
    return scene.heard, "lift", "Lift2"


def nobody_publishes() -> Case:
    """A robot asks for a lift, and no node publishes states of that lift."""
    scene = Scene("Lift2")
    scene.robot("fleet/red").asks("Lift1", "L3")
    scene.run(30.0)
    return scene.heard, "lift", "Lift1"


def daemon_is_gone() -> Case:
    """The lift's daemon has died in the middle of a ride."""
    scene, red, _ = _two("Lift1")
    scene.until(red)
    scene.daemons["Lift1"].kill()
    scene.run(30.0)
    return scene.heard, "lift", "Lift1"


def stamps_of_another_clock() -> Case:
    """The clock of the robots' machine is an hour slow."""
    scene = Scene("Lift1")
    red = scene.robot("fleet/red")
    red.behind_s = 3600.0
    red.asks("Lift1", "L2")
    scene.run(4.0)
    heard = [
        replace(one, message=replace(one.message, lift_time=stamp(one.wall + 600.0)))
        if isinstance(one.message, d.LiftState)
        else one
        for one in scene.heard
    ]
    return heard, "lift", "Lift1"


def two_nodes() -> Case:
    """Two nodes publish states of one lift."""
    scene = Scene(diagnoses=False)
    _Foreign(scene)
    scene.run(0.4)
    _Foreign(scene, stamp_s=-1.0, current_floor="L2")
    scene.robot("fleet/red").asks("Lift9", "L2")
    scene.run(20.0)
    return scene.heard, "lift", "Lift9"


def all_is_well() -> Case:
    """A ride has ended well."""
    scene = Scene("Lift1")
    scene.rides(scene.robot("fleet/red"), "Lift1", "L2", "L3")
    scene.run(10.0)
    return scene.heard, "lift", "Lift1"


def driven_by_hand() -> Case:
    """A technician drives the lift for which a robot waits."""
    scene = Scene("Lift2")
    scene.press("Lift2", "manual_mode", True)
    return _waits_for_lift2(scene)


def earthquake() -> Case:
    """The lift stands after an earthquake, or its contact is wrong."""
    scene = Scene("Lift2")
    scene.press("Lift2", "earthquake", True)
    return _waits_for_lift2(scene)


def earthquake_with_a_robot_inside() -> Case:
    """After an earthquake the car stands at the robot's floor with its door open."""
    scene = Scene("Lift2")
    red = scene.robot("fleet/red")
    red.asks("Lift2", "L2")
    scene.until(red)
    scene.run(4.0)
    red.asks("Lift2", "L3", inside=True)
    scene.run(5.0)
    scene.press("Lift2", "earthquake", True)
    scene.run(30.0)
    return scene.heard, "lift", "Lift2"


def overloaded() -> Case:
    """The car is too heavy, or the contact that says so is wrong."""
    scene = Scene("Lift2")
    scene.fail("Lift2", "overload", "wrong")
    return _waits_for_lift2(scene)


def agv_mode_is_lost() -> Case:
    """The contact that confirms AGV mode fails. The daemon asks for nothing until its next try."""
    scene = Scene("Lift2")
    scene.fail("Lift2", "agv_mode", "wrong")
    return _waits_for_lift2(scene)


def _waits_for_lift2(scene: Scene) -> Case:
    scene.robot("fleet/red").asks("Lift2", "L3")
    scene.run(30.0)
    return scene.heard, "lift", "Lift2"


def door_held_by_a_dead_robot() -> Case:
    """A robot's adapter has died while the robot held the door open."""
    scene = Scene("ward")
    red = scene.robot("fleet/red")
    red.opens("ward")
    scene.until(red)
    red.dies()
    scene.run(400.0)
    return scene.heard, "door", "ward"


def door_supervisor_forgets_a_robot() -> Case:
    """RMF's door supervisor restarts while a robot stands in the doorway, and lets the door close."""
    scene = Scene("ward", rmf=True)
    red = scene.robot("fleet/red")
    red.opens("ward")
    scene.until(red)
    scene.run(2.0)
    scene.supervisors["rmf_door_supervisor"].kill()
    scene.run(1.0)
    scene.supervisors["rmf_door_supervisor"].start()
    scene.run(90.0)
    return scene.heard, "door", "ward"


def door_does_not_open() -> Case:
    """The daemon holds the door open, but the door stays shut."""
    scene = Scene("ward")
    scene.fail("ward", "operator", "stuck")
    return _waits_for_door(scene, "ward")


def door_in_a_fire() -> Case:
    """A robot waits for a fire door, which the daemon releases in a fire."""
    scene = Scene("lab")
    scene.press("lab", "fire", True)
    scene.run(2.0)
    return _waits_for_door(scene, "lab")


def door_held_open_in_a_fire() -> Case:
    """Nobody waits for a door that the daemon holds open in a fire."""
    scene = Scene("ward")
    scene.press("ward", "fire", True)
    scene.run(30.0)
    return scene.heard, "door", "ward"


def door_whose_position_is_unknown() -> Case:
    """A door's controller shows a number that its map does not list, and the door does not open."""
    scene = Scene("icu")
    scene.fail("icu", "closed", "wrong")
    return _waits_for_door(scene, "icu")


def _waits_for_door(scene: Scene, door: str) -> Case:
    scene.robot("fleet/red").opens(door)
    scene.run(30.0)
    return scene.heard, "door", door


def door_without_supervisor() -> Case:
    """No supervisor runs, so nobody takes the requests of the fleet adapters."""
    scene = Scene("ward")
    scene.supervisors["door_supervisor"].kill()
    scene.run(1.0)
    scene.heard.clear()
    scene.robot("fleet/red").opens("ward")
    scene.run(15.0)
    return scene.heard, "door", "ward"


def door_held_open_by_a_person() -> Case:
    """A person keeps the door open."""
    scene = Scene("ward")
    scene.press("ward", "push", True)
    scene.run(12.0)
    return scene.heard, "door", "ward"


def door_asked_once_stays_shut() -> Case:
    """A dashboard has asked the supervisor for the door once, before the listener began. The door stays
    shut."""
    return _asked_before(Scene("ward"), topics.ADAPTER_DOOR_REQUESTS)


def door_told_directly_stays_shut() -> Case:
    """No supervisor runs. A person has sent OPEN to the door's daemon before the listener began. The
    door stays shut."""
    scene = Scene("ward")
    scene.supervisors["door_supervisor"].kill()
    return _asked_before(scene, topics.DOOR_REQUESTS)


def door_let_go_is_kept_open() -> Case:
    """No supervisor runs. A person has sent OPEN and then CLOSE, and a push button keeps the door
    open."""
    scene = Scene("ward")
    scene.supervisors["door_supervisor"].kill()
    scene.says(topics.DOOR_REQUESTS, _door("ward", d.DoorModeValue.MODE_OPEN))
    scene.run(6.0)
    scene.press("ward", "push", True)
    scene.says(topics.DOOR_REQUESTS, _door("ward", d.DoorModeValue.MODE_CLOSED))
    scene.run(30.0)
    return scene.heard, "door", "ward"


def coordinator_gave_up_on_a_robot() -> Case:
    """Nobody requests the charger, because the coordinator tries its robot no more."""
    scene = Scene("bay1")
    detail = "fleet/red failed at bay1 and bay2: not tried again"
    site = {"bay1": "IDLE", "faults": [{"code": "ROBOT_FAULTY", "detail": detail}]}
    told = diagnosis("coordinator", "charger_coordinator", {}, {"": site}, d.Time())
    for _ in range(8):
        scene.says(topics.DIAGNOSTICS, told)
        scene.run(1.0)
    return scene.heard, "charger", "bay1"


def charger_refuses() -> Case:
    """A second robot asks for a charger that is promised to another robot."""
    scene = Scene("bay1")
    scene.says(topics.CHARGER_REQUESTS, _charge("bay1", "red", "r1"))
    scene.run(3.0)
    scene.says(topics.CHARGER_REQUESTS, _charge("bay1", "blue", "r2"))
    scene.run(4.0)
    return scene.heard, "charger", "bay1"


def charger_shows_an_unknown_number() -> Case:
    """A station shows a number that the file does not list."""
    scene = Scene("bay1")
    scene.fail("bay1", "body", "wrong")
    scene.run(10.0)
    return scene.heard, "charger", "bay1"


def charger_answers_badly() -> Case:
    """A station answers, but with a text in place of a number."""
    scene = Scene("bay1")
    scene.fail("bay1", "server", "wrong")
    scene.run(10.0)
    return scene.heard, "charger", "bay1"


def wrong_station() -> Case:
    """A robot stands at a charger that is promised to another robot."""
    scene = Scene(diagnoses=False)
    who, whose = RobotName("fleet", "red"), RobotName("fleet", "blue")
    text = Misplaced(who, "7", whose).text
    state = d.ChargerState(stamp(EPOCH), 200, "bay1", text, "r2", "fleet", "blue", d.Duration())
    for _ in range(10):
        wall = EPOCH + scene.timeline.now
        scene.says(topics.CHARGER_STATES, replace(state, charger_time=stamp(wall)))
        scene.run(1.0)
    return scene.heard, "charger", "bay1"


def coordinator_queues() -> Case:
    """There are more robots than chargers. The coordinator keeps a queue, and gives reasons."""
    scene = Scene("bay1")
    scene.coordinate("red", "blue")
    scene.run(6.0)
    for robot, request in (("red", "r1"), ("blue", "r2")):
        scene.says(topics.ADAPTER_CHARGER_REQUESTS, _charge("", robot, request))
    scene.run(10.0)
    return scene.heard, "charger", "bay1"


def charger_is_listed_but_silent() -> Case:
    """No daemon serves a charger, but the coordinator lists it. Its name is like another's."""
    heard, kind, _ = coordinator_queues()
    return heard, kind, "bay2"


SCENES: Final[Mapping[str, Callable[[], Case]]] = {
    made.__name__: made
    for made in (
        held_by_another,
        holder_rides,
        holder_is_dead,
        holder_alone_is_dead,
        fire,
        fire_with_an_open_door_before_the_robot,
        fire_is_over_and_latched,
        fire_with_a_robot_inside,
        open_but_at_no_floor,
        floor_contact_lost,
        stopped_contact_lost,
        forgotten_by_rmf,
        unknown_floor,
        foreign_node_refuses,
        no_supervisor,
        supervisor_is_passive,
        reading_is_old,
        nobody_publishes,
        daemon_is_gone,
        stamps_of_another_clock,
        two_nodes,
        all_is_well,
        driven_by_hand,
        earthquake,
        earthquake_with_a_robot_inside,
        overloaded,
        agv_mode_is_lost,
        door_held_by_a_dead_robot,
        door_supervisor_forgets_a_robot,
        door_does_not_open,
        door_in_a_fire,
        door_whose_position_is_unknown,
        door_held_open_in_a_fire,
        door_without_supervisor,
        door_held_open_by_a_person,
        door_asked_once_stays_shut,
        door_told_directly_stays_shut,
        door_let_go_is_kept_open,
        coordinator_gave_up_on_a_robot,
        charger_refuses,
        charger_shows_an_unknown_number,
        charger_answers_badly,
        wrong_station,
        coordinator_queues,
        charger_is_listed_but_silent,
    )
}


def _recalled_to_the_robot(mode: int) -> Case:
    scene = Scene()
    node = _Foreign(scene, current_floor="L3")
    scene.run(3.0)
    scene.robot("fleet/red").asks("Lift9", "L1")
    scene.run(1.0)
    node.shows(session_id="fleet/red", destination_floor="L1")
    scene.run(10.0)
    node.shows(current_mode=mode)
    scene.run(5.0)
    node.shows(current_floor="L1", door_state=2)
    scene.run(10.0)
    return scene.heard, "lift", "Lift9"


def _asked_with_a_cut_contact(contact: str, floor: str, for_s: float) -> Case:
    scene = Scene("Lift2")
    red = scene.robot("fleet/red")
    scene.fail("Lift2", contact, "off")
    red.asks("Lift2", floor)
    scene.run(for_s)
    return scene.heard, "lift", "Lift2"


def _two(lift: str) -> tuple[Scene, Guest, Guest]:
    """Let red ask for L2, and let blue ask for L1 2 s later."""
    scene = Scene(lift)
    red, blue = scene.robot("fleet/red"), scene.robot("fleet/blue")
    red.asks(lift, "L2")
    scene.run(2.0)
    blue.asks(lift, "L1")
    return scene, red, blue


def _asked_before(scene: Scene, topic: topics.Topic[d.DoorRequest]) -> Case:
    """Let the door stay shut after one OPEN on this topic, which came before the listener began."""
    scene.fail("ward", "operator", "stuck")
    scene.says(topic, _door("ward", d.DoorModeValue.MODE_OPEN))
    scene.run(4.0)
    scene.heard.clear()
    scene.run(4.0)
    return scene.heard, "door", "ward"


def _door(door: str, mode: int) -> d.DoorRequest:
    return d.DoorRequest(d.Time(), "dashboard", door, d.DoorMode(mode))


def _charge(charger: str, robot: str, request: str) -> d.ChargerRequest:
    return d.ChargerRequest(charger, "fleet", robot, d.Duration(), request)


class _Foreign:
    """A lift node of another maker. The node publishes its state each second, whatever robots ask."""

    def __init__(self, scene: Scene, stamp_s: float = 0.0, **fields: object) -> None:
        self._scene = scene
        self._stamp_s = stamp_s
        known = d.LiftState(
            lift_name="Lift9",
            available_floors=("L1", "L2", "L3"),
            current_floor="L1",
            current_mode=d.LiftMode.MODE_AGV,
        )
        self._state = replace(known, **fields)
        self._say()

    def shows(self, **fields: object) -> None:
        """Change the state."""
        self._state = replace(self._state, **fields)

    def _say(self) -> None:
        at = stamp(EPOCH + self._scene.timeline.now + self._stamp_s)
        self._scene.says(topics.LIFT_STATES, replace(self._state, lift_time=at))
        self._scene.timeline.after(1.0, self._say)

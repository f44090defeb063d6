"""Stories of a door with its driver, its simulated door operator, and RMF's door supervisor, in virtual
time."""

from typing import Any

from bridges.kinds.door import messages
from bridges.messages import topics
from bridges.messages.definitions import DoorModeValue, DoorRequest
from bridges.messages.stamps import stamp
from tests.kinds.door.virtual import FIRE, OBSTRUCTION, SCAN_S, Door
from workbench.rmf_model import door_request
from workbench.rmf_model.supervisors import DoorSupervisor


class Corridor:
    """A door, RMF's door supervisor, and robots. The door publishes its state each second and at each
    change."""

    def __init__(self, **changes: Any) -> None:
        self.door = Door(**changes)
        self.supervisor = DoorSupervisor()
        self._told: tuple[int, int] | None = None

    def robot(self, name: str, mode: DoorModeValue) -> None:
        """Let this robot's fleet adapter send a request to the supervisor. The supervisor may then send
        a request to the door."""
        self._deliver(door_request("door", name, mode, self.door.now))

    def run(self, until: float) -> None:
        """Let time pass until the time `until`."""
        while self.door.now < until:
            self.door.run(min(until, self.door.now + SCAN_S))
            report = self.door.report
            told = (int(report.mode), int(self.door.now + 1e-6))
            if told != self._told:
                self._told = told
                state = messages.state_message("door", None, report, stamp(self.door.now))
                self._deliver(state)

    def _deliver(self, message: Any) -> None:
        for topic, said in self.supervisor.hear(message, self.door.now):
            if topic == topics.DOOR_REQUESTS and isinstance(said, DoorRequest):
                self.door.scan(messages.accept(said, self.door.settings))


OPEN, CLOSED = DoorModeValue.MODE_OPEN, DoorModeValue.MODE_CLOSED


# ---- DOOR-1, DOOR-2: robots that pass the door


def test_a_robot_passes_a_door() -> None:
    corridor = Corridor()
    corridor.run(1.0)
    corridor.robot("fleet/a", OPEN)
    corridor.run(20.0)
    corridor.robot("fleet/a", CLOSED)
    corridor.run(40.0)
    assert corridor.door.told == [
        (0.0, "UNKNOWN"),
        (0.0625, "CLOSED"),
        (1.1875, "MOVING"),
        (3.0625, "OPEN"),
        (24.0625, "MOVING"),
        (27.0625, "CLOSED"),
    ]
    assert corridor.door.relay == [(1.0, True), (23.0, False)]


def test_an_open_door_stays_open_through_ten_minutes_of_silence() -> None:
    door = Door()
    door.run(1.0)
    door.opens()
    door.run(601.0)
    assert door.relay == [(1.0, True)]
    assert door.told[-1] == (3.125, "OPEN")


def test_a_person_at_an_idle_door_and_reminders_of_the_supervisor_move_no_relay() -> None:
    corridor = Corridor()
    corridor.run(1.0)
    corridor.door.plant.press("push", True, 1.0)
    corridor.run(60.0)
    corridor.door.plant.press("push", False, 60.0)
    corridor.run(80.0)
    assert corridor.door.relay == []
    assert [mode for _, mode in corridor.door.told] == [
        "UNKNOWN",
        "CLOSED",
        "MOVING",
        "OPEN",
        "MOVING",
        "CLOSED",
    ]


def test_the_first_of_two_robots_to_leave_does_not_close_the_door_on_the_other() -> None:
    corridor = Corridor()
    corridor.run(1.0)
    corridor.robot("fleet/a", OPEN)
    corridor.run(5.0)
    corridor.robot("fleet/b", OPEN)
    corridor.robot("fleet/a", CLOSED)
    corridor.run(60.0)
    corridor.robot("fleet/b", CLOSED)
    corridor.run(80.0)
    assert corridor.door.relay == [(1.0, True), (63.0, False)]


def test_a_supervisor_restarted_with_a_robot_in_the_doorway_does_not_drop_the_hold() -> None:
    corridor = Corridor()
    corridor.run(1.0)
    corridor.robot("fleet/a", OPEN)
    corridor.run(10.0)
    corridor.supervisor = DoorSupervisor()
    corridor.run(12.0)
    assert corridor.door.memory.close_at is not None
    corridor.robot("fleet/a", OPEN)
    corridor.run(60.0)
    assert corridor.door.relay == [(1.0, True)]


def test_a_robot_that_stays_in_the_doorway_is_seen_by_the_light_curtain() -> None:
    corridor = Corridor(inputs={"obstruction": OBSTRUCTION})
    corridor.run(1.0)
    corridor.robot("fleet/a", OPEN)
    corridor.run(10.0)
    corridor.door.plant.press("obstruction", True, 10.0)
    corridor.supervisor = DoorSupervisor()
    corridor.run(30.0)
    corridor.door.plant.press("obstruction", False, 30.0)
    corridor.run(60.0)
    assert corridor.door.told[3:] == [(3.0625, "OPEN"), (32.1875, "MOVING"), (35.1875, "CLOSED")]
    assert corridor.door.relay == [(1.0, True), (31.125, False)]


def test_an_operator_that_closes_by_itself_is_kept_open_by_pulses() -> None:
    door = Door(pulse={"on_s": 0.5, "every_s": 3.0})
    door.run(1.0)
    for second in range(20):
        door.opens()
        door.run(second + 2.0)
    door.closes()
    door.run(40.0)
    assert [at for at, on in door.relay if on] == [1.0, 4.0, 7.0, 10.0, 13.0, 16.0, 19.0, 22.0]
    assert [mode for at, mode in door.told if at > 3.1] == ["MOVING", "CLOSED"]


def test_a_thousand_opens_switch_the_relay_once_through_driver_and_plant() -> None:
    door = Door()
    door.run(1.0)
    for _ in range(1000):
        door.opens()
    door.run(10.0)
    assert door.relay == [(1.0, True)]


# ---- DOOR-6: parts that break


def test_a_broken_operator_is_a_door_that_does_not_open() -> None:
    door = Door()
    door.plant.fail("operator", "off")
    door.run(1.0)
    door.opens()
    door.run(30.0)
    assert door.told[-1] == (0.0625, "CLOSED")
    assert door.faults[-1] == (16.0, ("DOOR_OPENING_FAULT",))


def test_a_door_that_stops_half_way_is_unknown_after_its_travel() -> None:
    door = Door()
    door.plant.fail("operator", "garbage")
    door.run(1.0)
    door.opens()
    door.run(30.0)
    assert door.told[2:] == [(1.1875, "MOVING"), (11.1875, "UNKNOWN")]
    assert door.faults[1:] == [
        (11.1875, ("DOOR_TRAVEL_TIMEOUT",)),
        (16.0, ("DOOR_TRAVEL_TIMEOUT", "DOOR_OPENING_FAULT")),
    ]


def test_a_welded_limit_contact_makes_the_door_unknown() -> None:
    door = Door()
    door.run(1.0)
    door.plant.fail("closed", "stuck")
    door.opens()
    door.run(5.0)
    assert door.told[1:] == [(0.0625, "CLOSED"), (3.0625, "UNKNOWN")]
    assert door.faults[-1] == (3.0625, ("DOOR_CONTACTS_CONTRADICT",))


def test_a_cut_wire_of_each_contact_never_reads_as_open() -> None:
    for signal in ("opened", "closed", "obstruction", "fire"):
        inputs = {"obstruction": OBSTRUCTION, "fire": FIRE}
        door = Door(inputs=inputs, on_fire="release")
        door.plant.fail(signal, "off")
        door.run(10.0)
        assert "OPEN" not in [mode for _, mode in door.told], signal


# ---- DOOR-5: lost and restored connections


def test_a_door_whose_module_is_lost_is_offline_and_is_held_again_when_it_is_back() -> None:
    door = Door()
    door.run(1.0)
    door.opens()
    door.run(10.0)
    door.bus.down = "no reply"
    door.run(20.0)
    assert door.report.read_at == 10.0
    door.bus.down = ""
    door.run(30.0)
    assert door.told[3:] == [
        (3.125, "OPEN"),
        (11.0, "OFFLINE"),
        (20.125, "UNKNOWN"),
        (20.1875, "OPEN"),
    ]
    assert door.faults[1:] == [(11.0, ("COMMUNICATION_LOST",)), (20.125, ())]
    assert door.relay == [(1.0, True)]


def test_a_module_that_lost_its_power_gets_its_hold_back() -> None:
    door = Door()
    door.run(1.0)
    door.opens()
    door.run(10.0)
    door.bus.down = "no reply"
    door.run(15.0)
    door.plant.drive("hold_open", False, 15.0)
    door.run(20.0)
    door.bus.down = ""
    door.run(30.0)
    assert door.relay == [(1.0, True), (15.0, False), (20.125, True)]
    assert door.told[-1][1] == "OPEN"


def test_a_door_that_was_offline_is_opened_again_for_its_session() -> None:
    corridor = Corridor()
    corridor.door.bus.down = "no reply"
    corridor.run(1.0)
    corridor.robot("fleet/a", OPEN)
    corridor.run(10.0)
    corridor.door.bus.down = ""
    corridor.run(20.0)
    assert corridor.door.told == [
        (0.0, "UNKNOWN"),
        (1.0, "OFFLINE"),
        (10.125, "UNKNOWN"),
        (10.25, "MOVING"),
        (12.1875, "OPEN"),
    ]


def test_the_supervisor_repeats_open_to_a_daemon_that_restarted_under_a_robot() -> None:
    corridor = Corridor()
    corridor.run(1.0)
    corridor.robot("fleet/a", OPEN)
    corridor.run(10.0)
    corridor.door.restart()
    corridor.run(30.0)
    assert corridor.door.relay[0] == (1.0, True)
    assert corridor.door.relay[1] == (10.0, False)
    assert corridor.door.relay[2][1] is True
    assert corridor.door.told[-1][1] == "OPEN"


# ---- DOOR-4: fire


def test_a_fire_releases_a_door_and_leaves_no_latch() -> None:
    door = Door(inputs={"fire": FIRE}, on_fire="release")
    door.run(1.0)
    door.opens()
    door.run(10.0)
    door.plant.press("fire", True, 10.0)
    door.run(15.0)
    door.opens()
    door.run(20.0)
    door.plant.press("fire", False, 20.0)
    door.run(40.0)
    assert door.relay == [(1.0, True), (10.1875, False)]
    assert door.told[3:] == [(3.125, "OPEN"), (10.1875, "UNKNOWN"), (21.125, "CLOSED")]


def test_a_fire_opens_a_door_where_it_is_an_escape_route() -> None:
    door = Door(inputs={"fire": FIRE}, on_fire="open")
    door.run(1.0)
    door.plant.press("fire", True, 1.0)
    door.run(20.0)
    door.closes()
    door.run(30.0)
    door.plant.press("fire", False, 30.0)
    door.run(50.0)
    assert door.relay == [(1.1875, True), (31.125, False)]
    assert [mode for _, mode in door.told[1:]] == ["CLOSED", "MOVING", "OPEN", "MOVING", "CLOSED"]

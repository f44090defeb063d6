"""Robots that speak VDA 5050, behind a real broker: orders, cancelling, charging, floors, silence."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import msgspec
import pytest

from bridges.kinds.fleet.signals import Goal, Pose, RobotCommand, RobotOutputs, RobotSample
from drivers import DriverError
from drivers.fleet.vda5050 import VdaActionSettings, VdaRobot, VdaRobotSettings
from drivers.hal.mqtt import MqttBus, MqttSettings
from hal_fakes.plants import robot as robot_plant
from hal_fakes.plants.robot import RobotPlant
from hal_fakes.realtime import RealTime
from hal_fakes.vda5050 import FakeVdaRobot
from hal_fakes.vda_site import VdaSite
from tests.drivers.hal.modbus.module import Time
from tests.drivers.hal.mqtt.broker import FarDevice
from tests.waiting import wait_until

START = Pose("L1", 1.0, 2.0, 0.5)
CHARGER = Pose("L1", 4.0, 2.0)


@dataclass
class Bench:
    """One robot on one broker, and its driver."""

    plant: RobotPlant
    driver: VdaRobot
    site: VdaSite

    def read(self) -> RobotSample | str:
        """Read the robot. If that fails, return the text of the error."""
        try:
            return self.driver.read()
        except DriverError as error:
            return str(error)

    def until(self, **wanted: Any) -> RobotSample:
        """Read until the sample has these values."""
        found: list[RobotSample] = []

        def seen() -> bool:
            sample = self.read()
            if isinstance(sample, str):
                return False
            found.append(sample)
            return all(getattr(sample, key) == value for key, value in wanted.items())

        wait_until(seen, str(wanted))
        return found[-1]

    def send(self, command: RobotCommand, **until: Any) -> RobotSample:
        """Write this command in each scan, until the sample has these values."""

        def seen() -> bool:
            self.driver.write(RobotOutputs(command))
            sample = self.read()
            return not isinstance(sample, str) and all(
                getattr(sample, key) == value for key, value in until.items()
            )

        wait_until(seen, str(until))
        return self.until(**until)

    def until_error(self, words: str) -> None:
        """Read until an error contains these words."""
        wait_until(lambda: words in str(self.read()), words)


@contextmanager
def robot(**settings: Any) -> Iterator[Bench]:
    made = VdaRobotSettings(manufacturer="acme", known_as="0001", **settings)
    plant = RobotPlant("AMR01", START, chargers=(CHARGER,), parts=("unit", "server"))
    world = RealTime({"AMR01": plant})
    site = VdaSite(MqttSettings(host="x"), [FakeVdaRobot("AMR01", world.plants["AMR01"], made)])
    found = msgspec.structs.replace(MqttSettings(host="x"), **site.replace)
    bus = MqttBus(found)
    try:
        yield Bench(plant, VdaRobot("AMR01", made, bus), site)
    finally:
        bus.close()
        site.close()
        world.close()


@pytest.fixture(params=["2.1", "3.0"])
def bench(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setattr(robot_plant, "SPEED", 20.0)
    monkeypatch.setattr(robot_plant, "TURNS", 50.0)
    actions = {"clean": VdaActionSettings(type="startCleaning")}
    with robot(version=request.param, actions=actions) as standing:
        yield standing


def to(x: float, number: int = 12, **more: Any) -> RobotCommand:
    return RobotCommand(number, "navigate", goal=Goal(Pose("L1", x, 2.0, 0.25), "pantry"), **more)


def test_a_robot_drives_to_its_goal_and_reports_the_order_done(bench: Bench) -> None:
    sample = bench.until(moving=False)
    assert (sample.at, sample.completed, sample.battery) == (START, "", 0.8)
    sample = bench.send(to(8.0), completed="12", moving=False)
    assert sample.at == Pose("L1", 8.0, 2.0, 0.25)
    sample = bench.send(to(3.0, 13), completed="13", moving=False)
    assert sample.at == Pose("L1", 3.0, 2.0, 0.25)


def test_a_replaced_order_is_cancelled_first(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot_plant, "SPEED", 0.5)
    bench.until(moving=False)
    bench.send(to(400.0), moving=True)
    monkeypatch.setattr(robot_plant, "SPEED", 20.0)
    sample = bench.send(to(3.0, 13), completed="13", moving=False)
    assert sample.at == Pose("L1", 3.0, 2.0, 0.25)
    relays = [edge.signal for edge in bench.plant.edges if edge.what == "relay"]
    assert relays == ["go", "stop", "go"]


def test_a_stop_cancels_the_order_and_the_robot_stands(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robot_plant, "SPEED", 0.5)
    bench.until(moving=False)
    bench.send(to(400.0), moving=True)
    bench.send(RobotCommand(13, "stop", of=12), moving=False)
    assert bench.plant.reading().at.x < 400.0


def test_a_later_attempt_of_a_cancelled_order_has_an_id_of_its_own(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robot_plant, "SPEED", 0.5)
    bench.until(moving=False)
    bench.send(to(400.0), moving=True)
    bench.send(RobotCommand(13, "stop", of=12), moving=False)
    monkeypatch.setattr(robot_plant, "SPEED", 500.0)
    sample = bench.send(to(400.0, attempt=2), moving=False, completed="12", at=to(400.0).goal.at)  # type: ignore[union-attr]
    assert sample.at.x == 400.0


def test_a_robot_docks_charges_and_leaves(bench: Bench) -> None:
    bench.until(moving=False)
    dock = RobotCommand(12, "dock", goal=Goal(CHARGER, "charger_a", dock="dock_a"))
    assert bench.send(dock, completed="12").charging
    assert not bench.send(to(8.0, 13), completed="13", moving=False).charging


def test_a_dock_that_is_no_charger_may_have_another_action_or_none() -> None:
    with robot(dock_actions={"shelf": None, "rack": "pick"}) as bench:
        bench.until(moving=False)
        sent: list[object] = []
        bench.driver._publish = lambda topic, message, safe=False: sent.append(message)  # type: ignore[method-assign]
        for number, dock in enumerate(("shelf", "rack", "dock_a"), 12):
            goal = Goal(CHARGER, "place", dock=dock)
            bench.driver._order(RobotCommand(number, "dock", goal=goal))
        found = [message["nodes"][-1]["actions"] for message in sent]  # type: ignore[index]
        kinds = [[action["actionType"] for action in actions] for actions in found]
        assert kinds == [[], ["pick"], ["startCharging"]]


def test_an_action_is_done_when_the_robot_has_finished_it(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robot_plant, "ACTS_S", 0.1)
    bench.until(moving=False)
    act = RobotCommand(12, "act", activity="clean", description='{"zone": "lounge"}')
    bench.driver.write(RobotOutputs(act))
    wait_until(lambda: bench.plant.edges, "the action has begun")
    bench.until(completed="12")


def test_an_action_that_the_yaml_lacks_is_an_error(bench: Bench) -> None:
    bench.until(moving=False)
    with pytest.raises(DriverError, match="no action 'dance'"):
        bench.driver.write(RobotOutputs(RobotCommand(12, "act", activity="dance")))


def test_a_robot_is_localized_on_the_new_floor(bench: Bench) -> None:
    bench.until(moving=False)
    goal = Goal(Pose("L2", 1.0, 2.0, 0.5), "lift1_L2")
    bench.send(RobotCommand(12, "localize", goal=goal), at=Pose("L2", 1.0, 2.0, 0.5))


def test_a_map_of_another_name_is_its_level() -> None:
    with robot(maps={"L1": "7f3c", "L2": "91aa"}) as bench:
        assert bench.until(moving=False).at == START
        assert bench.driver._at == msgspec.structs.replace(START, map="7f3c")
        bench.send(to(1.5), completed="12", moving=False)
        goal = Goal(Pose("L2", 1.0, 2.0, 0.5), "lift1_L2")
        bench.send(
            RobotCommand(13, "localize", goal=goal), at=msgspec.structs.replace(goal.at, yaw=0.25)
        )


def test_a_robot_in_manual_mode_is_taken_out_and_refuses(bench: Bench) -> None:
    bench.until(moving=False)
    bench.plant.press("manual", True, bench.plant.now)
    assert bench.until(taken_out="operating mode MANUAL")
    bench.send(to(8.0), refused="orderError: the robot is in manual mode")


def test_a_fatal_error_is_a_fault(bench: Bench) -> None:
    bench.until(moving=False)
    bench.plant.press("fault", True, bench.plant.now)
    bench.until(fault="driveError: wheel motor too hot")


def test_a_robot_that_drops_off_the_net_has_no_place(bench: Bench) -> None:
    bench.until(moving=False)
    bench.plant.fail("unit", "off")
    bench.until_error("the robot is not connected to the broker: CONNECTION")
    bench.plant.fail("unit", None)
    bench.until(at=START)


def test_noise_and_another_robots_state_are_no_place(bench: Bench) -> None:
    bench.until(moving=False)
    bench.plant.fail("unit", "garbage")
    bench.plant.press("manual", True, bench.plant.now)  # this event makes the robot publish a state
    bench.until_error("is no JSON")
    bench.plant.fail("unit", "wrong")
    bench.plant.press("manual", False, bench.plant.now)
    bench.until_error("is from robot another, not 0001")


def test_a_killed_broker_is_an_error_and_its_return_mends_it(bench: Bench) -> None:
    bench.until(moving=False)
    bench.plant.fail("server", "off")
    wait_until(lambda: isinstance(bench.read(), str), "the broker is gone")
    bench.plant.fail("server", None)
    bench.until(at=START)


class Scripted:
    """A bus whose messages and time are set by the test."""

    def __init__(self) -> None:
        self.clock = Time()
        self.said: dict[str, Any] = {}
        self.sent: list[dict[str, Any]] = []

    def listen(self, topic: str) -> None:
        pass

    def now(self) -> float:
        return self.clock.now

    def heard(self, topic: str) -> Any:
        return self.said.get(topic.rpartition("/")[2])

    def fresh(self, topic: str, stale_after_s: float) -> Any:
        return self.heard(topic)

    def publish(self, topic: str, payload: bytes, qos: int, safe: bool) -> None:
        self.sent.append(json.loads(payload))

    @property
    def ids(self) -> list[str]:
        """Return the ids of all orders and the types of all instant actions that were sent."""
        return [one.get("orderId") or one["actions"][0]["actionType"] for one in self.sent]

    def acts(self, status: str, **changes: Any) -> None:
        """Let the robot report the last instant action with this status."""
        last = self.sent[-1]["actions"][0]
        state = {**last, "actionStatus": status}
        self.says("state", {**STATE, **changes, "actionStates": [state]})

    def says(self, what: str, message: dict[str, Any]) -> None:
        from drivers.hal.mqtt import Heard

        payload = json.dumps(message).encode()
        self.said[what] = Heard(payload, self.clock.now, len(payload))


STATE: dict[str, Any] = {
    "orderId": "",
    "lastNodeId": "",
    "nodeStates": [],
    "edgeStates": [],
    "actionStates": [],
    "errors": [],
    "driving": True,
    "operatingMode": "AUTOMATIC",
    "agvPosition": {"x": 1, "y": 2, "theta": 0, "mapId": "L1", "positionInitialized": True},
    "batteryState": {"batteryCharge": 50, "charging": False},
    "safetyState": {"eStop": "NONE", "fieldViolation": False},
}


def scripted(actions: Any = None, **changes: Any) -> tuple[Scripted, VdaRobot]:
    bus = Scripted()
    settings = VdaRobotSettings(manufacturer="acme", actions=actions or {})
    driver = VdaRobot("AMR01", settings, bus)  # type: ignore[arg-type]
    bus.says("state", {**STATE, **changes})
    return bus, driver


def test_a_driving_robots_place_is_the_newest_of_state_and_visualization() -> None:
    bus, driver = scripted()
    bus.clock.now += 2.0
    bus.says("visualization", {"agvPosition": {"x": 3, "y": 2, "theta": 0, "mapId": "L1"}})
    assert driver.read().at == Pose("L1", 3.0, 2.0, 0.0)


def test_an_old_place_of_a_driving_robot_is_no_place_and_of_a_standing_one_it_is() -> None:
    bus, driver = scripted()
    bus.clock.now += 4.0
    with pytest.raises(DriverError, match="the robot drives, but its reported position is 4 s old"):
        driver.read()
    bus.clock.now -= 4.0
    bus.says("state", {**STATE, "driving": False})
    bus.clock.now += 30.0
    assert driver.read().at == Pose("L1", 1.0, 2.0, 0.0)


def test_a_robot_that_is_not_localized_has_no_place() -> None:
    _, driver = scripted(agvPosition={**STATE["agvPosition"], "positionInitialized": False})
    with pytest.raises(DriverError, match="does not know its position"):
        driver.read()


def test_an_emergency_stop_is_a_fault() -> None:
    _, driver = scripted(safetyState={"eStop": "MANUAL", "fieldViolation": False})
    assert driver.read().fault == "emergency stop: MANUAL"


@pytest.mark.parametrize("field", ["driving", "batteryState", "operatingMode", "orderId"])
def test_a_state_without_a_needed_field_names_it(field: str) -> None:
    _, driver = scripted(**{field: None})
    with pytest.raises(DriverError, match=field):
        driver.read()


def sent_to_clean() -> tuple[Scripted, VdaRobot]:
    """Return a robot that was sent the action `clean`."""
    actions = {"clean": VdaActionSettings(type="startCleaning")}
    bus, driver = scripted(driving=False, actions=actions)
    driver.read()
    driver.write(RobotOutputs(RobotCommand(12, "act", activity="clean")))
    return bus, driver


def clean(status: str, attempt: str = "", **changes: Any) -> dict[str, Any]:
    """Return a state with the action of this attempt."""
    one = {"actionId": f"act-12{attempt}", "actionType": "startCleaning", "actionStatus": status}
    order = f"12{attempt}"
    return {**STATE, "driving": False, "orderId": order, "actionStates": [one], **changes}


def in_vain(driver: VdaRobot) -> tuple[str, str, str | None]:
    sample = driver.read()
    return sample.refused, sample.failed, sample.completed


def test_an_action_that_the_robot_took_fails_and_is_not_refused() -> None:
    bus, driver = sent_to_clean()
    error = {"errorType": "brush", "errorLevel": "WARNING"}
    error["errorReferences"] = [{"referenceKey": "orderId", "referenceValue": "12"}]  # type: ignore[assignment]
    bus.says("state", clean("RUNNING", errors=[error]))
    assert in_vain(driver) == ("", "", "")
    bus.says("state", clean("FAILED", errors=[error]))
    assert in_vain(driver) == ("", "brush; the action startCleaning has failed", "")
    driver.write(RobotOutputs(RobotCommand(12, "act", 2, activity="clean")))
    assert in_vain(driver) == ("", "", ""), "the failure was that of the first attempt"
    ids = [one["nodes"][0]["actions"][0]["actionId"] for one in bus.sent]
    assert ids == ["act-12", "act-12-2"]
    bus.says("state", clean("FINISHED", "-2"))
    assert in_vain(driver) == ("", "", "12")


@pytest.mark.parametrize("about", ["12", "act-12"])
def test_an_error_about_an_order_that_the_robot_has_not_taken_is_a_refusal(about: str) -> None:
    bus, driver = sent_to_clean()
    reference = {"referenceKey": "id", "referenceValue": about}
    error = {"errorType": "orderError", "errorLevel": "WARNING", "errorReferences": [reference]}
    bus.says("state", {**STATE, "driving": False, "errors": [error]})
    assert in_vain(driver) == ("orderError", "", "")
    driver.write(RobotOutputs(RobotCommand(12, "act", 2, activity="clean")))
    assert in_vain(driver) == ("", "", ""), "the error is about the first attempt"


def test_an_action_whose_order_no_later_state_shows_is_unanswered() -> None:
    bus, driver = sent_to_clean()
    told = []
    for after_s, said in (
        (4.9, STATE),  # a state of that time may have been on its way
        (5.0, STATE),
        (5.1, clean("RUNNING")),  # the order came late
        (9.0, clean("RUNNING")),
        (9.1, {**STATE, "driving": False}),  # the robot has forgotten the order
    ):
        bus.clock.now = after_s
        bus.says("state", said)
        told.append(driver.read().unanswered)
    assert told == [False, True, False, False, True]
    driver.write(RobotOutputs(RobotCommand(12, "act", 2, activity="clean")))
    assert not driver.read().unanswered, "the second attempt has just been sent"


def test_an_action_that_a_stop_has_ended_is_neither_refused_nor_failed() -> None:
    bus, driver = sent_to_clean()
    bus.says("state", clean("RUNNING"))
    driver.read()
    driver.write(RobotOutputs(STOP))
    bus.says("state", clean("FAILED"))
    assert in_vain(driver) == ("", "", "")


STOP = RobotCommand(13, "stop", of=12)
UNDER_WAY = {"orderId": "12", "nodeStates": [{"nodeId": "pantry", "sequenceId": 2}]}


def told_to_stop() -> tuple[Scripted, VdaRobot]:
    """Return a robot that was sent to a goal, and told to stop before it has taken the goal's order."""
    bus, driver = scripted(driving=False)
    driver.read()
    driver.write(RobotOutputs(to(8.0)))
    driver.read()
    driver.write(RobotOutputs(STOP))
    return bus, driver


def test_a_stop_goes_out_before_a_state_shows_the_order_and_counts_when_the_robot_has_obeyed() -> (
    None
):
    bus, driver = told_to_stop()
    assert bus.ids == ["12", "cancelOrder"]
    assert driver.read().taken == (0, 0), "the old state, read again"
    bus.says("state", {**STATE, **UNDER_WAY})
    assert driver.read().taken == (0, 0), "the order arrived after the stop was sent"
    bus.acts("RUNNING", **UNDER_WAY)
    assert driver.read().taken == (0, 0)
    bus.acts("FINISHED", orderId="12", driving=False)
    assert driver.read().taken == (13, 1)


def test_a_stop_that_overtakes_its_order_is_sent_again() -> None:
    bus, driver = told_to_stop()
    bus.acts("FAILED", driving=False)
    assert driver.read().taken == (0, 0), "the order may still be on its way"
    driver.write(RobotOutputs(msgspec.structs.replace(STOP, attempt=2)))
    assert bus.ids == ["12", "cancelOrder", "cancelOrder"]
    assert bus.sent[1]["actions"][0]["actionId"] != bus.sent[2]["actions"][0]["actionId"]
    bus.acts("FAILED", driving=False)
    assert driver.read().taken == (13, 2)


def test_a_stop_of_a_completed_order_counts_although_the_robot_calls_it_failed() -> None:
    bus, driver = told_to_stop()
    bus.acts("FAILED", orderId="12", driving=False)
    assert driver.read().taken == (13, 1)


@pytest.mark.parametrize(
    ("status", "paused", "taken"),
    [
        ("RUNNING", True, False),
        ("FINISHED", True, True),
        ("FAILED", False, False),
        ("FAILED", True, True),
    ],
)
def test_a_pause_counts_when_the_robot_has_obeyed(status: str, paused: bool, taken: bool) -> None:
    bus, driver = scripted(driving=False, paused=True)
    driver.read()
    driver.write(RobotOutputs(RobotCommand(3, "pause")))
    assert driver.read().taken == (0, 0), "the old state, read again"
    bus.acts(status, driving=False, paused=paused)
    assert driver.read().taken == ((3, 1) if taken else (0, 0))


def test_an_earlier_order_is_cancelled_at_each_attempt_until_the_robot_has_given_it_up() -> None:
    bus, driver = scripted(**UNDER_WAY)
    driver.read()
    for attempt in (1, 1, 2):
        driver.write(RobotOutputs(to(3.0, 14, attempt=attempt)))
        assert driver.read().busy
    assert bus.ids == ["cancelOrder", "cancelOrder"]
    assert bus.sent[0]["actions"][0]["actionId"] != bus.sent[1]["actions"][0]["actionId"]
    bus.acts("FINISHED", orderId="12", driving=False)
    assert not driver.read().busy
    driver.write(RobotOutputs(to(3.0, 14, attempt=2)))
    assert bus.ids[2:] == ["14-2"]
    assert not driver.read().busy


def test_an_order_that_the_robot_took_late_is_cancelled_too() -> None:
    """RMF gave two goals one after the other. The robot refuses the second order."""
    bus, driver = scripted(driving=False)
    for command in (to(8.0), to(3.0, 14)):
        driver.read()
        driver.write(RobotOutputs(command))
    bus.says("state", {**STATE, **UNDER_WAY})
    driver.read()
    driver.write(RobotOutputs(to(3.0, 14)))
    assert bus.ids == ["12", "14", "cancelOrder"]
    assert driver.read().busy


def test_an_order_of_the_robots_own_manager_keeps_no_pause_waiting() -> None:
    bus, driver = scripted(**{**UNDER_WAY, "orderId": "mission-3"})
    driver.read()
    driver.write(RobotOutputs(RobotCommand(3, "pause")))
    assert (bus.ids, driver.read().busy) == (["startPause"], False)


def test_nothing_is_sent_to_a_robot_that_is_not_connected() -> None:
    bus, driver = scripted(driving=False)
    driver.read()
    bus.says("connection", {"connectionState": "CONNECTIONBROKEN"})
    for command in (to(8.0), STOP, RobotCommand(3, "pause")):
        with pytest.raises(DriverError, match="not connected to the broker: CONNECTIONBROKEN"):
            driver.write(RobotOutputs(command))
    assert bus.ids == []
    bus.says("connection", {"connectionState": "ONLINE"})
    driver.write(RobotOutputs(STOP))
    assert bus.ids == ["cancelOrder"]


def test_a_stop_at_death_of_a_robot_that_is_not_connected_is_an_error() -> None:
    bus = Scripted()
    settings = VdaRobotSettings(manufacturer="acme", on_death="stop")
    driver = VdaRobot("AMR01", settings, bus)  # type: ignore[arg-type]
    bus.says("connection", {"connectionState": "OFFLINE"})
    with pytest.raises(DriverError, match="not connected to the broker: OFFLINE"):
        driver.make_safe()
    bus.says("connection", {"connectionState": "ONLINE"})
    driver.make_safe()
    assert bus.ids == ["cancelOrder", "cancelOrder"]


def test_our_orders_are_what_the_standard_asks_for() -> None:
    with robot() as bench:
        bench.until(moving=False)
        far = FarDevice(bench.site._broker.port, "uagv/v2/acme/0001/order")
        bench.driver.write(RobotOutputs(to(8.0)))
        wait_until(lambda: far.taken, "the order")
        far.close()
    order = json.loads(far.taken[0][1])
    assert order.pop("timestamp").endswith("Z")
    place = {"mapId": "L1", "y": 2.0}
    assert order == {
        "headerId": 1,
        "version": "2.1.0",
        "manufacturer": "acme",
        "serialNumber": "0001",
        "orderId": "12",
        "orderUpdateId": 0,
        "nodes": [
            {
                "nodeId": "start",
                "sequenceId": 0,
                "released": True,
                "nodePosition": {
                    **place,
                    "x": 1.0,
                    "theta": 0.5,
                    "allowedDeviationXY": 1.0,
                    "allowedDeviationTheta": 3.141592,
                },
                "actions": [],
            },
            {
                "nodeId": "pantry",
                "sequenceId": 2,
                "released": True,
                "nodePosition": {**place, "x": 8.0, "theta": 0.25, "allowedDeviationXY": 0.5},
                "actions": [],
            },
        ],
        "edges": [
            {
                "edgeId": "start-pantry",
                "sequenceId": 1,
                "released": True,
                "actions": [],
                "startNodeId": "start",
                "endNodeId": "pantry",
            }
        ],
    }

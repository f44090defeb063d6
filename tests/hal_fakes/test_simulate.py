"""The simulation that `run --simulate` uses, without the daemon.

Real buses run in real time, with simulated devices behind them.
"""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Side
from bridges.settings.load import Config, load
from drivers.hal.gpio import GpioBus
from drivers.lift.dry_contact import DryContactLift, create
from hal_fakes.caller import Caller
from hal_fakes.plants import lift as lift_plant
from hal_fakes.simulate import Simulation
from tests.hal_fakes.virtual_lift import SHIPPED
from tests.waiting import PATIENCE_S, at_last, wait_until
from workbench.commissioning.manual_control import driver_on

CONFIG = SHIPPED.parent


class SimulatedLift:
    """The lift of `config/lift_dry_contact.yaml`, opened as the daemon opens it."""

    def __init__(self, simulation: Simulation, config: Config) -> None:
        self.bus = simulation.open_bus("header")
        assert isinstance(self.bus, GpioBus)
        self._edge = threading.Event()
        self.bus.on_edge(self._edge.set)
        self.driver: DryContactLift = create("Lift1", config.devices["Lift1"], self.bus)
        self.driver.open()

    def until(self, reached: Callable[[LiftSample], bool]) -> LiftSample:
        """Read now, and again after each edge, until a reading fulfils the condition. The daemon's loop
        also reads after each edge."""
        while not reached(sample := self.driver.read()):
            assert self._edge.wait(PATIENCE_S), f"no edge for long after {sample}"
            self._edge.clear()
        return sample

    def close(self) -> None:
        self.driver.close()
        self.bus.close()


@pytest.fixture
def simulation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Simulation]:
    quick = lift_plant.LiftPace(floor_s=0.1, door_s=0.05, agv_s=0.05, dwell_s=0.1)
    monkeypatch.setattr(lift_plant, "LiftPace", lambda: quick)
    made = Simulation(load(SHIPPED), tmp_path)
    yield made
    made.close()


@pytest.fixture
def lift(simulation: Simulation) -> Iterator[SimulatedLift]:
    made = SimulatedLift(simulation, load(SHIPPED))
    yield made
    made.close()


def test_a_robot_rides_a_lift_on_simulated_hardware(lift: SimulatedLift) -> None:
    lift.driver.write(LiftOutputs(agv_request=True))
    lift.until(lambda seen: seen.agv is True)
    lift.driver.write(LiftOutputs(agv_request=True, call="L3"))
    lift.until(lambda seen: seen.level == "L2")
    lift.until(lambda seen: seen.door is DoorReading.OPEN)
    lift.driver.write(LiftOutputs(agv_request=True, hold_door=Side.FRONT))
    assert lift.driver.read() == LiftSample(level="L3", door=DoorReading.OPEN, agv=True)
    lift.driver.write(LiftOutputs())
    assert lift.until(lambda seen: seen.door is DoorReading.NOT_OPEN) == LiftSample(
        level="L3", door=DoorReading.NOT_OPEN, agv=False
    )


def test_commands_on_the_control_socket_reach_the_pins(
    lift: SimulatedLift, simulation: Simulation
) -> None:
    caller = Caller(simulation.socket_path("header"))
    assert caller.say("press Lift1 fire_alarm on") == "ok"
    lift.until(lambda seen: seen.hazards == {Hazard.FIRE})
    assert caller.say("press Lift1 fire_alarm off") == "ok"
    lift.until(lambda seen: not seen.hazards)
    assert caller.say("fail Lift1 code_blue off") == "ok"
    lift.until(lambda seen: seen.hazards == {Hazard.CODE_BLUE})
    assert caller.say("fail Lift1 door wrong") == "ok"
    lift.until(lambda seen: seen.door is DoorReading.OPEN)
    caller.close()


def test_closing_leaves_no_thread_and_no_socket(simulation: Simulation, tmp_path: Path) -> None:
    before = set(threading.enumerate())
    SimulatedLift(simulation, load(SHIPPED)).close()
    simulation.close()
    simulation.close()
    assert set(threading.enumerate()) - before == set()
    assert list(tmp_path.iterdir()) == []


def test_each_of_several_buses_has_its_own_socket(tmp_path: Path) -> None:
    text = SHIPPED.read_text().replace(
        "  header: {type: gpio}", "  header: {type: gpio}\n  other: {type: gpio, chip: 1}"
    )
    second = text[text.index("  Lift1:") :].replace("Lift1:", "Lift2:\n    bus: other")
    text = text.replace("Lift1:", "Lift1:\n    bus: header") + second
    file = tmp_path / "two.yaml"
    file.write_text(text)
    config = load(file)
    simulation = Simulation(config, tmp_path)
    buses = [simulation.open_bus(name) for name in config.buses]
    callers = [Caller(tmp_path / f"plant-{name}.sock") for name in config.buses]
    assert [c.say("press Lift2 fire_alarm on") for c in callers] == [
        "error no device 'Lift2'; there are Lift1",
        "ok",
    ]
    for caller in callers:
        caller.close()
    for bus in buses:
        bus.close()
    simulation.close()


def test_a_lift_on_two_buses_is_one_plant_behind_both(tmp_path: Path) -> None:
    """The lift's relays are on a real Modbus server, and its floor lines are on simulated pins.

    One process simulates both, so that one lift is behind both buses.
    """
    config = load(CONFIG / "lift_two_buses.yaml")
    simulation = Simulation(config, tmp_path)
    buses = {name: simulation.open_bus(name) for name in config.buses}
    driver = driver_on(config, "Lift1", buses)
    driver.open()
    caller = Caller(simulation.socket_path("gateway"))

    def until(what: str, reached: Callable[[LiftSample], bool]) -> None:
        wait_until(lambda: reached(at_last(driver.read, what)), what)

    until("the car stands at L1", lambda seen: seen.level == "L1")
    at_last(lambda: driver.write(LiftOutputs(agv_request=True)), "AGV mode is requested")
    until("AGV mode", lambda seen: seen.agv is True)
    at_last(lambda: driver.write(LiftOutputs(agv_request=True, call="L2")), "L2 is called")
    until("the car is at L2", lambda seen: seen.level == "L2")
    assert caller.say("press Lift1 fire_alarm on") == "ok"
    until("the alarm on a pin", lambda seen: seen.hazards == {Hazard.FIRE})
    caller.close()
    driver.close()
    for bus in buses.values():
        bus.close()
    simulation.close()

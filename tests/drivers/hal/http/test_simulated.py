"""The HTTP charger of `--simulate`. The charger is a child process, and the test sends commands to its
control socket."""

from pathlib import Path

from bridges.kinds.charger.signals import Activity
from bridges.settings.load import load
from drivers.charger.http import create
from drivers.hal.http import HttpBus
from hal_fakes.caller import Caller
from hal_fakes.simulate import Simulation
from tests.waiting import wait_until

EXAMPLE = Path(__file__).parents[4] / "config" / "charger_http.yaml"


def test_a_robot_that_is_pressed_onto_the_pad_is_charged_and_the_child_ends_with_us(
    tmp_path: Path,
) -> None:
    config = load(EXAMPLE)
    simulation = Simulation(config, tmp_path)
    bus = simulation.open_bus("tpu")
    assert isinstance(bus, HttpBus)
    driver = create("charger_a", config.devices["charger_a"], bus)
    assert driver.read().activity is Activity.IDLE
    with Caller(tmp_path / "plant.sock") as caller:
        caller.order("press charger_a robot on")
    wait_until(lambda: driver.read().activity is Activity.CHARGING, "the charger charges the robot")
    bus.close()
    simulation.close()
    assert list(tmp_path.iterdir()) == []

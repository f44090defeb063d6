"""The far side (simulated hardware) of `run --simulate`. Each CAN charger of `config/` is behind a
simulated CAN adapter."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bridges.kinds.charger.signals import Activity, ChargerOutputs
from bridges.settings.load import load
from drivers import DriverError
from drivers.charger import can_frames as charger_can_frames
from drivers.charger import canopen as charger_canopen
from hal_fakes.caller import Caller
from hal_fakes.simulate import Simulation
from tests.waiting import wait_until

CONFIG = Path(__file__).parents[4] / "config"
SHIPPED = [
    ("charger_canopen", charger_canopen, "charger_b"),
    ("charger_wiferion", charger_can_frames, "charger_c"),
]
ON, OFF = ChargerOutputs(True), ChargerOutputs(False)


class Site:
    """The simulated devices of one file of `config/`."""

    def __init__(self, shipped: tuple[str, Any, str], directory: Path) -> None:
        file, driver, name = shipped
        config = load(CONFIG / f"{file}.yaml")
        self.name = name
        self._simulation = Simulation(config, directory)
        self.bus = self._simulation.open_bus("can")
        self.driver = driver.create(name, config.devices[name], self.bus)
        self.driver.open()
        self._caller = Caller(self._simulation.socket_path("can"))

    def say(self, text: str) -> None:
        assert self._caller.say(text.format(self.name)) == "ok"

    def sees(self, activity: Activity, outputs: ChargerOutputs) -> bool:
        """Run one scan, and return whether the driver reads this activity."""
        try:
            found = self.driver.read().activity
            self.driver.write(outputs)
        except DriverError:
            return False
        return found is activity

    def close(self) -> None:
        self._caller.close()
        self.driver.close()
        self.bus.close()
        self._simulation.close()


@pytest.fixture(params=SHIPPED, ids=lambda shipped: str(shipped[0]))
def site(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Site]:
    made = Site(request.param, tmp_path)
    yield made
    made.close()


def test_a_shipped_charger_charges_a_robot_is_lost_and_found_and_shows_its_errors(
    site: Site,
) -> None:
    wait_until(lambda: site.sees(Activity.IDLE, OFF), "the charger is idle")
    site.say("press {} robot on")
    wait_until(lambda: site.sees(Activity.CHARGING, ON), "the charger charges the robot")
    site.say("fail {} bus off")
    wait_until(lambda: not site.sees(Activity.CHARGING, ON), "the loss of the bus is noticed")
    site.say("fail {} bus ok")
    site.bus.insist()
    wait_until(lambda: site.sees(Activity.CHARGING, ON), "the charger is found charging again")
    site.say("press {} transmitter_fault on")
    wait_until(lambda: site.sees(Activity.ERROR, OFF), "the charger shows an error")

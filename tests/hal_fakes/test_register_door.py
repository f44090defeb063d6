"""The simulated doors of `config/door_register.yaml`, as `run --simulate` builds them, without the
daemon."""

from pathlib import Path

from bridges.kinds.door.signals import DoorOutputs
from bridges.settings.load import load
from drivers.door.register import create
from hal_fakes.simulate import Simulation
from tests.waiting import wait_until

SHIPPED = Path(__file__).parents[2] / "config" / "door_register.yaml"


def test_the_shipped_register_doors_open_and_close_in_simulation(tmp_path: Path) -> None:
    config = load(SHIPPED)
    simulation = Simulation(config, tmp_path)
    bus = simulation.open_bus("line")
    try:
        doors = {name: create(name, s, bus) for name, s in config.devices.items()}  # type: ignore[arg-type]
        for door in doors.values():
            door.open()
            assert door.read().closed
            door.write(DoorOutputs(hold_open=True))
        for name, door in doors.items():
            wait_until(lambda door=door: door.read().opened, f"{name} is open")  # type: ignore[misc]
            door.write(DoorOutputs(hold_open=False))
        for name, door in doors.items():
            wait_until(lambda door=door: door.read().closed, f"{name} is closed")  # type: ignore[misc]
            door.close()
    finally:
        bus.close()
        simulation.close()

"""The simulated device of a bus (the far side) in its own process. It never outlives the daemon."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import pytest

from bridges.kinds.door.signals import DoorOutputs, DoorSample
from bridges.settings.load import Config, load
from drivers.door.dry_contact import create
from drivers.hal import HalError
from hal_fakes.caller import Caller
from hal_fakes.simulate import Simulation
from tests.hal_fakes.virtual_lift import SHIPPED
from tests.waiting import PATIENCE_S, wait_until

DOOR = SHIPPED.parent / "door_modbus.yaml"


@pytest.fixture
def config() -> Config:
    return load(DOOR)


@pytest.fixture
def simulation(config: Config, tmp_path: Path) -> Iterator[Simulation]:
    made = Simulation(config, tmp_path)
    yield made
    made.close()


def test_a_real_bus_connects_to_the_fake_and_moves_the_plant(
    simulation: Simulation, config: Config
) -> None:
    bus = simulation.open_bus("module")
    driver = create("ward_door", config.devices["ward_door"], bus)  # type: ignore[arg-type]
    story = Caller(simulation.socket_path("module"))
    driver.open()
    assert driver.read() == DoorSample(opened=False, closed=True)
    assert story.say("follow") == "ok"
    driver.write(DoorOutputs(hold_open=True))
    assert [(e.what, e.signal, e.value) for e in islice(story.edges(), 3)] == [
        ("relay", "hold_open", True),
        ("sensor", "closed", False),
        ("sensor", "opened", True),
    ]
    assert driver.read() == DoorSample(opened=True, closed=False)
    story.close()
    driver.close()
    bus.close()


def test_closing_ends_the_far_side_and_removes_its_socket(
    simulation: Simulation, config: Config, tmp_path: Path
) -> None:
    simulation.open_bus("module").close()
    story = Caller(tmp_path / "plant.sock")
    assert story.say("follow") == "ok"
    simulation.close()
    assert (story.hear(), list(tmp_path.iterdir())) == ("", [])
    story.close()


DAEMON = """
import sys
from pathlib import Path
from bridges.settings.load import load
from hal_fakes.simulate import Simulation
config = load(sys.argv[1])
simulation = Simulation(config, Path(sys.argv[2]))
simulation.open_bus("module")
print("open", flush=True)
sys.stdin.read()
"""


def test_a_daemon_that_is_killed_leaves_no_far_side_behind(tmp_path: Path) -> None:
    daemon = subprocess.Popen(
        [sys.executable, "-c", DAEMON, str(DOOR), str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    with daemon:
        assert daemon.stdout is not None
        assert daemon.stdout.readline() == b"open\n"
        story = Caller(tmp_path / "plant.sock")
        assert story.say("follow") == "ok"
        daemon.kill()
        assert story.hear() == ""
        story.close()


@pytest.fixture
def far_side(tmp_path: Path) -> Iterator["subprocess.Popen[str]"]:
    with subprocess.Popen(
        [sys.executable, "-m", "hal_fakes", DOOR, "module", "--socket", tmp_path / "plant.sock"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as started:
        yield started
        started.kill()


def test_a_far_side_prints_its_address_and_ignores_ctrl_c_and_ends_with_its_input(
    far_side: "subprocess.Popen[str]", tmp_path: Path
) -> None:
    assert far_side.stdin is not None
    assert far_side.stdout is not None
    replace = json.loads(far_side.stdout.readline())
    assert (replace["tcp"]["host"], list(replace)) == ("127.0.0.1", ["tcp"])
    far_side.send_signal(signal.SIGINT)
    story = Caller(tmp_path / "plant.sock")
    assert story.say("press ward_door push on") == "ok"
    story.close()
    far_side.stdin.close()
    assert far_side.wait(PATIENCE_S) == 0


def test_a_far_side_that_cannot_start_is_a_hal_error_with_a_reason(
    config: Config, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    simulation = Simulation(config, tmp_path / "missing")
    with pytest.raises(HalError, match=r"^the simulated far side of bus module did not start"):
        simulation.open_bus("module")
    wait_until(
        lambda: "cannot make the plant's control socket" in capfd.readouterr().err,
        "the far side's log names the error",
    )
    simulation.close()

"""A new process that switches off. Silent devices must not keep another device's relay on."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import pytest
from msgspec.structs import replace

from bridges.runtime.dead_daemon import ages
from bridges.runtime.switch_off import outputs_off
from bridges.settings.config import Config
from bridges.settings.load import load
from bridges.system.directories import Directories
from drivers import Driver
from drivers.hal import Bus
from tests.drivers.hal.modbus.module import Module, door
from tests.runtime.test_silent_units import BUSES, DOOR, YAML

SILENT = 30


@pytest.fixture
def module() -> Iterator[Module]:
    """Yield a module with many units. Only the last unit answers, and its relay is on.

    At the time limit some threads still wait for silent units. They end when the module closes, and the
    fixture waits for their end.
    """
    before = set(threading.enumerate())
    standing = Module()
    standing.units.clear()
    door(standing, SILENT + 1)
    standing.coils[SILENT + 1, 0] = True
    yield standing
    standing.close()
    for thread in set(threading.enumerate()) - before:
        thread.join()


def yaml(module: Module, folder: Path, *units: int) -> Path:
    file = folder / "corridor.yaml"
    place = BUSES[Module].format(port=module.port)
    file.write_text(YAML.format(place=place) + "".join(DOOR.format(unit=u) for u in units))
    return file


def test_the_device_that_answered_last_is_switched_off_before_silent_ones_use_up_the_time(
    module: Module, tmp_path: Path
) -> None:
    config = load(yaml(module, tmp_path, *range(1, SILENT + 2)))
    live = f"door{SILENT + 1}"
    assert outputs_off(config, 1.0, ages={"door1": 9.0, live: 0.1}) == {live}
    assert module.coils[SILENT + 1, 0] is False
    assert module.units_asked()[0] == SILENT + 1


def test_a_frame_that_is_lost_leaves_no_relay_on(module: Module, tmp_path: Path) -> None:
    def lost(request: bytes) -> bytes:
        return b"" if len(module.asked) == 1 else module.answer(request)

    module.reply = lost
    config = load(yaml(module, tmp_path, SILENT + 1))
    assert outputs_off(config, 30.0) == set(config.devices)
    assert module.coils[SILENT + 1, 0] is False


@pytest.mark.parametrize(("broken", "first_off"), [("create", False), ("close", True)])
def test_a_driver_with_a_defect_leaves_no_other_device_of_its_bus_on(
    module: Module,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    broken: str,
    first_off: bool,
) -> None:
    for unit in (1, 2):
        door(module, unit)
        module.coils[unit, 0] = True
    config = load(yaml(module, tmp_path, 1, 2))
    real = config.driver_type("door1")

    def defect(*_: object) -> NoReturn:
        raise KeyError("our own mistake")

    def create(name: str, settings: Any, bus: Bus) -> Driver[Any, Any]:
        if name != "door1":
            return real.create(name, settings, bus)
        if broken == "create":
            defect()
        driver = real.create(name, settings, bus)
        monkeypatch.setattr(driver, broken, defect)
        return driver

    monkeypatch.setattr(Config, "driver_type", lambda *_: replace(real, create=create))
    off = {"door1", "door2"} if first_off else {"door2"}
    assert outputs_off(config, 30.0) == off
    assert module.coils[2, 0] is False
    assert "our own mistake" in caplog.text


def test_the_dead_daemons_status_says_which_devices_answered_last(tmp_path: Path) -> None:
    there = Directories(tmp_path, tmp_path)
    assert ages(there) == {}
    status = tmp_path / "status.json"
    status.write_text('{"devices":{"a":{"input_age_s":0.1},"b":{"input_age_s":null},"c":{}}}')
    assert ages(there) == {"a": 0.1}
    for odd in ("", "[]", '{"devices":[]}', '{"devices":{"a":{"input_age_s":"x"}}}', "[" * 9999):
        status.write_text(odd)
        assert ages(there) == {}

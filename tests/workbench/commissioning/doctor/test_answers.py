"""The doctor reads each device through its driver, but does not call the driver's `open`. The tests
check that every driver can read without `open`."""

import re
from contextlib import closing
from pathlib import Path

import msgspec
import pytest

from bridges.settings.load import load
from hal_fakes.__main__ import served
from tests.drivers.hal.mqtt.broker import FarDevice
from tests.waiting import wait_until
from workbench.commissioning.doctor.answers import answers, numbers, ranges, readings, unarmed
from workbench.commissioning.examples import device_yamls

CONFIG = Path(__file__).parents[4] / "config"
ASKED = sorted(
    path.name
    for path in device_yamls()
    if re.search(r"type: (modbus|http|mqtt|can)\b", path.read_text())
)


@pytest.mark.parametrize("name", ASKED)
def test_the_devices_of_each_example_answer_an_unopened_driver(name: str, tmp_path: Path) -> None:
    config = load(CONFIG / name)
    for bus_name, settings in config.buses.items():
        if config.bus_types[bus_name] == "gpio":
            continue  # the doctor reads GPIO lines from the kernel, without a driver
        with served(CONFIG / name, bus_name, tmp_path / "plant.sock") as replace:
            plain = {**msgspec.to_builtins(unarmed(settings)), **replace, "timeout_s": 1.5}
            there = msgspec.convert(plain, type(settings))
            with closing(config.bus_type(bus_name).open_bus(there)) as bus:
                devices = config.devices_at(bus_name)

                def check_all_answer(bus_name: str = bus_name, bus: object = bus) -> bool:
                    found = list(readings(config, bus_name, bus, "bus"))
                    assert [one.subject for one in found] == ["bus"] * len(found)
                    return {one.level for one in found} == {"ok"}

                wait_until(check_all_answer, f"{', '.join(devices)} answer")


def test_the_topics_that_there_are_are_listed_up_to_a_number(tmp_path: Path) -> None:
    name = "door_mqtt.yaml"
    config = load(CONFIG / name)
    with served(CONFIG / name, "building", tmp_path / "plant.sock") as replace:
        port = replace["port"]
        text = (CONFIG / name).read_text()
        file = tmp_path / name
        file.write_text(text.replace("host: 192.168.1.10", f"host: 127.0.0.1\n    port: {port}"))
        config = load(file)
        with closing(FarDevice(int(str(port)))) as far:
            for number in range(60):
                far.says(f"sensor/{number:02}", "1", retain=True)
            told = [finding.found for finding in answers(config, "building", whole=True)]
            without = [finding.found for finding in answers(config, "building", whole=False)]
    assert [one for one in told if "sensor/" in one] == [
        f"retained sensor/{number:02}" for number in range(40)
    ]
    assert told[-1].startswith("and 20 more: mosquitto_sub")
    assert not any("sensor/" in one for one in without)


def test_the_units_and_nodes_of_a_file_are_known() -> None:
    found = {name: _numbers(name) for name in ("door_modbus.yaml", "charger_canopen.yaml")}
    assert found == {"door_modbus.yaml": ({1}, set()), "charger_canopen.yaml": (set(), {10})}


def _numbers(name: str) -> tuple[set[int], set[int]]:
    config = load(CONFIG / name)
    (bus,) = config.buses
    return set(numbers(config, bus, "unit")), set(numbers(config, bus, "node"))


def test_numbers_are_printed_as_ranges() -> None:
    assert [ranges(n) for n in ([], [4], [1, 2, 3, 9, 11, 12])] == ["", "4", "1 to 3, 9, 11 to 12"]

"""The driver of Xnergy's receiver on Modbus: its requests, and the output of `check`."""

from pathlib import Path

import msgspec
import pytest

from bridges.kinds.charger.signals import ChargerOutputs
from bridges.settings.load import load
from drivers.charger.modbus import ModbusChargerSettings, claims, create, describe, warnings
from drivers.hal import HalError
from drivers.hal.modbus import ModbusBus
from drivers.hal.modbus import ModbusSettings as BusSettings
from hal_fakes.modbus import ModbusServer
from hal_fakes.plants.xnergy_rcu import ModbusRcu, rcu_plant
from tests.drivers.hal.modbus.module import Time

EXAMPLE = Path(__file__).parents[3] / "config" / "charger_modbus.yaml"
SETTINGS = ModbusChargerSettings(unit=16)


def test_check_names_every_register_and_coil() -> None:
    config = load(EXAMPLE)
    rows = dict(describe(config.devices["charger_c"], config.buses["rcu"]))
    assert rows["state"] == "read unit 16 input register 51"
    assert rows["latched_low"] == "the same in an error: unit 16 input register 0"
    assert rows["power"] == "write unit 16 coil 0: 1 starts from idle, 0 stops"
    assert rows["range check"] == "write unit 16 coil 2 before each start"
    assert rows["end of the daemon"] == "0 is written"
    assert rows["state charging"] == "5"
    kept = msgspec.structs.replace(config.devices["charger_c"], on_death="keep")
    assert dict(describe(kept, config.buses["rcu"]))["end of the daemon"] == "nothing"


def test_no_other_device_may_use_its_coils() -> None:
    assert list(claims(SETTINGS)) == [
        ("unit 16 coil 0", ("unit",)),
        ("unit 16 coil 2", ("unit",)),
    ]


def test_check_warns_that_it_is_untried_and_that_it_reports_no_receiver() -> None:
    known = msgspec.structs.replace(SETTINGS, receivers={"1": "tiny/AMR01"})
    assert [path for path, _ in warnings(known)] == [(), (), ("receivers",)]
    assert [path for path, _ in warnings(SETTINGS)] == [(), ()]


def test_closing_an_enabled_receiver_that_was_lost_raises_nothing() -> None:
    plant, clock = rcu_plant("c"), Time()
    server = ModbusServer([ModbusRcu(plant, SETTINGS)], slow_s=0.3)
    plain = {"type": "modbus", "timeout_s": 5.0, "retries": 0, **server.replace}
    bus = ModbusBus(msgspec.convert(plain, BusSettings), clock)
    driver = create("c", SETTINGS, bus)
    driver.read()
    driver.write(ChargerOutputs(True))
    server.close()
    with pytest.raises(HalError):
        driver.read()
    driver.close()
    bus.close()
    assert [edge.value for edge in plant.edges if edge.signal == "power"] == [True]

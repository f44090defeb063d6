"""Every driver of a charger that is switched keeps the same contract."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import ClassVar

import msgspec

from bridges.settings.load import load
from drivers.charger import http as charger_http
from drivers.charger import modbus as charger_modbus
from drivers.hal import http, modbus
from hal_fakes.http import HttpServer
from hal_fakes.http_charger import HttpCharger
from hal_fakes.modbus import ModbusServer
from hal_fakes.plants.charger import ChargerPlant
from hal_fakes.plants.pad import PadPlant
from hal_fakes.plants.xnergy_rcu import ModbusRcu
from hal_fakes.realtime import RealTime
from tests.drivers.charger.contract import PACE, Bench, ChargerContract, ChargerDriver, OnDeath
from tests.drivers.hal.modbus.module import Time

CONFIG = Path(__file__).parents[3] / "config"


class TestAnotherMakeOnHttp(ChargerContract):
    link: ClassVar = "server"

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = load(CONFIG / "charger_http_full.yaml").devices["charger_b"]
        plant = ChargerPlant("a", settings.receivers, commanded=True, asked=True, pace=PACE)
        world, clock = RealTime({"a": plant}), Time()
        server = HttpServer([HttpCharger(world.plants["a"], settings)], "", timeout_s=0.5)
        plain = {"type": "http", "api_base": "tpu", "timeout_s": 0.5, **server.replace}
        bus = http.HttpBus(msgspec.convert(plain, http.Settings), clock)

        def new(on_death: OnDeath) -> ChargerDriver:
            changed = msgspec.structs.replace(settings, on_death=on_death)
            return charger_http.create("a", changed, bus)

        try:
            yield Bench(new, world.plants["a"], clock)
        finally:
            bus.close()
            server.close()
            world.close()


class RcuBench(Bench):
    """A receiver is enabled."""

    switch: ClassVar = "enable"


class TestAReceiverOnModbus(ChargerContract):
    link: ClassVar = "unit"

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = load(CONFIG / "charger_modbus.yaml").devices["charger_c"]
        world, clock = RealTime({"a": PadPlant("a", pace=PACE)}), Time()
        server = ModbusServer([ModbusRcu(world.plants["a"], settings)], slow_s=0.3)
        plain = {"type": "modbus", "timeout_s": 0.2, **server.replace}
        bus = modbus.ModbusBus(msgspec.convert(plain, modbus.Settings), clock)

        def new(on_death: OnDeath) -> ChargerDriver:
            changed = msgspec.structs.replace(settings, on_death=on_death)
            return charger_modbus.create("a", changed, bus)

        try:
            yield RcuBench(new, world.plants["a"], clock)
        finally:
            bus.close()
            server.close()
            world.close()

    def checks(self, bench: Bench) -> list[bool]:
        return bench.switched("check_range")

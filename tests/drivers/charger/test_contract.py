"""The contract of switchable chargers, tried with every driver."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

from bridges.kinds.charger.signals import Activity, ChargerOutputs
from bridges.settings.load import load
from drivers.charger import dry_contact as charger_contacts
from drivers.charger import http as charger_http
from drivers.charger import modbus as charger_modbus
from drivers.charger import register as charger_register
from drivers.hal import modbus
from tests.drivers.benches import on_http, on_modbus
from tests.drivers.charger.contract import (
    AS_IT_IS,
    ON,
    Bench,
    ChargerContract,
    behind,
    news,
)

CONFIG = Path(__file__).parents[3] / "config"


def shipped(file: str, device: str) -> Any:
    """Return a device's settings from a file of `config/`."""
    return load(CONFIG / file).devices[device]


class TestAnotherMakeOnHttp(ChargerContract):
    link: ClassVar = "server"
    example: ClassVar = ("charger_http_full.yaml", "charger_b")

    def settings(self) -> Any:
        return shipped(*self.example)

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = self.settings()
        world, station = behind(charger_http, settings)
        with on_http(world, station, timeout_s=0.5) as (bus, clock):
            yield Bench(news(charger_http, settings, bus), station.plant, clock)


class TestASupplyOnARelay(TestAnotherMakeOnHttp):
    example: ClassVar = ("charger_relay.yaml", "charger_d")
    foreign_object: ClassVar = "the relay is too hot"

    def test_a_check_of_the_range_is_sent_once_for_a_rise(self, bench: Bench) -> None:
        bench.driver.open()
        bench.driver.read()
        bench.driver.write(ChargerOutputs(False, range_checks=1))
        assert self.checks(bench) == []


class TestAReceiverOnModbus(ChargerContract):
    link: ClassVar = "unit"

    def settings(self) -> Any:
        return shipped("charger_modbus.yaml", "charger_c")

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = self.settings()
        world, rcu = behind(charger_modbus, settings)
        with on_modbus(world, [rcu]) as (bus, clock):
            yield Bench(news(charger_modbus, settings, bus), rcu.plant, clock)


class TestAnyMakeOnRegisters(ChargerContract):
    link: ClassVar = "unit"

    def settings(self) -> Any:
        return shipped("charger_register.yaml", "charger_f")

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = self.settings()
        world, station = behind(charger_register, settings)
        with on_modbus(world, [station]) as (bus, clock):
            yield Bench(news(charger_register, settings, bus), station.plant, clock)


class ContactBench(Bench):
    """A bench on which the power command is a relay with the name `enable`."""

    switch: ClassVar = "enable"


class TestContactsAtAModule(ChargerContract):
    """A charger whose relay is at a module. When the daemon has died, the module drops the relay."""

    link: ClassVar = "unit"
    measures: ClassVar = False
    foreign_object: ClassVar = "the fault contact"

    def settings(self) -> Any:
        return shipped("charger_contacts.yaml", "charger_e")

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = self.settings()
        world, wiring = behind(charger_contacts, settings, modbus.canonical)
        with on_modbus(world, [wiring]) as (bus, clock):
            yield ContactBench(news(charger_contacts, settings, bus), wiring.plant, clock)

    def test_a_new_daemon_finds_a_charge_and_can_stop_it(self, bench: Bench) -> None:
        bench.driver.open()
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        bench.driver = bench.new("stop")
        bench.driver.open()
        bench.until(Activity.IDLE, AS_IT_IS)
        assert bench.switched() == [True, False]

    def test_the_daemons_end_stops_a_charge_or_keeps_it_as_the_yaml_says(
        self, bench: Bench
    ) -> None:
        bench.driver.open()
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        bench.driver.make_safe()
        bench.driver.close()
        bench.until(Activity.IDLE, AS_IT_IS)
        assert bench.switched() == [True, False]

    def test_a_check_of_the_range_is_sent_once_for_a_rise(self, bench: Bench) -> None:
        bench.driver.open()
        bench.driver.read()
        bench.driver.write(ChargerOutputs(False, range_checks=1))
        assert bench.switched() == []

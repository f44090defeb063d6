"""The contract of alarm panel drivers, tried with every driver on every bus."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import msgspec
import pytest

from bridges.kinds.alarm.signals import PanelOutputs, PanelSample
from drivers import DriverError
from drivers.alarm import dry_contact
from drivers.alarm import http as http_panel
from drivers.hal import modbus
from hal_fakes import http_alarm
from hal_fakes.http_flags import FlagStation
from hal_fakes.plants.alarm import PanelPlant
from hal_fakes.plants.plant import FailureMode
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.drivers import benches
from tests.drivers.benches import RS485, TIMEOUT_S, Contract, on_http, on_modbus, on_pins
from tests.waiting import wait_until

BASE: dict[str, Any] = {"alarm": "fire_alarm_trigger", "silent_alarm_after_s": 60, "drill_s": 300}
CLEAR = PanelSample({"fire": False, "blue": False}, False)

Bench = benches.Bench[PanelSample, PanelOutputs]


def wired(points: list[str], **pull: str) -> dry_contact.DryContactPanelSettings:
    """Return a panel on these points. A cut wire of `fire` or `blue` reads as an alarm."""
    active = "high" if pull else "low"
    fire, blue, drill = ({"point": point, "active": active, **pull} for point in points)
    plain = {**BASE, "sources": {"fire": fire, "blue": blue}, "drill": {**drill, "active": "high"}}
    if pull:
        plain["drill"] = {**drill, "active": "low"}
    return msgspec.convert(plain, dry_contact.DryContactPanelSettings)


class PanelContract(Contract[Bench]):
    """Duties of every driver of a panel."""

    def test_each_source_and_the_drill_read_as_they_are(self, bench: Bench) -> None:
        bench.open()
        wait_until(lambda: bench.read() == CLEAR, "a quiet panel reads clear")
        for signal in ("fire", "blue", "drill"):
            bench.plant.press(signal, True, 1e9)
            drill = signal == "drill"
            on = PanelSample({s: s == signal for s in ("fire", "blue")}, drill)
            wait_until(lambda on=on: bench.read() == on, f"{signal} reads alone")  # type: ignore[misc]
            bench.plant.press(signal, False, 1e9)

    def test_nothing_is_ever_driven(self, bench: Bench) -> None:
        bench.open()
        bench.write(PanelOutputs())
        bench.driver.make_safe()
        assert bench.relays() == []


class LinkedPanelContract(PanelContract):
    """Duties of a driver whose link can fail. `parts` names the parts on the far side that a test
    switches off."""

    parts: ClassVar[tuple[str, ...]] = ("unit", "server")

    def test_a_panel_that_is_off_is_an_error_and_comes_back(self, bench: Bench) -> None:
        bench.open()
        for part in self.parts:
            bench.plant.fail(part, "off")
            wait_until(lambda: isinstance(bench.patiently(), str), f"the lost {part} is noticed")
            with pytest.raises(DriverError):
                bench.driver.read()
            bench.plant.fail(part, None)
            wait_until(lambda: bench.patiently() == CLEAR, f"the panel is back after the {part}")

    @pytest.mark.parametrize("mode", ["garbage", "wrong", "slow"])
    def test_a_failing_link_is_an_error_and_no_reading(
        self, bench: Bench, mode: FailureMode
    ) -> None:
        bench.open()
        bench.until_it_fails("server", mode, lambda sample: sample != CLEAR)
        bench.plant.fail("server", None)
        wait_until(lambda: bench.patiently() == CLEAR, "the panel is back after the failure")


class TestContactsOnModbus(LinkedPanelContract):
    serial: ClassVar[modbus.Serial | None] = None
    points: ClassVar = [f"unit 1 discrete input {n}" for n in range(3)]

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = wired(self.points)
        wires = dry_contact.wires(settings)
        world = RealTime({"panel": PanelPlant("panel", wires)})
        wiring = PlantWiring(world.plants["panel"], wires, modbus.canonical)
        with on_modbus(world, [wiring], self.serial) as (bus, clock):
            yield Bench(dry_contact.create("panel", settings, bus), wiring.plant, clock)

    def test_a_cut_loop_reads_as_an_alarm(self, bench: Bench) -> None:
        bench.open()
        bench.plant.fail("fire", "off")
        wait_until(lambda: bench.read().sources["fire"], "the cut loop is an alarm")


class TestContactsOnRs485(TestContactsOnModbus):
    serial: ClassVar = RS485


class TestBitsOfRegisters(LinkedPanelContract):
    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = wired([f"unit 1 holding register 40 bit {n}" for n in range(3)])
        wires = dry_contact.wires(settings)
        world = RealTime({"panel": PanelPlant("panel", wires)})
        wiring = PlantWiring(world.plants["panel"], wires, modbus.canonical)
        with on_modbus(world, [wiring]) as (bus, clock):
            yield Bench(dry_contact.create("panel", settings, bus), wiring.plant, clock)


class TestContactsOnPins(PanelContract):
    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = wired(["BCM5", "BCM6", "BCM13"], pull="up")
        wires = dry_contact.wires(settings)
        world = RealTime({"panel": PanelPlant("panel", wires)})
        with on_pins(world, world.plants["panel"], wires) as bus:
            yield Bench(dry_contact.create("panel", settings, bus), world.plants["panel"])

    def test_a_cut_loop_reads_as_an_alarm(self, bench: Bench) -> None:
        bench.open()
        bench.plant.fail("fire", "off")
        wait_until(lambda: bench.read().sources["fire"], "the cut loop is an alarm")


class TestFieldsOnHttp(LinkedPanelContract):
    parts: ClassVar = ("server",)

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        fields = {name: {"field": f"inputs.{name}"} for name in ("fire", "blue")}
        plain = {**BASE, "state_path": "/state", "sources": fields, "drill": {"field": "drill"}}
        settings = msgspec.convert(plain, http_panel.HttpPanelSettings)
        plant = http_alarm.FAKE.plant("panel", settings, [])
        world = RealTime({"panel": plant})
        station = FlagStation(plant, settings.state_path, http_alarm.fields(settings))
        with on_http(world, station, TIMEOUT_S) as (bus, clock):
            yield Bench(http_panel.HttpPanel(settings, bus), plant, clock)


def test_a_source_that_is_null_or_missing_is_an_error_and_not_clear() -> None:
    class Answers:
        def __init__(self, answer: dict[str, object]) -> None:
            self.get_json = lambda path: answer

    plain = {**BASE, "drill_s": None, "state_path": "/", "sources": {"fire": {"field": "a.b"}}}
    settings = msgspec.convert(plain, http_panel.HttpPanelSettings)
    wrong: list[dict[str, object]] = [{"a": {"b": None}}, {"a": {}}, {"a": {"b": 3}}]
    for answer in wrong:
        with pytest.raises(DriverError):
            http_panel.HttpPanel(settings, Answers(answer)).read()  # type: ignore[arg-type]
    told = http_panel.HttpPanel(settings, Answers({"a": {"b": True}})).read()  # type: ignore[arg-type]
    assert told == PanelSample({"fire": True})

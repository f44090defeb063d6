"""The bench and the buses for the contract tests of drivers."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any, Generic, TypeVar

import msgspec
import pytest

from drivers import Driver, DriverError
from drivers.hal import gpio, http, modbus, mqtt
from drivers.hal.points import Wire
from hal_fakes.gpio import WiredFactory
from hal_fakes.http import HttpServer, HttpStation
from hal_fakes.modbus import ModbusServer
from hal_fakes.modbus.rtu import RtuLine
from hal_fakes.modbus.units import FarSide
from hal_fakes.mqtt import PARTS, MqttSite
from hal_fakes.plants.plant import FailureMode, Plant
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.drivers.hal.modbus.module import Time
from tests.waiting import at_last, wait_until

TIMEOUT_S = 0.2
RS485 = modbus.Serial(port="/dev/null", baudrate=57600, parity="none", stopbits=1)

Sample = TypeVar("Sample")
Outputs = TypeVar("Outputs")


class Bench(Generic[Sample, Outputs]):
    """One driver on one bus, with a simulated device behind the bus. After a failure the bus pauses.
    `clock` measures these pauses."""

    def __init__(
        self, driver: Driver[Sample, Outputs], plant: Plant, clock: Time | None = None
    ) -> None:
        self.driver = driver
        self.plant = plant
        self.clock = clock or Time()

    def relays(self) -> list[tuple[str, object]]:
        """Return (signal, value) for every edge of every output so far."""
        return [(edge.signal, edge.value) for edge in self.plant.edges if edge.what == "relay"]

    def open(self) -> None:
        """Open the driver."""
        at_last(self.driver.open, "the driver opens", self.a_moment)

    def read(self) -> Sample:
        """Return a reading."""
        return at_last(self.driver.read, "the driver reads the device", self.a_moment)

    def write(self, outputs: Outputs) -> None:
        """Write these outputs."""
        at_last(lambda: self.driver.write(outputs), "the outputs are written", self.a_moment)

    def a_moment(self) -> None:
        """Let so much time pass that the bus ends every pause after a failure."""
        self.clock.now += 60.0

    def patiently(self) -> Sample | str:
        """Return a reading after all pauses of the bus, or the text of the error."""
        self.a_moment()
        try:
            return self.driver.read()
        except DriverError as error:
            return str(error)

    def until_it_fails(
        self, part: str, mode: FailureMode, makes_no_sense: Callable[[Sample], bool]
    ) -> list[Sample]:
        """Let a part fail, and return the readings after the failure.

        The list ends when a reading raises an error, or when `makes_no_sense` holds for a reading.
        """
        self.plant.fail(part, mode)
        seen: list[Sample] = []

        def failing() -> bool:
            found = self.patiently()
            if isinstance(found, str):
                return True
            seen.append(found)
            return makes_no_sense(found)

        wait_until(failing, mode)
        return seen


B = TypeVar("B", bound="Bench[Any, Any]")


class Contract(ABC, Generic[B]):
    """A class of tests. Each test has its own bench."""

    @abstractmethod
    def benches(self) -> AbstractContextManager[B]:
        """Yield a bench with an idle device. Bus and driver are not open."""

    @pytest.fixture
    def bench(self) -> Iterator[B]:
        with self.benches() as bench:
            yield bench
            bench.driver.close()

    def test_closing_what_was_never_open_touches_nothing(self, bench: B) -> None:
        bench.driver.close()
        assert bench.relays() == []


@contextmanager
def on_modbus(
    world: RealTime,
    far_sides: Sequence[FarSide],
    serial: modbus.Serial | None = None,
    timeout_s: float = TIMEOUT_S,
) -> Iterator[tuple[modbus.ModbusBus, Time]]:
    """Yield a bus to a simulated gateway or serial line with these devices, and the clock of the
    bus."""
    clock = Time()
    server = (
        RtuLine(far_sides, serial, slow_s=2.2 * timeout_s)
        if serial
        else ModbusServer(far_sides, slow_s=1.5 * timeout_s)
    )
    plain = {"type": "modbus", "timeout_s": timeout_s, **server.replace}
    bus = modbus.ModbusBus(msgspec.convert(plain, modbus.ModbusSettings), clock)
    try:
        yield bus, clock
    finally:
        bus.close()
        server.close()
        world.close()


@contextmanager
def on_http(
    world: RealTime, station: HttpStation, timeout_s: float
) -> Iterator[tuple[http.HttpBus, Time]]:
    """Yield a bus to a simulated controller that answers HTTP, and the clock of the bus."""
    clock = Time()
    server = HttpServer([station], "", timeout_s)
    plain = {"type": "http", "timeout_s": timeout_s, **server.replace}
    bus = http.HttpBus(msgspec.convert(plain, http.HttpSettings), clock)
    try:
        yield bus, clock
    finally:
        bus.close()
        server.close()
        world.close()


@contextmanager
def on_mqtt(
    world: RealTime, wirings: Sequence[PlantWiring], points: dict[str, object], timeout_s: float
) -> Iterator[mqtt.MqttBus]:
    """Yield a bus to a real broker with these simulated devices. The bus measures real time."""
    plain: dict[str, object] = {
        "type": "mqtt",
        "host": "x",
        "timeout_s": timeout_s,
        "points": points,
    }
    for wiring in wirings:
        wiring.plant.add_parts(PARTS)
    site = MqttSite(msgspec.convert(plain, mqtt.MqttSettings), wirings)
    bus = mqtt.MqttBus(msgspec.convert(plain | site.replace, mqtt.MqttSettings))
    try:
        yield bus
    finally:
        bus.close()
        site.close()
        world.close()


@contextmanager
def on_pins(world: RealTime, plant: Plant, wires: Sequence[Wire]) -> Iterator[gpio.GpioBus]:
    """Yield a GPIO bus on a simulated header that is wired to this plant."""
    factory = WiredFactory([PlantWiring(plant, wires, gpio.canonical)], lock=world.lock)
    world.on_step.append(factory.show)
    bus = gpio.open_bus(gpio.GpioSettings(), factory)
    try:
        yield bus
    finally:
        bus.close()
        world.close()

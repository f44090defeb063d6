"""Every driver of a lift keeps the same contract."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any, ClassVar

import msgspec

from drivers.hal import gpio, modbus
from drivers.lift.dry_contact import Settings, create, wires
from hal_fakes.gpio import WiredFactory
from hal_fakes.modbus import ModbusServer
from hal_fakes.modbus.rtu import RtuLine
from hal_fakes.plants.lift import LiftPlant
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import Wiring
from tests.drivers.hal.modbus.module import Time
from tests.drivers.lift.contract import QUICK, Bench, LiftContract, WiredLiftContract
from tests.drivers.lift.wirings import inputs, line, whole

TIMEOUT_S = 0.2


class TestDryContactsOnModbus(WiredLiftContract):
    serial: ClassVar[modbus.Serial | None] = None

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = msgspec.convert(whole(inputs=inputs(moving=line(4))), Settings)
        world = RealTime({"lift": LiftPlant("lift", settings, QUICK)})
        plant = world.plants["lift"]
        far_side = [Wiring(plant, wires(settings), modbus.canonical)]
        server = (
            RtuLine(far_side, self.serial, slow_s=2.2 * TIMEOUT_S)
            if self.serial
            else ModbusServer(far_side, slow_s=1.5 * TIMEOUT_S)
        )
        plain = {"type": "modbus", "timeout_s": TIMEOUT_S, **server.replace}
        clock = Time()
        bus = modbus.ModbusBus(msgspec.convert(plain, modbus.Settings), clock)
        try:
            yield Bench(create("lift", settings, bus), plant, clock)
        finally:
            bus.close()
            server.close()
            world.close()


class TestDryContactsOnRs485(TestDryContactsOnModbus):
    serial: ClassVar = modbus.Serial(port="/dev/null", baudrate=57600, parity="none", stopbits=1)


def on_header(part: Any, pins: Iterator[int]) -> Any:
    """The same wiring on pins, taken as they come."""
    if not isinstance(part, dict):
        return part
    if "point" in part:
        pull = {"pull": "down"} if "input" in part["point"] else {}
        return {**part, "point": f"BCM{next(pins)}", **pull}
    return {key: on_header(value, pins) for key, value in part.items()}


class TestDryContactsOnGpio(LiftContract):
    @contextmanager
    def benches(self) -> Iterator[Bench]:
        plain = on_header(whole(inputs=inputs(moving=line(4))), count(4))
        settings = msgspec.convert(plain, Settings)
        world = RealTime({"lift": LiftPlant("lift", settings, QUICK)})
        plant = world.plants["lift"]
        factory = WiredFactory([Wiring(plant, wires(settings), gpio.canonical)], lock=world.lock)
        world.on_step.append(factory.show)
        bus = gpio.open_bus(gpio.Settings(), factory)
        try:
            yield Bench(create("lift", settings, bus), plant)
        finally:
            bus.close()
            world.close()

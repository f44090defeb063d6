"""Every driver of a door keeps the same contract."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import msgspec

from drivers.door import dry_contact as door_dry_contact
from drivers.door import register as door_register
from drivers.hal import gpio, modbus
from hal_fakes.gpio import WiredFactory
from hal_fakes.modbus import ModbusServer
from hal_fakes.modbus.register_door import RegisterDoor, contacts
from hal_fakes.modbus.rtu import RtuLine
from hal_fakes.modbus.units import FarSide
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import Wiring
from tests.drivers.door.contract import Bench, DoorContract, WiredDoorContract, quick
from tests.drivers.hal.modbus.module import Time

TIMEOUT_S = 0.2
RS485 = modbus.Serial(port="/dev/null", baudrate=57600, parity="none", stopbits=1)


def dry(
    points: tuple[str, str, str], flash: dict[str, str] | None = None, **pull: str
) -> door_dry_contact.Settings:
    """A door on contacts at these points: opened, closed, hold."""
    opened, closed, hold = points
    pulse = {"pulse": {"on_s": 300.0, "every_s": 600.0}} if flash else {}
    plain = {
        "inputs": {
            "opened": {"point": opened, "active": "high", **pull},
            "closed": {"point": closed, "active": "high", **pull},
        },
        "outputs": {"hold_open": {"point": hold, "active": "high", **(flash or {})}},
        **pulse,
    }
    return msgspec.convert(plain, door_dry_contact.Settings)


@contextmanager
def served(
    far_sides: Iterable[FarSide],
    world: RealTime,
    create: Any,
    settings: Any,
    serial: modbus.Serial | None,
) -> Iterator[Bench]:
    """A bench in front of a Modbus server, or a line, with these far sides."""
    clock = Time()
    server = (
        RtuLine(far_sides, serial, slow_s=2.2 * TIMEOUT_S)
        if serial
        else ModbusServer(far_sides, slow_s=1.5 * TIMEOUT_S)
    )
    plain = {"type": "modbus", "timeout_s": TIMEOUT_S, **server.replace}
    bus = modbus.ModbusBus(msgspec.convert(plain, modbus.Settings), clock)
    try:
        yield Bench(create("door", settings, bus), world.plants["door"], clock)
    finally:
        bus.close()
        server.close()
        world.close()


class TestDryContactsOnModbus(WiredDoorContract):
    flash: ClassVar[dict[str, str]] = {}
    serial: ClassVar[modbus.Serial | None] = None

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        points = ("unit 1 discrete input 0", "unit 1 discrete input 1", "unit 1 coil 0")
        settings = dry(points, self.flash)
        wires = door_dry_contact.wires(settings)
        world = RealTime({"door": quick("door", wires)})
        wiring = Wiring(world.plants["door"], wires, modbus.canonical)
        with served([wiring], world, door_dry_contact.create, settings, self.serial) as bench:
            yield bench


class TestDryContactsOnRs485(TestDryContactsOnModbus):
    serial: ClassVar = RS485


class TestAPulseThatTheModuleTimes(TestDryContactsOnModbus):
    flash: ClassVar = {"flash": "unit 1 coil 0x200"}


class TestAPulseThatTheModuleTimesOnRs485(TestAPulseThatTheModuleTimes):
    serial: ClassVar = RS485


class TestDryContactsOnGpio(DoorContract):
    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = dry(("BCM9", "BCM10", "BCM17"), pull="down")
        wires = door_dry_contact.wires(settings)
        world = RealTime({"door": quick("door", wires)})
        plant = world.plants["door"]
        factory = WiredFactory([Wiring(plant, wires, gpio.canonical)], lock=world.lock)
        world.on_step.append(factory.show)
        bus = gpio.open_bus(gpio.Settings(), factory)
        try:
            yield Bench(door_dry_contact.create("door", settings, bus), plant)
        finally:
            bus.close()
            world.close()


class RegisterContract(WiredDoorContract):
    """Doors on registers, by their settings."""

    settings: ClassVar[dict[str, Any]]
    serial: ClassVar[modbus.Serial | None] = None

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = msgspec.convert(self.settings, door_register.Settings)
        world = RealTime({"door": quick("door", contacts(settings))})
        door = RegisterDoor(world.plants["door"], settings)
        with served([door], world, door_register.create, settings, self.serial) as bench:
            yield bench


class TestTheGenericRegisterDoor(RegisterContract):
    settings: ClassVar = {"unit": 1, "profile": "generic-register-door", "base_address": 0x200}


class TestTheGenericRegisterDoorOnRs485(TestTheGenericRegisterDoor):
    serial: ClassVar = RS485


class TestTheGenericRegisterDoorWithAnotherCommand(RegisterContract):
    settings: ClassVar = {
        "unit": 1,
        "profile": "generic-register-door",
        "changes": {"command": {"at": "coil 4", "hold": 1, "release": 0}},
    }


class TestARegisterDoorThatIsCommandedByACoil(RegisterContract):
    settings: ClassVar = {
        "unit": 7,
        "map": {
            "status": {"at": "holding register 16", "closed": [1], "moving": [2], "open": [3]},
            "command": {"at": "coil 4", "hold": 1, "release": 0},
        },
    }


class TestARegisterDoorWhoseCommandCannotBeReadBack(RegisterContract):
    settings: ClassVar = {
        "unit": 1,
        "map": {
            "status": {"at": "input register 0", "closed": [0], "moving": [1], "open": [9]},
            "command": {"at": "holding register 3", "hold": 7, "release": 2, "read_back": False},
        },
    }

"""The contract of doors, tried with every driver."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import msgspec

from drivers.door import dry_contact as door_dry_contact
from drivers.door import register as door_register
from drivers.hal import modbus
from drivers.hal.mqtt import MqttBus
from hal_fakes.modbus.register_door import FakeRegisterDoor, contacts
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.drivers.benches import RS485, TIMEOUT_S, on_modbus, on_mqtt, on_pins
from tests.drivers.door.contract import Bench, DoorContract, WiredDoorContract, quick


def dry(
    points: tuple[str, str, str], flash: dict[str, str] | None = None, **pull: str
) -> door_dry_contact.DryContactDoorSettings:
    """Return a door on contacts. `points` has the points of opened, closed and hold."""
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
    return msgspec.convert(plain, door_dry_contact.DryContactDoorSettings)


class TestDryContactsOnModbus(WiredDoorContract):
    flash: ClassVar[dict[str, str]] = {}
    serial: ClassVar[modbus.Serial | None] = None

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        points = ("unit 1 discrete input 0", "unit 1 discrete input 1", "unit 1 coil 0")
        settings = dry(points, self.flash)
        wires = door_dry_contact.wires(settings)
        world = RealTime({"door": quick("door", wires)})
        wiring = PlantWiring(world.plants["door"], wires, modbus.canonical)
        with on_modbus(world, [wiring], self.serial) as (bus, clock):
            yield Bench(door_dry_contact.create("door", settings, bus), wiring.plant, clock)


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
        with on_pins(world, plant, wires) as bus:
            yield Bench(door_dry_contact.create("door", settings, bus), plant)


class MqttBench(Bench):
    """A bench whose bus measures real time. So `a_moment` asks the bus to end its pause after a
    failure."""

    bus: MqttBus

    def a_moment(self) -> None:
        self.bus.insist()


class TestDryContactsOnMqtt(WiredDoorContract):
    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = dry(("opened", "closed", "hold"))
        wires = door_dry_contact.wires(settings)
        world = RealTime({"door": quick("door", wires)})
        wiring = PlantWiring(world.plants["door"], wires, str)
        shelly = {"profile": "shelly-gen2", "device": "door", "stale_after_s": 1}
        points: dict[str, object] = {
            "opened": {**shelly, "part": "input:0"},
            "closed": {**shelly, "part": "input:1"},
            "hold": {**shelly, "part": "switch:0", "switches_off_after_s": 60},
        }
        with on_mqtt(world, [wiring], points, TIMEOUT_S) as bus:
            bench = MqttBench(door_dry_contact.create("door", settings, bus), wiring.plant)
            bench.bus = bus
            yield bench


class RegisterContract(WiredDoorContract):
    """The contract for a door on registers. Each subclass has its own settings."""

    settings: ClassVar[dict[str, Any]]
    serial: ClassVar[modbus.Serial | None] = None

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = msgspec.convert(self.settings, door_register.RegisterDoorSettings)
        world = RealTime({"door": quick("door", contacts(settings))})
        door = FakeRegisterDoor(world.plants["door"], settings)
        with on_modbus(world, [door], self.serial) as (bus, clock):
            yield Bench(door_register.create("door", settings, bus), door.plant, clock)


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

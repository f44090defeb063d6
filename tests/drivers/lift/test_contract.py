"""The contract tests of lifts, run with every driver and bus."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any, ClassVar

import msgspec

from drivers.hal import modbus
from drivers.hal.mqtt import MqttBus
from drivers.hal.points import Wire
from drivers.lift import register
from drivers.lift.dry_contact import DryContactLiftSettings, create, wires
from hal_fakes.modbus import register_lift
from hal_fakes.plants.lift import LiftPlant
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.drivers.benches import RS485, TIMEOUT_S, on_modbus, on_mqtt, on_pins
from tests.drivers.lift.contract import QUICK, Bench, LiftContract, WiredLiftContract
from tests.drivers.lift.wirings import FLOORS, inputs, line, whole


class TestDryContactsOnModbus(WiredLiftContract):
    serial: ClassVar[modbus.Serial | None] = None

    def wired(self) -> dict[str, Any]:
        """Return the wiring as a YAML file has it."""
        return whole(inputs=inputs(moving=line(4)))

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = msgspec.convert(self.wired(), DryContactLiftSettings)
        world = RealTime({"lift": LiftPlant("lift", settings, QUICK)})
        wiring = PlantWiring(world.plants["lift"], wires(settings), modbus.canonical)
        with on_modbus(world, [wiring], self.serial) as (bus, clock):
            yield Bench(create("lift", settings, bus), wiring.plant, clock)


class MqttBench(Bench):
    """A bench whose bus measures its pauses in real time. So a test ends a pause with `insist`."""

    bus: MqttBus

    def a_moment(self) -> None:
        self.bus.insist()


class TestWordsOnMqtt(WiredLiftContract):
    """A gateway that publishes all signals as words in one JSON object. It also gets commands as
    words."""

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        plain = on_topics(whole(inputs=inputs(moving=line(4))), [])
        settings = msgspec.convert(plain, DryContactLiftSettings)
        points: dict[str, object] = {wire.point: _point(wire) for wire in wires(settings)}
        world = RealTime({"lift": LiftPlant("lift", settings, QUICK)})
        wiring = PlantWiring(world.plants["lift"], wires(settings), str)
        with on_mqtt(world, [wiring], points, TIMEOUT_S) as bus:
            bench = MqttBench(create("lift", settings, bus), wiring.plant)
            bench.bus = bus
            yield bench


LANDINGS = ("floor_B1", "floor_G", "floor_1")


def _point(wire: Wire) -> dict[str, object]:
    found: dict[str, object] = {"topic": "lift/state", "field": wire.signal, "stale_after_s": 1}
    found["ask"] = {"topic": "lift/ask"}
    if wire.signal in LANDINGS:
        others = [signal for signal in LANDINGS if signal != wire.signal]
        found |= {"field": "floor", "when": [wire.signal], "when_not": [*others, "between"]}
    if wire.direction == "out":
        command = {
            "topic": "lift/do",
            "payload_on": f"{wire.signal} on",
            "payload_off": f"{wire.signal} off",
        }
        found |= {"command": command, "switches_off_after_s": 60}
    return found


def on_topics(part: Any, names: list[str]) -> Any:
    """Return this part of a wiring with a name in place of each point. Append each name to `names`."""
    if not isinstance(part, dict):
        return part
    if "point" in part:
        names.append(f"point {len(names)}")
        return {**part, "point": names[-1]}
    return {key: on_topics(value, names) for key, value in part.items()}


def number(register: int, codes: dict[int, str], **more: Any) -> dict[str, Any]:
    return {"at": f"input register {register}", "codes": codes, **more}


def flag(register: int, bit: int, active: str = "high") -> dict[str, Any]:
    return {"at": f"input register {register}", "bit": bit, "active": active}


def word(on: int) -> dict[str, Any]:
    return {"at": "holding register 10", "ask": on, "release": 0}


NUMBERS: dict[str, Any] = {
    "floor": number(0, {1: "B1", 2: "G", 4: "1"}, between_floors=[0], bits=[0, 1, 2]),
    "motion": number(0, {0: "stopped", 1: "moving"}, bits=[8]),
    "door": number(1, {10: "open", 20: "closed", 30: "moving"}),
    "agv_mode": flag(2, 0),
    "fire_alarm": flag(2, 15, "low"),
}
ONE_WORD = {"agv_mode_request": word(1), "door_open": word(2)}
CALLS = {"at": "holding register 11", "codes": {1: "B1", 2: "G", 3: "1"}, "none": 9}
COILS = {"agv_mode_request": {"at": "coil 0"}, "door_open": {"at": "coil 1"}}


class TestRegistersWithCallsAsNumbers(WiredLiftContract):
    commands: ClassVar[dict[str, Any]] = {**ONE_WORD, "call": CALLS}

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        plain = {"floors": FLOORS, "unit": 3, "map": {**NUMBERS, "commands": self.commands}}
        settings = msgspec.convert(plain, register.RegisterLiftSettings)
        assert list(settings.problems()) == []
        world = RealTime({"lift": register_lift.build("lift", settings, QUICK)})
        far_side = register_lift.FakeRegisterLift(world.plants["lift"], settings)
        with on_modbus(world, [far_side]) as (bus, clock):
            yield Bench(register.create("lift", settings, bus), far_side.plant, clock)


class TestRegistersWithCallsInOneWord(TestRegistersWithCallsAsNumbers):
    commands: ClassVar = {
        **ONE_WORD,
        "calls": {level: word(16 << i) for i, level in enumerate(FLOORS)},
    }


class TestRegistersWithCoils(TestRegistersWithCallsAsNumbers):
    commands: ClassVar = {
        **COILS,
        "calls": {level: {"at": f"coil {4 + i}"} for i, level in enumerate(FLOORS)},
    }


class TestRegistersThatCannotBeReadBack(TestRegistersWithCallsAsNumbers):
    commands: ClassVar = {**ONE_WORD, "call": CALLS, "read_back": False}


class TestDryContactsOnRs485(TestDryContactsOnModbus):
    serial: ClassVar = RS485


def in_registers(part: Any) -> Any:
    """Return this part of a wiring, with a bit of a gateway's register in place of each contact."""
    if not isinstance(part, dict):
        return part
    if "point" in part and "discrete input" in part["point"]:
        place, number = part["point"].split("discrete input ")
        register, bit = divmod(int(number), 4)
        return {**part, "point": f"{place}holding {40 + register} bit {bit}"}
    return {key: in_registers(value) for key, value in part.items()}


class TestContactsAsBitsOfRegisters(TestDryContactsOnModbus):
    def wired(self) -> dict[str, Any]:
        found = in_registers(super().wired())
        assert isinstance(found, dict)
        return found


def on_header(part: Any, pins: Iterator[int]) -> Any:
    """Return this part of a wiring, with the next GPIO pin of `pins` in place of each point."""
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
        settings = msgspec.convert(plain, DryContactLiftSettings)
        world = RealTime({"lift": LiftPlant("lift", settings, QUICK)})
        plant = world.plants["lift"]
        with on_pins(world, plant, wires(settings)) as bus:
            yield Bench(create("lift", settings, bus), plant)


def contact(number: int, active: str = "high") -> dict[str, Any]:
    return {"at": f"discrete input {number}", "unit": 4, "active": active}


class TestRegistersBesideContacts(TestRegistersWithCallsAsNumbers):
    """A lift on two units. The gateway (unit 3) has the floor as a number, and has AGV mode and the
    calls. The module (unit 4) has the contacts and the other commands."""

    serial: ClassVar[modbus.Serial | None] = None

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        found = {
            "floor": NUMBERS["floor"],
            "agv_mode": NUMBERS["agv_mode"],
            "moving": contact(0),
            "door_opened": contact(1),
            "door_closed": contact(2),
            "fire_alarm": contact(3, "low"),
        }
        coils = {name: {**coil, "unit": 4} for name, coil in COILS.items()}
        plain = {
            "floors": FLOORS,
            "unit": 3,
            "map": {**found, "commands": {**coils, "call": CALLS}},
        }
        settings = msgspec.convert(plain, register.RegisterLiftSettings)
        assert list(settings.problems()) == []
        world = RealTime({"lift": register_lift.build("lift", settings, QUICK)})
        far_side = register_lift.FakeRegisterLift(world.plants["lift"], settings)
        with on_modbus(world, [far_side], self.serial) as (bus, clock):
            yield Bench(register.create("lift", settings, bus), far_side.plant, clock)


class TestRegistersBesideContactsOnRs485(TestRegistersBesideContacts):
    serial: ClassVar = RS485

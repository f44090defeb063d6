"""The contract of dispensers and ingestors, tried with every driver."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import msgspec
import pytest

from bridges.kinds.dispenser.signals import Item, WorkcellOutputs, WorkcellSample
from drivers import DriverError
from drivers.dispenser import dry_contact, http, register
from drivers.hal import modbus
from hal_fakes.http_dispenser import FakeHttpWorkcell
from hal_fakes.http_flags import PARTS, contacts, flags
from hal_fakes.modbus.register_dispenser import FakeRegisterWorkcell
from hal_fakes.modbus.register_dispenser import contacts as register_contacts
from hal_fakes.plants import dispenser
from hal_fakes.plants.dispenser import WorkcellPlant
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.drivers.benches import TIMEOUT_S, on_http, on_modbus, on_pins
from tests.drivers.dispenser.contract import RUN, Bench, WiredWorkcellContract, WorkcellContract


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dispenser, "CYCLE_S", 0.05)


def dry(inputs: tuple[str, str, str], outputs: tuple[str, str], **pull: str) -> Any:
    """Return a workcell on contacts. `inputs` has the points of done, busy and fault. `outputs` has the
    points of start and of the item `box`."""
    signals = dict(zip(("done", "busy", "fault"), inputs, strict=True))
    plain = {
        "items": {"box": {}},
        "accept_unsafe": {"fault": "a test"},
        "inputs": {s: {"point": at, "active": "high", **pull} for s, at in signals.items()},
        "outputs": {
            "start": {"point": outputs[0], "active": "high"},
            "select": {"box": {"point": outputs[1], "active": "high"}},
        },
    }
    return msgspec.convert(plain, dry_contact.DryContactWorkcellSettings)


class TestDryContactsOnModbus(WiredWorkcellContract):
    @contextmanager
    def benches(self) -> Iterator[Bench]:
        inputs = tuple(f"unit 1 discrete input {n}" for n in range(3))
        settings = dry(inputs, ("unit 1 coil 0", "unit 1 coil 1"))  # type: ignore[arg-type]
        wires = dry_contact.wires(settings)
        world = RealTime({"cell": WorkcellPlant("cell", wires, steady=True)})
        wiring = PlantWiring(world.plants["cell"], wires, modbus.canonical)
        with on_modbus(world, [wiring]) as (bus, clock):
            yield Bench(dry_contact.create("cell", settings, bus), wiring.plant, clock)


class TestDryContactsOnGpio(WorkcellContract):
    @contextmanager
    def benches(self) -> Iterator[Bench]:
        settings = dry(("BCM9", "BCM10", "BCM11"), ("BCM17", "BCM18"), pull="down")
        wires = dry_contact.wires(settings)
        world = RealTime({"cell": WorkcellPlant("cell", wires, steady=True)})
        plant = world.plants["cell"]
        with on_pins(world, plant, wires) as bus:
            yield Bench(dry_contact.create("cell", settings, bus), plant)


REGISTERS = {
    "unit": 1,
    "items": {"box": {"most": 3, "compartments": ["left", "right"]}},
    "map": {
        "status": {
            "at": "input register 0",
            "ready": [1],
            "busy": [2],
            "done": [3],
            "waits": [4],
            "faults": {"9": "jam"},
        },
        "command": {"at": "holding register 0", "start": 7, "rest": 0},
        "item": {"at": "holding register 1", "codes": {"box": 5}},
        "quantity": {"at": "holding register 2"},
        "compartment": {"at": "holding register 3", "codes": {"left": 1, "right": 2}},
    },
}


class TestRegisters(WiredWorkcellContract):
    settings: ClassVar = msgspec.convert(REGISTERS, register.RegisterWorkcellSettings, strict=False)

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        plant = WorkcellPlant("cell", register_contacts(self.settings), steady=True)
        world = RealTime({"cell": plant})
        self.cell = FakeRegisterWorkcell(plant, self.settings)
        with on_modbus(world, [self.cell]) as (bus, clock):
            yield Bench(register.create("cell", self.settings, bus), plant, clock)

    def test_the_item_is_written_before_the_start_and_the_rest_before_the_next_item(
        self, bench: Bench
    ) -> None:
        written: list[tuple[str, int]] = []
        take = self.cell.set

        def noted(point: Any, value: int, now: float) -> bool:
            written.append((f"{point.table} {point.address}", value))
            return take(point, value, now)

        self.cell.set = noted  # type: ignore[method-assign]
        bench.open()
        written.clear()
        bench.write(WorkcellOutputs(True, "task", Item("box", 2, "right")))
        assert written[-1] == ("holding register 0", 7)
        assert set(written[:-1]) == {
            ("holding register 1", 5),
            ("holding register 2", 2),
            ("holding register 3", 2),
        }
        written.clear()
        bench.write(WorkcellOutputs())
        assert written[0] == ("holding register 0", 0)

    def test_an_unlisted_status_is_a_fault(self) -> None:
        assert register.decode(self.settings.map, 77) == WorkcellSample(
            done=False, busy=False, ready=False, errors=("status 77 is not in the map",)
        )
        assert register.decode(self.settings.map, 9).errors == ("jam",)


HTTP = {
    "items": {"box": {"most": 3}},
    "state_path": "/state",
    "inputs": {
        "done": {"field": "phase", "when": ["done"]},
        "busy": {"field": "phase", "when": ["moving"]},
        "ready": {"field": "phase", "when": ["idle"]},
        "fault": {"field": "error"},
    },
    "start": {"path": "/take", "body": '{"id": "$guid", "n": "$quantity", "what": ["$type_guid"]}'},
    "stop": {"path": "/stop"},
}


class TestHttp(WiredWorkcellContract):
    settings: ClassVar = msgspec.convert(HTTP, http.HttpWorkcellSettings)

    @contextmanager
    def benches(self) -> Iterator[Bench]:
        wires = contacts(flags(self.settings.inputs), "start")
        plant = WorkcellPlant("cell", wires, steady=True, parts=PARTS)
        world = RealTime({"cell": plant})
        with on_http(world, FakeHttpWorkcell(plant, self.settings), TIMEOUT_S) as (bus, clock):
            yield Bench(http.create("cell", self.settings, bus), plant, clock)

    def test_a_start_whose_answer_is_lost_is_not_sent_again(self, bench: Bench) -> None:
        bench.open()
        assert isinstance(bench.driver, http.HttpWorkcell)
        bus = bench.driver._bus
        send = bus.send

        def unanswered(*arguments: Any, **named: Any) -> None:
            send(*arguments, **named)
            raise DriverError("the answer is lost")

        bus.send = unanswered  # type: ignore[method-assign]
        with pytest.raises(DriverError):
            bench.driver.write(RUN)
        bus.send = send  # type: ignore[method-assign]
        for _ in range(3):
            bench.write(RUN)
        assert bench.starts() == [True]

    @pytest.mark.parametrize("signal", ["busy", "fault"])
    def test_an_input_that_is_null_gives_no_reading(self, signal: str) -> None:
        """Null would hide a fault, and would end a cycle that still runs."""
        fields = {one: place.field for one, place in flags(self.settings.inputs).items()}
        answer: dict[str, object] = dict.fromkeys(fields.values(), True)
        answer[fields[signal]] = None

        class Answers:
            def get_json(self, path: str) -> dict[str, object]:
                return answer

        driver = http.create("cell", self.settings, Answers())  # type: ignore[arg-type]
        with pytest.raises(DriverError, match="is null, and yes or no is expected"):
            driver.read()

    def test_the_request_takes_the_place_of_the_marks_and_cannot_leave_its_text(self) -> None:
        nasty = Item('box", "n": 99', 2)
        call = http.filled(self.settings.start, WorkcellOutputs(True, '"}', nasty))
        assert msgspec.json.decode(call.body or "") == {
            "id": '"}',
            "n": 2,
            "what": ['box", "n": 99'],
        }

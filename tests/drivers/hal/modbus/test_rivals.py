"""A second Modbus master that writes the same coil as our bus.

The error names the second master. While the second master writes, our bus writes "on" more rarely. Our
bus still writes "off" at once.
"""

import itertools
import struct
from collections.abc import Iterator

import msgspec
import pytest

from bridges.kinds.door import core
from bridges.kinds.door.memory import DoorLimits, DoorMemory
from bridges.kinds.door.signals import DoorOutputs, OpenRequested
from bridges.kinds.shared.decision import IoFailed, Sampled, WriteFailed
from drivers import DriverError
from drivers.door.dry_contact import DryContactDoorSettings, create
from tests.drivers.hal.modbus.module import Module, Time, bus_to

DOOR = msgspec.convert(
    {
        "inputs": {
            "opened": {"point": "unit 1 discrete input 0", "active": "high"},
            "closed": {"point": "unit 1 discrete input 1", "active": "high"},
        },
        "outputs": {"hold_open": {"point": "unit 1 coil 0", "active": "high"}},
    },
    DryContactDoorSettings,
)
SCAN_S = 0.1
NAMED = "another master writes unit 1 coil 0 too: its readings contradict the written values"


class Door:
    """A door that the test scans as the daemon's loop does. A second master may write after each
    scan."""

    def __init__(self, module: Module) -> None:
        module.inputs.update({(1, 0): False, (1, 1): True})
        module.coils.update({(1, 0): False})
        self.module = module
        self.clock = Time()
        self.driver = create("front", DOOR, bus_to(module.port, self.clock))
        self.limits = DoorLimits()
        self.memory: DoorMemory = core.initial(self.limits, 0.0)
        self.rival: bool | None = None
        self.faults: list[str] = []
        self.driver.open()

    def decide(self, event: object) -> DoorOutputs:
        decision = core.decide(self.memory, event, self.clock.now, self.limits)  # type: ignore[arg-type]
        self.memory = decision.memory
        return decision.outputs

    def scan(self) -> str:
        """Run one scan. Return its error, or "" without an error."""
        fault = ""
        try:
            outputs = self.decide(Sampled(self.driver.read()))
        except DriverError as error:
            fault = str(error)
            outputs = self.decide(IoFailed(fault))
        try:
            self.driver.write(outputs)
        except DriverError as error:
            fault = str(error)
            self.decide(WriteFailed(fault))
        if self.rival is not None:
            self.module.coils[1, 0] = self.rival
        self.clock.now += SCAN_S
        return fault

    def scans(self, for_s: float) -> list[str]:
        return [self.scan() for _ in range(round(for_s / SCAN_S))]

    def written(self) -> list[int]:
        """Return the values that were written to the coil since the last call."""
        asked = [request for request in self.module.asked if request[7] == 5]
        self.module.asked.clear()
        return [struct.unpack(">H", request[10:12])[0] >> 8 & 1 for request in asked]


@pytest.fixture
def door() -> Iterator[Door]:
    module = Module()
    made = Door(module)
    made.scan()
    made.decide(OpenRequested("robot"))
    made.scan()
    assert made.module.coils[1, 0]
    made.written()
    yield made
    made.driver.close()
    module.close()


def test_another_master_that_switches_our_relay_off_is_a_fault_by_that_name(door: Door) -> None:
    door.rival = False
    faults = door.scans(120.0)
    named = [fault.startswith(NAMED) for fault in faults]
    assert named.count(True) > 0.95 * len(named)
    assert faults[-1].endswith("the next write is after 30 s")


def test_against_another_master_we_switch_on_once_a_second_and_then_less_often(
    door: Door,
) -> None:
    door.rival = False
    ons = []
    for scan in range(700):
        door.scan()
        ons += [scan * SCAN_S] * door.written().count(1)
    gaps = [round(later - before) for before, later in itertools.pairwise(ons)]
    assert gaps == [1, 2, 4, 8, 16, 30]


def test_against_another_master_off_is_written_at_once_and_as_often_as_it_takes(door: Door) -> None:
    door.rival = True
    door.memory = core.initial(door.limits, door.clock.now)
    faults = door.scans(2.0)
    assert door.written() == [0] * 20
    assert [fault.startswith(NAMED) for fault in faults[5:]] == [True] * 15


def test_a_stop_is_written_during_a_pause(door: Door) -> None:
    door.rival = False
    door.scans(3.0)
    door.rival = None
    door.module.coils[1, 0] = True
    door.driver.make_safe()
    assert door.module.coils[1, 0] is False


def test_when_the_other_master_has_gone_the_relay_is_ours_again(door: Door) -> None:
    door.rival = False
    door.scans(3.0)
    door.rival = None
    door.scans(7.0)
    assert door.scans(1.0) == [""] * 10
    assert door.module.coils[1, 0]


def test_a_module_that_restarts_once_is_written_again_at_once(door: Door) -> None:
    door.module.coils[1, 0] = False
    first, *others = door.scans(1.0)
    assert "reads 0 after 1 was written: the module has restarted" in first
    assert others == [""] * 9
    assert door.written() == [1]

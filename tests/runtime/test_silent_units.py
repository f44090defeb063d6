"""Silent devices among live devices. From the first round on, silent devices delay a live device by one
timeout at most."""

from collections.abc import Iterator
from itertools import groupby, pairwise
from pathlib import Path

import pytest

from bridges.runtime.service import service
from bridges.runtime.serving import stop
from bridges.settings.load import load
from tests.depth import depth
from tests.drivers.hal.modbus.line import SerialModule
from tests.drivers.hal.modbus.module import Module, door
from tests.runtime.corridor import SCAN_S, Corridor
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.waiting import wait_until

TIMEOUT_S = 0.3
SILENT = [f"silent{i}" for i in range(30)]


def corridor(*names: str) -> Corridor:
    """Return a corridor. The live doors are in the middle of the silent doors."""
    made = Corridor(doors=[*SILENT[:15], *names, *SILENT[15:]])
    for name in SILENT:
        made.falls_silent(name, TIMEOUT_S)
    return made


def served(corridor: Corridor, until: float) -> None:
    """Run all rounds that the service's thread would run until this time (s)."""
    while corridor.now < until:
        corridor.round(max(corridor.now, corridor.loop.wake_at))


def read_at(corridor: Corridor, door: str) -> list[float]:
    return [at for at, what in corridor.story if what == f"{door} read"]


def test_the_reading_of_a_live_door_is_never_older_than_its_period_and_one_timeout() -> None:
    among = corridor("ward", "lab")
    served(among, 60.0)
    for name in ("ward", "lab"):
        ages = [later - earlier for earlier, later in pairwise(read_at(among, name))]
        assert max(ages) <= SCAN_S + TIMEOUT_S + 1e-9


def test_silent_doors_take_turns_and_each_has_been_asked_once_before_one_is_asked_again() -> None:
    among = corridor("ward")
    served(among, 30 * TIMEOUT_S)
    asked = [what.removesuffix(" read") for _, what in among.story if what.startswith("silent")]
    tries = [name for name in asked if "claimed" not in name]
    assert tries[:30] == SILENT


def test_a_request_to_a_silent_door_waits_for_its_turn_and_is_not_lost() -> None:
    among = corridor("ward")
    among.round(0.0)
    among.asks("silent29")
    among.doors["silent29"].during = lambda: None
    served(among, 30 * TIMEOUT_S)
    assert "silent29 held" in [what for _, what in among.story]


def test_doors_that_fall_silent_together_are_found_one_in_a_round() -> None:
    """After each silent door the loop reads the door `ward`."""
    falling = Corridor(doors=["ward", *SILENT])
    served(falling, 1.0)
    for name in SILENT:
        falling.falls_silent(name, TIMEOUT_S)
    served(falling, 30.0)
    ages = [later - earlier for earlier, later in pairwise(read_at(falling, "ward"))]
    assert max(ages) <= SCAN_S + TIMEOUT_S + 1e-9


def test_at_the_end_those_that_answer_are_switched_off_first() -> None:
    among = corridor("ward", "lab")
    served(among, 30.0)
    before = len(among.story)
    among.loop.end()
    off = [what for _, what in among.story[before:] if what.endswith(" off")]
    assert off[:2] == ["ward off", "lab off"]


BUSES = {
    Module: "tcp: {{host: 127.0.0.1, port: {port}}}",
    SerialModule: "serial: {{port: {port}, baudrate: 115200, parity: none, stopbits: 1}}",
}
YAML = """
kind: door
driver: dry_contact
rmf: {{transport: dds, network: localhost, domain_id: 0}}
buses:
  line: {{type: modbus, {place}, timeout_s: 0.5, retries: 0, scan_s: 0.02}}
doors:
"""
DOOR = """
  door{unit}:
    inputs:
      opened: {{point: "unit {unit} discrete input 0", active: high}}
      closed: {{point: "unit {unit} discrete input 1", active: high}}
    outputs:
      hold_open: {{point: "unit {unit} coil 0", active: high}}
"""


@pytest.fixture(
    params=[(Module, depth(8, 30)), (SerialModule, depth(8, 16))], ids=["on tcp", "on rtu"]
)
def line(request: pytest.FixtureRequest) -> Iterator[tuple[Module, int]]:
    """Yield a module with one live unit, and the number of silent units on its bus."""
    make, silent = request.param
    module: Module = make()
    module.units.clear()
    door(module, silent // 2)
    yield module, silent
    module.close()


@pytest.mark.long(20)
def test_on_a_real_bus_a_live_unit_is_asked_between_any_two_silent_ones(
    line: tuple[Module, int], tmp_path: Path
) -> None:
    module, silent = line
    units = range(1, silent + 2)
    live = silent // 2
    file = tmp_path / "corridor.yaml"
    place = BUSES[type(module)].format(port=module.port)
    file.write_text(YAML.format(place=place) + "".join(DOOR.format(unit=u) for u in units))
    config = load(file)
    corridor = service(config, MemoryTransport(MemoryNetwork(), "doors"), config.open_bus)
    (loop,) = corridor.loops
    loop.start()
    wait_until(lambda: len({*module.units_asked()}) > silent, "each unit has been asked")
    wait_until(lambda: loop.ready, "each door has published a state")
    asked = module.units_asked()
    assert not stop([loop], 30.0), "silent units were verified off"
    since_it_answered = [unit for unit, _ in groupby(asked[asked.index(live) :])]
    assert since_it_answered[::2] == [live] * len(since_it_answered[::2])
    assert [unit for unit, _ in groupby(asked) if unit != live][:silent] == [
        unit for unit in units if unit != live
    ]

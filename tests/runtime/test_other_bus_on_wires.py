"""Doors of which one has an input on another bus than the door itself. Buses and threads are real. The
doors' bus is Modbus TCP. The other bus is Modbus TCP too, or the pins of a GPIO header.

The fire contact is in a separate panel, so the panel's module can fail alone. A second door on the same
gateway has no input at the panel.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest

from bridges.messages.definitions import DoorMode, DoorModeValue, DoorRequest, DoorState
from bridges.messages.topics import DOOR_REQUESTS, DOOR_STATES
from bridges.runtime.service import service
from bridges.runtime.serving import stop
from bridges.runtime.switch_off import outputs_off
from bridges.settings.load import Config, load
from drivers.hal import Bus, gpio, modbus
from hal_fakes.gpio import WiredFactory
from hal_fakes.modbus import ModbusServer
from hal_fakes.plants.door import DoorPlant
from hal_fakes.plants.plant import FAILURE_MODES, FailureMode
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.waiting import wait_until

YAML: Final = """
kind: door
driver: dry_contact
buses:
  gateway: {type: modbus, tcp: {host: 127.0.0.1}, without_watchdog: {1: a test, 2: a test}}
  panel: PANEL
doors:
  ward:
    bus: gateway
    on_fire: release
    limits: {stale_after_s: 3, hazard_clear_s: 0.2}
    inputs:
      opened: {point: "unit 1 discrete input 0", active: high}
      closed: {point: "unit 1 discrete input 1", active: high}
      fire: {bus: panel, FIRE}
    outputs:
      hold_open: {point: "unit 1 coil 0", active: high}
  lab:
    bus: gateway
    limits: {stale_after_s: 3}
    inputs:
      opened: {point: "unit 2 discrete input 0", active: high}
      closed: {point: "unit 2 discrete input 1", active: high}
    outputs:
      hold_open: {point: "unit 2 coil 0", active: high}
"""
PANELS: Final = {
    "modbus": (
        "{type: modbus, tcp: {host: 127.0.0.2}, timeout_s: 0.2}",
        'point: "unit 7 discrete input 3", active: low',
    ),
    "gpio": ("{type: gpio}", "point: BCM4, active: low, pull: down"),
}


class Site:
    """Two doors, the fire panel, and RMF. `modes` has the modes of each door in order, without
    repetitions."""

    def __init__(self, folder: Path, panel: str, held: ExitStack) -> None:
        bus, fire = PANELS[panel]
        file = folder / "doors.yaml"
        file.write_text(YAML.replace("PANEL", bus).replace("FIRE", fire))
        config = load(file)
        wires = {
            "ward": config.wires_on("gateway", "ward"),
            "lab": config.wires("lab"),
            "panel": config.wires_on("panel", "ward"),
        }
        quick = {"open_s": 0.1, "close_s": 0.1, "auto_close_s": 0.1}
        parts = ("server", "unit")
        self._world = RealTime(
            {name: DoorPlant(name, own, parts=parts, **quick) for name, own in wires.items()}
        )
        self.plants = self._world.plants
        self._wires, self._held = wires, held
        self.modes: dict[str, list[str]] = {"ward": [], "lab": []}
        network = MemoryNetwork()
        rmf = MemoryTransport(network, "rmf")
        rmf.subscribe(DOOR_STATES, self._hear)
        self._requests = rmf.publisher(DOOR_REQUESTS)
        buses = {
            "gateway": self._modbus(config, "gateway", "ward", "lab"),
            "panel": self._pins() if panel == "gpio" else self._modbus(config, "panel", "panel"),
        }
        served = service(config, MemoryTransport(network, "doors"), buses.__getitem__)
        served.subscribe()
        self.loops = dict(zip(config.buses, served.loops, strict=True))
        held.callback(stop, served.loops, 10.0)
        for loop in served.loops:
            loop.start()
        wait_until(lambda: self.are("CLOSED", "CLOSED"), "both doors are in service")

    def _modbus(self, config: Config, bus: str, *plants: str) -> Bus:
        far = [PlantWiring(self.plants[n], self._wires[n], modbus.canonical) for n in plants]
        settings: Any = config.buses[bus]
        server = ModbusServer(far, slow_s=1.5 * settings.timeout_s)
        self._held.callback(server.close)
        plain = {**msgspec.to_builtins(settings), **server.replace}
        return modbus.ModbusBus(msgspec.convert(plain, modbus.ModbusSettings))

    def _pins(self) -> Bus:
        wiring = PlantWiring(self.plants["panel"], self._wires["panel"], gpio.canonical)
        factory = WiredFactory([wiring], lock=self._world.lock)
        self._world.on_step.append(factory.show)
        return gpio.open_bus(gpio.GpioSettings(), factory)

    def close(self) -> None:
        self._world.close()

    def _hear(self, state: DoorState) -> None:
        mode = DoorModeValue(state.current_mode.value).name.removeprefix("MODE_")
        modes = self.modes[state.door_name]
        if modes[-1:] != [mode]:
            modes.append(mode)

    def are(self, *modes: str) -> bool:
        return [*modes] == [seen[-1] if seen else "" for seen in self.modes.values()]

    def hold(self, door: str) -> None:
        mode = DoorMode(DoorModeValue.MODE_OPEN)
        asked = DoorRequest(requester_id="me", door_name=door, requested_mode=mode)
        self._requests.publish(asked)

    def relay(self, door: str) -> list[object]:
        """Return each value to which a door's relay has switched."""
        return [e.value for e in self.plants[door].edges if e.what == "relay"]

    def goes_on(self, bus: str) -> None:
        """Wait until this bus's thread has finished ten more scans or calls."""
        before = self.loops[bus].finished
        wait_until(lambda: self.loops[bus].finished >= before + 10, f"{bus} goes on")

    def held_and_open(self) -> None:
        self.hold("ward")
        wait_until(lambda: self.are("OPEN", "CLOSED"), "the ward's door is open")


@pytest.fixture(params=PANELS)
def site(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Site]:
    with ExitStack() as held:
        made = Site(tmp_path, request.param, held)
        held.callback(made.close)
        yield made


@pytest.fixture
def panel_on_modbus(tmp_path: Path) -> Iterator[Site]:
    with ExitStack() as held:
        made = Site(tmp_path, "modbus", held)
        held.callback(made.close)
        yield made


def test_an_alarm_on_the_other_bus_releases_the_door(site: Site) -> None:
    site.held_and_open()
    site.plants["panel"].press("fire", True, 0.0)
    wait_until(lambda: site.relay("ward") == [True, False], "the alarm releases the door")
    wait_until(lambda: site.are("UNKNOWN", "CLOSED"), "RMF is told")
    site.plants["panel"].press("fire", False, 0.0)
    wait_until(lambda: site.are("CLOSED", "CLOSED"), "the alarm is over")


def test_a_cut_wire_on_the_other_bus_reads_as_an_alarm(site: Site) -> None:
    site.held_and_open()
    site.plants["panel"].fail("fire", "off")
    wait_until(lambda: site.relay("ward") == [True, False], "the cut wire releases the door")


@pytest.mark.parametrize("mode", FAILURE_MODES)
def test_a_failed_other_bus_takes_its_device_out_of_service_and_no_other_and_lets_it_come_back(
    panel_on_modbus: Site, mode: FailureMode
) -> None:
    site = panel_on_modbus
    site.held_and_open()
    site.plants["panel"].fail("server", mode)
    wait_until(lambda: site.are("OFFLINE", "CLOSED"), f"{mode}: the ward's door is out of service")
    assert site.relay("ward") == [True, False]
    site.goes_on("gateway")
    site.hold("lab")
    wait_until(lambda: site.are("OFFLINE", "OPEN"), "the lab's door is in service")
    site.plants["panel"].fail("server", None)
    wait_until(lambda: site.are("OPEN", "OPEN"), "the hold of RMF is back")
    assert "OFFLINE" not in site.modes["lab"]


@pytest.mark.parametrize("mode", FAILURE_MODES)
def test_a_failed_own_bus_does_not_keep_the_other_bus_from_being_read(
    panel_on_modbus: Site, mode: FailureMode
) -> None:
    site = panel_on_modbus
    site.plants["ward"].fail("server", mode)
    wait_until(lambda: site.are("OFFLINE", "OFFLINE"), f"{mode}: the gateway is lost")
    site.goes_on("panel")
    site.plants["ward"].fail("server", None)
    wait_until(lambda: site.are("CLOSED", "CLOSED"), "both are back")


def test_outputs_off_needs_the_own_bus_alone(tmp_path: Path) -> None:
    """Nobody listens at the panel's address. The command does not even open the panel's bus."""
    bus, fire = PANELS["modbus"]
    file = tmp_path / "doors.yaml"
    file.write_text(YAML.replace("PANEL", bus).replace("FIRE", fire))
    config = load(file)
    plants = {name: DoorPlant(name, config.wires(name)) for name in config.devices}
    for plant in plants.values():
        plant.drive("hold_open", True, 0.0)
    far = [
        PlantWiring(p, config.wires_on("gateway", n), modbus.canonical) for n, p in plants.items()
    ]
    server = ModbusServer(far, slow_s=1.0)
    port: Any = server.replace
    text = file.read_text().replace("tcp: {host: 127.0.0.1}", f"tcp: {port['tcp']}")
    file.write_text(text.replace("'", ""))
    try:
        assert outputs_off(load(file), 30.0) == {"ward", "lab"}
    finally:
        server.close()
    assert [p.edges[-1].value for p in plants.values()] == [False, False]

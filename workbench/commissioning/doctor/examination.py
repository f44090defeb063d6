"""Examine every subject in turn, for one file on one machine."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bridges.runtime import runtime_directory
from bridges.settings.load import Config
from bridges.system import directories as kept
from bridges.system.directories import Directories
from drivers.hal.gpio.header import canonical
from workbench.commissioning.doctor import can, gpio, health, ports
from workbench.commissioning.doctor.answers import answers, numbers
from workbench.commissioning.doctor.certificates import certificates
from workbench.commissioning.doctor.chips import line
from workbench.commissioning.doctor.finding import Finding, note, ok, wrong
from workbench.commissioning.doctor.machine import Machine
from workbench.commissioning.doctor.served import DAEMON, NOT_ASKED, ServingDaemon, served, unseen
from workbench.commissioning.doctor.users import User, user, users
from workbench.graph.join import CommandLine

if TYPE_CHECKING:
    from bridges.settings.building_map import BuildingMap

XNERGY_BITRATE: Final = 250_000
"""Default bitrate (bit/s) of Xnergy's receivers on CANopen (`drivers/charger/canopen.py`)."""


@dataclass(frozen=True, slots=True)
class Options:
    """Choices of the command line.

    - `kill_test`: device and output of the kill test; None without the test.
    - `whole_scan`: whether the doctor scans every unit or node of a bus.
    - `listen_s`: time (s) to listen to RMF's graph. With 0, the doctor does not join the graph.
    - `line`: the command line, with the options that name the graph.
    """

    runtime_dir: str | None = None
    whole_scan: bool = False
    listen_s: float = 0.0
    localhost: bool = False
    ros_args: Sequence[str] = ()
    kill_test: tuple[str, str | None] | None = None
    line: CommandLine = CommandLine()


def examined(
    config: Config, building: "BuildingMap | None", machine: Machine, options: Options
) -> Iterator[Finding]:
    """Yield each finding as soon as the doctor knows the finding."""
    file, who = config.path.absolute(), user(machine, config.path.stem)
    yield from _file(config, building)
    yield from users(machine, who)
    yield from health.clock(machine)
    yield from health.watchdog(machine)
    yield from certificates(config, machine)
    try:
        places = runtime_directory.find(file, options.runtime_dir)
    except PermissionError as error:
        places, now = kept.of_service(file), unseen(str(error))
    else:
        yield from health.directories(machine, places, who)
        now = served(places, file, time.time())
    yield from now.findings
    for name in config.buses:
        yield from _way(config, name, machine, who, now)
    yield from _answering(config, places, now, options)
    if options.listen_s:
        from workbench.commissioning.doctor.network import GraphLook, graph

        loopback = options.localhost or now.simulated
        simulated = ["--localhost"] if loopback and not options.localhost else []
        watch = options.line.other("watch", *simulated)
        look = GraphLook(loopback, options.listen_s, now.serving, watch, options.ros_args)
        yield from graph(config, look)
    if options.kill_test:
        yield from _killed(config, machine, places, now, options)


def _file(config: Config, building: "BuildingMap | None") -> Iterator[Finding]:
    """Examine the YAML file. The findings summarise the output of `check`."""
    yield ok("file", f"{config.path} is a valid file of a {config.kind}")
    for problem in config.warnings:
        yield note("file", str(problem), "legal, and worth a look", "rmf-bridge check FILE")
    if building is None:
        return
    from bridges.settings.map_names import mismatches

    means = "RMF finds devices by name: a robot would wait for ever"
    for problem in (problems := mismatches(config, building)):
        yield wrong("file", str(problem), means, "use the same name in the YAML and on the map")
    if not problems:
        yield ok("file", f"same names as in {building.file}")


def _way(
    config: Config, name: str, machine: Machine, who: User, now: ServingDaemon
) -> Iterator[Finding]:
    """Examine this machine's access to the bus."""
    settings = config.buses[name]
    if config.bus_types[name] == "gpio":
        yield from _gpio(config, name, machine, who, now)
    serial = getattr(settings, "serial", None) or getattr(settings, "slcan", None)
    if serial is not None:
        yield from ports.port(machine, serial.port, who, served=now.serving is not False)
    if interface := getattr(settings, "socketcan", None):
        nodes = any(numbers(config, name, "node"))
        yield from can.interface(machine, interface, XNERGY_BITRATE if nodes else None)


def _gpio(
    config: Config, name: str, machine: Machine, who: User, now: ServingDaemon
) -> Iterator[Finding]:
    chip_number = config.buses[name].chip
    yield from gpio.gpio(machine, chip_number, who)
    chip = gpio.header(machine, chip_number)
    for device in config.devices_at(name):
        wires = config.wires_on(name, device)
        if chip is not None and not now.busy:
            yield from gpio.lines(machine, chip, wires)
        yield from gpio.boot(machine, wires, config.devices[device].accept_unsafe)
    yield from gpio.death(machine)


def _answering(
    config: Config, places: Directories, now: ServingDaemon, options: Options
) -> Iterator[Finding]:
    """Read the devices, if no other process uses the buses."""
    names = [name for name, kind in config.bus_types.items() if kind != "gpio"]
    if now.busy or not names:
        return
    try:
        held = runtime_directory.RuntimeDirectory(places, config.path.absolute(), serves=False)
    except (runtime_directory.AlreadyRunning, PermissionError) as error:
        yield wrong(DAEMON, str(error), NOT_ASKED, "stop the other program, and try again")
        return
    try:
        for name in names:
            yield from answers(config, name, options.whole_scan)
    finally:
        held.close()


def _killed(
    config: Config, machine: Machine, places: Directories, now: ServingDaemon, options: Options
) -> Iterator[Finding]:
    from workbench.commissioning.doctor.kill_test import KILL_TEST, kill_test
    from workbench.commissioning.doctor.victim import step_called

    if now.busy:
        yield wrong(
            KILL_TEST,
            now.busy,
            "nothing was switched, because only one process may switch a device's outputs",
            "stop that process first",
        )
        return
    assert options.kill_test is not None
    device, output = options.kill_test
    step = step_called(config, device, output)
    assert step is not None  # the command has already refused an unknown step

    def still_driven() -> bool | None:
        """Return whether one of the device's GPIO lines is still an output."""
        bus = config.bus_of(device)
        if config.bus_types[bus] != "gpio":
            return None
        chip = gpio.header(machine, config.buses[bus].chip)
        assert chip is not None  # without a chip, no output could have been switched on
        outputs = [wire for wire in config.wires(device) if wire.direction == "out"]
        return any(line(machine, chip, _bcm(wire.point)).output for wire in outputs)

    file = Path(config.path).absolute()
    yield from kill_test(file, device, step, places, options.runtime_dir, still_driven)


def _bcm(point: str) -> int:
    return int(canonical(point).removeprefix("BCM"))

"""Find devices on a file's buses.

The doctor first reads each device of the file once. Then the doctor scans a limited range of addresses
for other devices.

The doctor writes nothing. The doctor reads through drivers but never opens a driver, because opening
claims outputs and may switch the outputs off. The doctor removes the modules' watchdogs from the
settings, so no driver arms a watchdog.
"""

import re
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

import msgspec

from bridges.settings.load import Config
from bridges.system.log import plain
from drivers import DriverError
from drivers.hal import Bus, HalError
from drivers.hal.points import Points
from workbench.commissioning.doctor.finding import Finding, note, ok, warning, wrong

TRIES: Final = 3
HEARD_S: Final = 1.5
"""Time (s) to listen on CAN and MQTT. Slow stations send once a second."""
ANSWERS_S: Final = 0.5
"""Maximum time (s) for a device on MQTT to answer a question."""
TOPICS_SHOWN: Final = 40
UNITS_MOST: Final = {"modbus": 247, "can": 127}
"""Highest unit number on Modbus, and highest node number on CAN (Modbus over Serial Line V1.02, 2.2;
CiA 301)."""
SOME: Final = 16
LOOK_AT: Final = {
    "modbus": 'supply and cable; docs/how-to/wire.md, "RS-485"',
    "can": 'supply and cable; docs/how-to/wire.md, "CAN"',
    "http": "curl with the same address",
    "mqtt": "mosquitto_sub -v with the same address and topics; rmf-bridge doctor --scan",
}
TEXTS: Final = "docs/how-to/troubleshoot.md"
NO_PATH: Final = (10, 11)
"""Exception codes of a gateway when the unit behind the gateway is silent (Modbus Application Protocol
V1.1b3, section 7)."""
DEVICE_TYPE: Final = (0x1000, 0, 4)
"""Index, subindex and size (bytes) of the object "device type". Every CANopen node has this object (CiA
301, 7.5.2.1)."""


def answers(config: Config, bus_name: str, whole: bool) -> Iterator[Finding]:
    """Examine any bus except GPIO. With `whole`, scan every unit or node. Otherwise scan only 1 to
    16."""
    subject, kind = f"bus {bus_name}", config.bus_types[bus_name]
    try:
        bus = _opened(config, bus_name)
    except HalError as error:
        yield wrong(
            subject, str(error), "no device on this bus can be served", LOOK_AT.get(kind, TEXTS)
        )
        return
    try:
        yield from readings(config, bus_name, bus, subject)
        yield from SCANS.get(kind, _nothing)(config, bus_name, bus, whole)
    finally:
        bus.close()


def _opened(config: Config, bus_name: str) -> Bus:
    return config.bus_type(bus_name).open_bus(unarmed(config.buses[bus_name]))


def unarmed(settings: msgspec.Struct) -> msgspec.Struct:
    """Return a bus's settings without the modules' watchdogs. With watchdogs, a reading would arm
    them."""
    if getattr(settings, "module_watchdog", None) is None:
        return settings
    return msgspec.structs.replace(settings, module_watchdog=None)


def readings(config: Config, bus_name: str, bus: Any, subject: str) -> Iterator[Finding]:
    """Yield the answer of each device on this bus, as the device's driver decodes the answer."""
    reads = {name: _reading(config, bus_name, name, bus) for name in config.devices_at(bus_name)}
    _listened(bus)
    for name, read in reads.items():
        try:
            sample = _read(read, bus)
        except DriverError as error:
            means = f"a daemon could not serve {name}, so {name} would be unusable for RMF"
            yield wrong(
                subject, f"{name}: {error}", means, LOOK_AT.get(config.bus_types[bus_name], TEXTS)
            )
            continue
        if fault := getattr(sample, "code_fault", ""):
            do = "compare the YAML's codes: with the lines that rmf-bridge walk shows"
            yield warning(subject, f"{name}: {fault}", "RMF gets no floor", do)
        yield ok(subject, f"{name} answers: {plain(sample)}")


def _reading(config: Config, bus_name: str, name: str, bus: Any) -> Callable[[], Any]:
    """Return a function that reads a device. The function reads through the device's driver. If the
    device has two buses, the function reads only this bus's contacts."""
    if config.other_buses(name):
        return Points(config.wires_on(bus_name, name), bus).read
    read: Callable[[], Any] = config.driver_type(name).create(name, config.devices[name], bus).read
    return read


def _read(read: Callable[[], Any], bus: Bus) -> Any:
    """Read the device. Try several times, because after an idle time on the line the first answer may
    come late. Raises DriverError."""
    for _ in range(TRIES - 1):
        bus.insist()
        try:
            return read()
        except DriverError:
            _listened(bus, ANSWERS_S)
    bus.insist()
    return read()


def _listened(bus: Any, listen_s: float = HEARD_S) -> None:
    """Receive for `listen_s` (s) on CAN and MQTT. Ignore faults of the bus, because the readings show
    the same faults."""
    if not hasattr(bus, "wait"):
        return
    try:
        bus.wait(lambda: False, listen_s)
    except HalError:
        return


def _nothing(config: Config, bus_name: str, bus: Bus, whole: bool) -> Iterator[Finding]:
    yield from ()


def _modbus(config: Config, bus_name: str, bus: Any, whole: bool) -> Iterator[Finding]:
    from drivers.hal.modbus.points import Range
    from drivers.hal.modbus.wire import UnitException

    def answering(unit: int) -> bool:
        bus.insist()
        try:
            bus.read(Range(unit, "holding register", 0, 1))
        except UnitException as refusal:
            return refusal.code not in NO_PATH
        except HalError:
            return False
        return True

    ours = set(numbers(config, bus_name, "unit"))
    yield _scanned(f"bus {bus_name}", "unit", "modbus", ours, whole, answering)


def _can(config: Config, bus_name: str, bus: Any, whole: bool) -> Iterator[Finding]:
    """Ask CANopen nodes for their device type, and listen to other stations."""
    from drivers.hal.can.canopen import Aborted, CanOpenNode
    from drivers.hal.can.frames import named

    if others := bus.others():
        heard = ", ".join(map(named, others))
        yield note(
            f"bus {bus_name}", f"there are frames that no device of this file sends: {heard}"
        )

    def answering(node: int) -> bool:
        bus.insist()
        try:
            CanOpenNode(bus, node, None).read(*DEVICE_TYPE)
        except Aborted:
            return True
        except HalError:
            return False
        return True

    if ours := set(numbers(config, bus_name, "node")):
        yield _scanned(f"bus {bus_name}", "node", "can", ours, whole, answering)


def _mqtt(config: Config, bus_name: str, bus: Any, whole: bool) -> Iterator[Finding]:
    """List the broker's topics, but only with `--scan`. The broker may not permit the YAML's user to
    read all topics."""
    if not whole:
        return
    subject, ours = f"bus {bus_name}", set(bus.topics())
    try:
        found, all_heard = bus.survey(HEARD_S)
    except HalError as error:
        yield warning(subject, f"the topics cannot be listed: {error}", "", LOOK_AT["mqtt"])
        return
    number = f"{len(found)} topics" if all_heard else f"more than {len(found)} topics"
    yield note(subject, f"{number} were heard in {HEARD_S:g} s; a silent device is not among them")
    strangers = sorted(topic for topic in found if topic not in ours)
    for topic in strangers[:TOPICS_SHOWN]:
        yield note(subject, f"{found[topic]} {topic}")
    if len(strangers) > TOPICS_SHOWN:
        yield note(subject, f"and {len(strangers) - TOPICS_SHOWN} more: {LOOK_AT['mqtt']}")


SCANS: Final = {"modbus": _modbus, "can": _can, "mqtt": _mqtt}


def _scanned(
    subject: str,
    what: str,
    kind: str,
    ours: set[int],
    whole: bool,
    answering: Callable[[int], bool],
) -> Finding:
    most = UNITS_MOST[kind] if whole else SOME
    asked = sorted({*range(1, most + 1), *ours})
    began = time.monotonic()
    found = [number for number in asked if answering(number)]
    took_s = time.monotonic() - began
    text = (
        f"of the {what}s {ranges(asked)} these answer: {ranges(found) or 'none'} ({took_s:.1f} s)"
    )
    strangers = sorted(set(found) - ours)
    if found == asked:
        return note(subject, text, f"the module answers for every {what}, as many TCP modules do")
    if strangers and not ours <= set(found):
        do = f"write the {what} that answers, or set the device to the {what} of this file"
        means = f"{what} {ranges(sorted(ours))} of this file may be wrong"
        return warning(subject, text, means, do)
    if strangers:
        return note(subject, text, f"no device of this file has {what} {ranges(strangers)}")
    if not found:
        do = "check supply, cable (A and B), baud rate and parity, and the gateway's own timeout"
        return wrong(subject, text, "no device is connected, or no answer arrives", do)
    return ok(subject, text)


def numbers(config: Config, bus_name: str, what: str) -> Iterator[int]:
    """Return the numbers of the units or nodes that the file names on this bus."""
    for name in config.devices_at(bus_name):
        settings, driver = config.devices[name], config.driver_type(name)
        claimed = [place for place, _ in driver.claims(settings)]
        places = [*(wire.point for wire in config.wires_on(bus_name, name)), *claimed]
        for place in places:
            yield from map(int, re.findall(rf"^{what} (\d+)\b", place.lower()))
        if isinstance(number := getattr(settings, what, None), int):
            yield number


def ranges(numbers: Iterable[int]) -> str:
    """Format numbers as ranges, such as `1, 3 to 16`."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and runs[-1][-1] == number - 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(r[0]) if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs)

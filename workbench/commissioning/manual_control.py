"""Control one device by hand, for `walk` and for the kill test.

The module takes the device's lock, writes the record, starts the guard, and switches the outputs off.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from bridges.runtime import guard, record, runtime_directory
from bridges.settings.load import Config
from bridges.system import directories
from drivers import Driver, DriverError, TakesInputs
from drivers.hal import Bus
from drivers.hal.points import Points


def guarded(
    config: Config,
    device: str,
    held: runtime_directory.RuntimeDirectory,
    outputs_off: Sequence[str],
) -> tuple[dict[str, Bus], Callable[[], None]]:
    """Return the device's buses by name, and a function `all_off`. Raises HalError.

    This function first opens the buses. If a bus cannot be opened, no output can be on. Then it writes
    the record and starts the guard, before any output is claimed. If this process dies, the guard runs
    `outputs_off`. When every output is verified off, the caller must call `all_off`, which ends the
    record and the guard.
    """
    ours = record.of(config)  # first, because the YAML's path may be relative
    directories.work_somewhere(held.places)
    buses = {name: config.open_bus(name) for name in buses_of(config, device)}
    held.claim(ours)
    watching = guard.Guard(outputs_off)

    def all_off() -> None:
        held.released()
        watching.dismiss()

    return buses, all_off


def buses_of(config: Config, device: str) -> list[str]:
    """Return the name of the device's own bus, and then the names of the device's other buses."""
    return [config.bus_of(device), *config.other_buses(device)]


def driver_on(config: Config, device: str, buses: Mapping[str, Any]) -> Driver[Any, Any]:
    """Make the device's driver. This driver reads every bus in the caller's thread."""
    own, *others = buses_of(config, device)
    driver: Driver[Any, Any] = config.driver_type(device).create(
        device, config.devices[device], buses[own]
    )
    if others:
        assert isinstance(driver, TakesInputs)  # only contacts may name another bus
        driver.take_inputs(
            _OtherInputs([Points(config.wires_on(name, device), buses[name]) for name in others])
        )
    return driver


class _OtherInputs:
    """A reader of the inputs on other buses. The first reading claims the inputs."""

    def __init__(self, parts: Sequence[Points]) -> None:
        self._closed = list(parts)
        self._parts = parts

    def __call__(self) -> Mapping[str, bool]:
        while self._closed:
            self._closed[-1].open()
            self._closed.pop()
        return {signal: on for points in self._parts for signal, on in points.read().items()}


def not_off(driver: Driver[Any, Any], insist: Callable[[], None]) -> str:
    """Switch every output off. Return "" if all outputs are verified off. Otherwise return the reason.

    `insist` ends the bus's pauses, so that the bus tries to reach the device at once.
    """
    insist()
    try:
        driver.make_safe()
    except DriverError as error:
        return f"not verified off: {error}"
    return ""

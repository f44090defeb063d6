"""Control one device by hand (`walk`, the kill test): take its lock, write its record, start its guard,
and switch its outputs off."""

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
    """Return the device's buses by name, and a function to call once every output is verified off.
    Raises HalError.

    Record and guard (which runs `outputs_off` if we die) start once the buses are open, before an
    output is claimed. A bus that cannot be opened leaves nothing to switch off.
    """
    directories.work_somewhere(held.places)
    buses = {name: config.open_bus(name) for name in buses_of(config, device)}
    held.claim(record.of(config))
    watching = guard.Guard(outputs_off)

    def all_off() -> None:
        held.released()
        watching.dismiss()

    return buses, all_off


def buses_of(config: Config, device: str) -> list[str]:
    """Return the names of the device's own bus and of its other buses, in this order."""
    return [config.bus_of(device), *config.other_buses(device)]


def driver_on(config: Config, device: str, buses: Mapping[str, Any]) -> Driver[Any, Any]:
    """Make the device's driver, which reads every bus in the caller's thread."""
    own, *others = buses_of(config, device)
    driver: Driver[Any, Any] = config.driver_type(device).create(
        device, config.devices[device], buses[own]
    )
    if others:
        assert isinstance(driver, TakesInputs)  # only contacts have `bus` in the YAML
        driver.take_inputs(
            _OtherInputs([Points(config.wires_on(name, device), buses[name]) for name in others])
        )
    return driver


class _OtherInputs:
    """Reads the inputs on other buses now; claims them the first time."""

    def __init__(self, parts: Sequence[Points]) -> None:
        self._closed = list(parts)
        self._parts = parts

    def __call__(self) -> Mapping[str, bool]:
        while self._closed:
            self._closed[-1].open()
            self._closed.pop()
        return {signal: on for points in self._parts for signal, on in points.read().items()}


def not_off(driver: Driver[Any, Any], insist: Callable[[], None]) -> str:
    """Switch every output off. Return "", or the reason why an output is not verified off.

    `insist`: function that ends the bus's pauses.
    """
    insist()
    try:
        driver.make_safe()
    except DriverError as error:
        return f"not verified off: {error}"
    return ""

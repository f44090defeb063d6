"""Controls one device by hand (`walk`, the kill test): its lock, its record, its guard, and outputs
off.
"""

from collections.abc import Callable, Sequence
from typing import Any

from bridges.runtime import guard, record, runtime_directory
from bridges.settings.load import Config
from bridges.system import directories
from drivers import Driver, DriverError
from drivers.hal import Bus


def guarded(
    config: Config,
    device: str,
    held: runtime_directory.RuntimeDirectory,
    outputs_off: Sequence[str],
) -> tuple[Bus, Callable[[], None]]:
    """Return the device's bus, and a function to call once every output is verified off. Raises
    HalError.

    Record and guard (which runs `outputs_off` if we die) start once the bus is open, before an
    output is claimed. A bus that cannot be opened leaves nothing to switch off.
    """
    directories.work_somewhere(held.places)
    bus = config.open_bus(config.bus_of(device))
    held.claim(record.of(config))
    watching = guard.Guard(outputs_off)

    def all_off() -> None:
        held.released()
        watching.dismiss()

    return bus, all_off


def not_off(driver: Driver[Any, Any], insist: Callable[[], None]) -> str:
    """Switch every output off. Return "", or why that is unverified. `insist`: end the bus's pauses."""
    insist()
    try:
        driver.make_safe()
    except DriverError as error:
        return f"not verified off: {error}"
    return ""

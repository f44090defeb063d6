"""Every output of a YAML or of a record off, from a fresh process. Imports only what switches."""

import logging
import threading
import time
from collections.abc import Collection, Sequence
from typing import Any

from bridges.log import pairs
from bridges.settings.load import Config
from drivers import Driver, DriverError
from drivers.hal import HalError

log = logging.getLogger(__name__)


def outputs_off(config: Config, timeout_s: float, but: Collection[str] = ()) -> set[str]:
    """Switch off every output that a file names, `but` these devices; those that are verified off.

    Bounded: a bus that does not answer is given up after `timeout_s` (s) in all.
    """
    results: dict[str, bool] = {}
    left = [name for name in config.devices if name not in but]
    threads = [_started(config, bus, left, results) for bus in config.buses]
    deadline = time.monotonic() + timeout_s
    for thread in threads:
        thread.join(max(0.0, deadline - time.monotonic()))
    found = dict(results)
    for name in set(left) - found.keys():
        log.error(pairs("outputs_not_off", device=name, reason=f"not done within {timeout_s:g} s"))
    return {name for name, off in found.items() if off}


def _started(
    config: Config, bus_name: str, left: Collection[str], results: dict[str, bool]
) -> threading.Thread:
    """One bus that does not answer takes no time from the others."""
    devices = [name for name in config.devices_on(bus_name) if name in left]
    arguments = (config, bus_name, devices, results)
    thread = threading.Thread(target=_bus_off, args=arguments, daemon=True)
    thread.start()
    return thread


def _bus_off(
    config: Config, bus_name: str, devices: Sequence[str], results: dict[str, bool]
) -> None:
    if not devices:
        return
    try:
        bus = config.open_bus(bus_name)
    except HalError as error:
        log.error(pairs("outputs_not_off", bus=bus_name, reason=error))
        results.update(dict.fromkeys(devices, False))
        return
    for name in devices:
        driver = config.driver_type(name).create(name, config.devices[name], bus)
        results[name] = _device_off(name, driver)
    bus.close()


def _device_off(name: str, driver: Driver[Any, Any]) -> bool:
    try:
        driver.open()
        driver.make_safe()
    except DriverError as error:
        log.error(pairs("outputs_not_off", device=name, reason=error))
        return False
    except Exception as error:  # a defect of ours; the other devices have their turn
        log.error(pairs("outputs_not_off", device=name, reason=repr(error)), exc_info=True)
        return False
    finally:
        driver.close()
    log.info(pairs("outputs_off", device=name))
    return True

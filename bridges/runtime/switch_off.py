"""Switches off every output of a YAML or record, from a new process, with as few imports as possible.

On each bus, the devices that answered the dead daemon last come first, because silent devices would use
up the time. Each device first gets one short attempt. Then the failed devices get a second attempt.
"""

import logging
import math
import threading
import time
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from bridges.settings.config import Config
from bridges.system.log import pairs
from drivers import Driver, DriverError
from drivers.hal import Bus, HalError

log = logging.getLogger(__name__)


def outputs_off(
    config: Config,
    timeout_s: float,
    but: Collection[str] = (),
    ages: Mapping[str, float] | None = None,
) -> set[str]:
    """Switch off every output of a file, except the outputs of the devices in `but`. Return the devices
    that are verified off. Give up after `timeout_s` (s) in total.

    `ages`: the age (s) of each device's last answer to the dead daemon. It lacks devices that never
    answered.
    """
    results: dict[str, bool] = {}
    left = [name for name in config.devices if name not in but]
    left.sort(key=lambda name: (ages or {}).get(name, math.inf))
    threads = [_started(config, bus, left, results) for bus in config.buses]
    deadline = time.monotonic() + timeout_s
    for thread in threads:
        thread.join(max(0.0, deadline - time.monotonic()))
    found = dict(results)
    for name in set(left) - found.keys():
        log.error(pairs("outputs_not_off", device=name, reason=f"not done within {timeout_s:g} s"))
    return {name for name, off in found.items() if off}


def _started(
    config: Config, bus_name: str, left: Sequence[str], results: dict[str, bool]
) -> threading.Thread:
    """Start a thread for one bus, so that a dead bus does not delay other buses."""
    here = set(config.devices_on(bus_name))
    devices = [name for name in left if name in here]
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
        bus = config.open_to_switch_off(bus_name)
    except HalError as error:
        log.error(pairs("outputs_not_off", bus=bus_name, reason=error))
        results.update(dict.fromkeys(devices, False))
        return
    failed = [name for name in devices if not _device_off(config, name, bus, results)]
    for name in failed:
        bus.insist()
        _device_off(config, name, bus, results, last=True)
    bus.close()


def _device_off(
    config: Config, name: str, bus: Bus, results: dict[str, bool], last: bool = False
) -> bool:
    """Try to switch one device off. Log and count a failure only in the `last` attempt."""
    driver = None
    try:
        driver = config.driver_type(name).create(name, config.devices[name], bus)
        driver.open()
        driver.make_safe()
    except Exception as error:  # noqa: BLE001 - logged by _failed
        if last:
            _failed(name, error)
            results[name] = False
        return False
    finally:
        if driver is not None:
            _close(driver, name)
    log.info(pairs("outputs_off", device=name))
    results[name] = True
    return True


def _close(driver: Driver[Any, Any], name: str) -> None:
    """Release the device. Only log an exception, which is a mistake of our own code. It says nothing
    about the outputs, because `make_safe` has verified them."""
    try:
        driver.close()
    except Exception:
        log.exception(pairs("not_closed", device=name))


def _failed(name: str, error: Exception) -> None:
    """Log the failure. An unexpected exception of our own code is only logged too, so that the other
    devices are still switched off."""
    if isinstance(error, DriverError):
        log.error(pairs("outputs_not_off", device=name, reason=error))
    else:
        log.error(pairs("outputs_not_off", device=name, reason=repr(error)), exc_info=error)

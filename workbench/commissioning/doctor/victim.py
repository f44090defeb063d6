"""The process that the kill test kills. The process switches one output on as the daemon would, and
prints `on`.

The command is `python -m workbench.commissioning.doctor.victim FILE DEVICE STEP RUNTIME_DIR`. When the
parent dies, the process's standard input ends. Then the process switches the output off, and ends. The
output is on for at most ON_S.
"""

import select
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from bridges.runtime import guard, runtime_directory, signals
from bridges.settings.load import Config, SettingsError, load
from drivers import Driver, DriverError
from drivers.hal import Bus
from workbench.commissioning.manual_control import driver_on, guarded, not_off
from workbench.commissioning.walk.core import WalkStep
from workbench.commissioning.walk.steps import steps

ON_S: Final = 5.0


def main(file: Path, device: str, step: str, runtime_dir: str | None) -> int:
    """Run the victim. Return 0 if a reading verified that the output is off."""
    signals.End()
    try:
        config = load(file)
        held = runtime_directory.held(file, runtime_dir, serves=False)
    except (SettingsError, runtime_directory.AlreadyRunning, PermissionError) as error:
        return _say(f"{error}")
    try:
        return _held(config, device, step, held, guard.command(file, runtime_dir))
    finally:
        held.close()


def _held(
    config: Config,
    device: str,
    step: str,
    held: runtime_directory.RuntimeDirectory,
    switches_off: list[str],
) -> int:
    try:
        buses, all_off = guarded(config, device, held, switches_off)
    except DriverError as error:
        return _say(f"{error}")
    try:
        driver, bus = driver_on(config, device, buses), buses[config.bus_of(device)]
        off = _on_for_a_while(driver, bus, step_called(config, device, step))
    except DriverError as error:
        return _say(f"{error}")
    if off:
        all_off()
    return 0 if off else 1


def step_called(config: Config, device: str, name: str | None) -> WalkStep | None:
    """Return the device's output step with this name, or the first step if `name` is None. Return None
    if the name is unknown."""
    return next((step for step in steps(config, device) if name in (None, step.name)), None)


def _on_for_a_while(driver: Driver[Any, Any], bus: Bus, step: WalkStep | None) -> bool:
    """Switch the output on for ON_S. Then switch the output off, if the process still lives. Return
    whether a reading verified that the output is off."""
    assert step is not None  # without a step there is no kill test
    try:
        driver.open()
        if why := step.hindrance(driver.read()):
            _say(why)
        else:
            driver.write(step.outputs)
            bus.scanned()
            _say("on")
            select.select([sys.stdin], [], [], ON_S)
    except DriverError as error:
        _say(f"{error}")
    try:
        return not not_off(driver, bus.insist)
    finally:
        driver.close()
        bus.close()


def _say(text: str) -> int:
    with suppress(OSError):
        print(text, flush=True)
    return 1


if __name__ == "__main__":
    _, file, device, step, runtime_dir = sys.argv
    sys.exit(main(Path(file), device, step, runtime_dir or None))

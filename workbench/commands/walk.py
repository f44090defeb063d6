"""`rmf-bridge walk FILE`: test every wire of a device together with the electrician, and sign the
results.

The screen shows every input live. A key switches one output on, for a few seconds. No daemon may serve
the device during the walk. At the end of the walk, every output is off. A guard process switches the
outputs off even after a kill -9.
"""

import argparse
import getpass
import logging
import os
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack
from datetime import datetime
from pathlib import Path

from bridges.runtime import guard, signals
from bridges.runtime import runtime_directory as runtime
from bridges.runtime.completers import completed_by, device_names
from bridges.settings.load import Config, SettingsError, load
from bridges.system import log
from drivers.hal import Bus, HalError
from workbench.commissioning.manual_control import buses_of, driver_on, guarded
from workbench.commissioning.walk.steps import OFF, steps, untestable
from workbench.graph.which_device import NoDevice, device_of

NOT_OFF = 1
DRAW_S = 0.05


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `walk`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML")
    device = parser.add_argument(
        "--device", metavar="NAME", help="which device, if the file has several"
    )
    completed_by(device, device_names)
    parser.add_argument(
        "--by", metavar="NAME", help="the person's name, for the record (default: the user)"
    )
    parser.add_argument(
        "--record",
        type=Path,
        metavar="PATH",
        help="where PATH.md and PATH.json are written (default: walk-DEVICE-DATE here)",
    )
    parser.add_argument("--simulate", action="store_true", help="practise on fake hardware")
    parser.add_argument("--runtime-dir", metavar="DIR", help=argparse.SUPPRESS)


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: all outputs are off.
    - 1: the program could not verify that an output is off.
    - 64: there is no terminal, or the YAML has no device that a person can test.
    - 69: the device is in use.
    - 73: the record cannot be written.
    - 78: the YAML has an error.
    """
    log.start("WARNING")
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        print("walk needs a terminal: it switches outputs by keys", file=sys.stderr)
        return os.EX_USAGE
    try:
        config = load(args.file)
        if why := untestable(config):
            raise NoDevice(why)
        device = device_of(config, args.device)
    except SettingsError as error:
        print("\n".join(map(str, error.problems)), file=sys.stderr)
        return os.EX_CONFIG
    except NoDevice as error:
        print(error, file=sys.stderr)
        return os.EX_USAGE
    args.file = args.file.absolute()  # `guarded` changes the working directory
    end = signals.End()
    signals.ignore_reset()
    try:
        held = runtime.held(args.file, args.runtime_dir, serves=False, simulated=args.simulate)
    except (runtime.AlreadyRunning, PermissionError) as error:
        print(f"walk needs the device alone: {error}", file=sys.stderr)
        return os.EX_UNAVAILABLE
    try:
        return _walk(args, config, device, held, end)
    except HalError as error:
        print(error, file=sys.stderr)
        return os.EX_UNAVAILABLE
    finally:
        held.close()


def _walk(
    args: argparse.Namespace,
    config: Config,
    device: str,
    held: runtime.RuntimeDirectory,
    end: signals.End,
) -> int:
    if not args.simulate and held.records.unreleased():
        print(
            "a daemon died and may have left outputs on; to switch them off:"
            f" rmf-bridge outputs-off {args.file}"
        )
        return os.EX_UNAVAILABLE
    with ExitStack() as stack:
        path = _record_path(args, device).absolute()
        if args.simulate:
            from hal_fakes.simulate import Simulation

            simulation = Simulation(config, held.path)
            stack.callback(simulation.close)
            buses = {name: simulation.open_bus(name) for name in buses_of(config, device)}
            return _on(args, config, device, buses, path, end)
        buses, all_off = guarded(config, device, held, guard.command(args.file, args.runtime_dir))
        code = _on(args, config, device, buses, path, end)
        if code != NOT_OFF:
            all_off()
        return code


def _record_path(args: argparse.Namespace, device: str) -> Path:
    day = datetime.now().strftime("%Y-%m-%d-%H%M")
    return args.record or Path(
        f"{'practice' if args.simulate else 'walk'}-{device.replace('/', '_')}-{day}"
    )


def _on(
    args: argparse.Namespace,
    config: Config,
    device: str,
    buses: Mapping[str, Bus],
    path: Path,
    end: signals.End,
) -> int:
    from workbench.commissioning.walk import signed
    from workbench.commissioning.walk.bench import Bench, ContactReading
    from workbench.commissioning.walk.screen import Screen, keyboard, keys
    from workbench.commissioning.walk.tap import Tap

    taps = {name: Tap(bus) for name, bus in buses.items()}
    inputs = [
        ContactReading(wire, tap.canonical(wire.point), tap.levels)
        for name, tap in taps.items()
        for wire in config.wires_on(name, device)
        if wire.direction == "in"
    ]
    tried, tap = steps(config, device), taps[config.bus_of(device)]
    bench = Bench(driver_on(config, device, taps), tap, inputs, tried, OFF[config.kind])
    begun = datetime.now()
    by = args.by or getpass.getuser()

    def note(how: str) -> None:
        signed.write(
            path,
            signed.record(
                args.file,
                device,
                by,
                begun,
                inputs=inputs,
                steps=tried,
                memory=bench.memory,
                end=how,
                simulated=args.simulate,
            ),
        )

    how, noted = "interrupted", None
    try:
        with bench, keyboard() as terminal, Screen(device, bench) as screen:
            while not end.wait(0):
                if not all(map(screen.obey, keys(terminal, DRAW_S))):
                    how = "ended by key"
                    break
                screen.draw(time.monotonic())
                if bench.memory.results != noted:
                    noted = bench.memory.results
                    note("not ended")
    except OSError as error:
        how = f"interrupted: {error.strerror}"  # the terminal is gone, so nothing can be printed
    finally:
        off = "every output verified off" if bench.verified_off else "outputs NOT verified off"
        for bus in buses.values():
            bus.close()
    code, told = 0, f"{path}.md and .json"
    try:
        note(f"{how}; {off}")
    except OSError as error:
        code, told = os.EX_CANTCREAT, f"not written: {error}"
    print(f"{off}. Record: {told}")
    if not bench.verified_off:
        logging.error("cut the relays' supply before working on the device")
    return code if bench.verified_off else NOT_OFF

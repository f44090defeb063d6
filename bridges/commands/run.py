"""`rmf-bridge run FILE` runs the daemon on real hardware, or with `--simulate` on fake hardware."""

import argparse
import logging
import os
import sys
from pathlib import Path

from msgspec.structs import replace

from bridges.kinds.shared.rmf_section import TRANSPORTS, overridden
from bridges.runtime import drop_in, guard, signals
from bridges.runtime import runtime_directory as runtime
from bridges.runtime.notify import watchdog_s
from bridges.settings.load import Config, SettingsError, load
from bridges.system import directories, log
from bridges.system.installed import of_workbench
from bridges.transports.ros2 import setup as ros_setup
from bridges.transports.transport import TransportError
from drivers.hal import HalError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `run`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML")
    parser.add_argument(
        "--simulate",
        action="store_true",
        help="run the same daemon with fake hardware, on loopback only",
    )
    parser.add_argument(
        "--expose", action="store_true", help="with --simulate: let the network see the fake device"
    )
    parser.add_argument("--domain-id", type=int, metavar="N", help="overrides the YAML's domain_id")
    parser.add_argument("--transport", choices=TRANSPORTS, help="overrides the YAML's transport")
    parser.add_argument(
        "--log-level", choices=("debug", "info", "warning", "error"), default="info"
    )
    parser.add_argument(
        "--log-format",
        choices=("text", "json"),
        default="text",
        help="json: each event as a line of JSON, for programs",
    )
    parser.add_argument(
        "--runtime-dir",
        metavar="DIR",
        help="default: systemd's runtime directory, else a folder in the user's runtime directory",
    )


def run(args: argparse.Namespace) -> int:
    """Validate the file, claim the devices and outputs for this process, and run the daemon. Return the
    exit code, which is 78 for an invalid file.

    Raises NotInstalled if `--simulate` needs the fakes, which are not installed.
    """
    log.start(args.log_level.upper(), json=args.log_format == "json", unhurried=True)
    if args.simulate and os.environ.get("RMF_BRIDGE_SERVICE") == "1":
        logging.error("a service never simulates: RMF_BRIDGE_SERVICE=1 forbids --simulate")
        return os.EX_USAGE
    if args.expose and not args.simulate:
        logging.error("--expose needs --simulate: a real device is on the network anyway")
        return os.EX_USAGE
    try:
        config = load(args.file)
        path = config.path.absolute()  # now, because `work_somewhere` changes the directory
        config = replace(config, path=path, rmf=overridden(config.rmf, args))
        if (
            config.kind == "fleet"
        ):  # find errors in RMF's files before anything starts; recordings need their texts
            from bridges.settings.fleet_site import read_site

            read_site(config)
    except SettingsError as error:
        for problem in error.problems:
            logging.error(str(problem))
        return os.EX_CONFIG
    for old in config.old_keys:
        logging.warning(str(old).replace(": warning:", ":", 1))
    if wrong := drop_in.misfit(config, os.environ) or too_slow(config, watchdog_s()):
        logging.error(wrong)
        return os.EX_CONFIG
    end = signals.End()  # must exist before others can read our pid from the lock and send a signal
    signals.ignore_reset()
    try:
        held = runtime.held(args.file, args.runtime_dir, serves=True, simulated=args.simulate)
    except (runtime.AlreadyRunning, PermissionError) as error:
        logging.error(str(error))
        return os.EX_UNAVAILABLE
    try:
        return _serve(config, held, end, args)
    except (TransportError, HalError) as error:
        logging.error(str(error))
        return os.EX_UNAVAILABLE
    finally:
        held.close()


def too_slow(config: Config, watchdog: float | None) -> str:
    """Return an error if one call on a bus may take more than half of systemd's watchdog time. Return
    "" if no bus is so slow."""
    for name, bus in config.buses.items():
        timeout_s: float = getattr(bus, "timeout_s", 0.0)
        if watchdog is not None and timeout_s > watchdog / 2:
            return (
                f"{config.path}: bus '{name}': timeout_s is {timeout_s:g} s, but the unit has"
                f" WatchdogSec={watchdog:g}: one call may take half of that at most"
            )
    return ""


def _serve(
    config: Config, held: runtime.RuntimeDirectory, end: signals.End, args: argparse.Namespace
) -> int:
    if command := ros_setup.sourcing(config.rmf, os.environ, sys.orig_argv):
        os.execvpe(command[0], command, ros_setup.sourced(config.rmf, os.environ))
    if not args.simulate:
        from bridges.runtime.daemon import Daemon

        outputs_off = guard.command(args.file, args.runtime_dir)
        directories.work_somewhere(held.places)  # lgpio makes a FIFO in the working directory
        return Daemon(config, held, end, ros_args=args.ros_args, outputs_off=outputs_off).serve()
    simulate = of_workbench("hal_fakes.simulate")
    logging.warning("SIMULATED: no hardware moves, and RMF hears simulated states")
    simulation = simulate.Simulation(config, held.path, log_format=args.log_format)
    from bridges.runtime.daemon import Daemon  # imported while the fakes start

    try:
        return Daemon(
            config,
            held,
            end,
            open_bus=simulation.open_bus,
            localhost=not args.expose,
            simulated=True,
            ros_args=args.ros_args,
            rmf=simulation.rmf_adapter(),
        ).serve()
    finally:
        simulation.close()

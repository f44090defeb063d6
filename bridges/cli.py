"""The command `rmf-bridge`. Each subcommand is a file in `bridges/commands/` or
`workbench/commands/`."""

import argparse
import atexit
import gc
import importlib
import io
import os
import re
import sys
from collections.abc import Iterable, Sequence
from typing import NoReturn

from bridges import VERSION, exit_codes
from bridges.system.installed import NotInstalled, is_there, of_workbench

EX_PIPE = 141
"""The exit code if the program that reads our output, such as `head`, has ended. A shell reports the
same code after SIGPIPE."""

COMMANDS = {
    "init": (
        "write a first YAML for the device in front of you",
        "init my_lift.yaml --kind lift --wiring gpio --floors L1,L2,L3 --yes",
    ),
    "run": (
        "run the daemon for a device YAML, until SIGTERM or SIGINT",
        "run my_lift.yaml --simulate",
    ),
    "check": (
        "validate device YAMLs and print their wiring as a table",
        "check my_lift.yaml --building-map hospital.building.yaml",
    ),
    "migrate": (
        "replace old names of keys in a device YAML by the present names",
        "migrate my_lift.yaml --dry-run",
    ),
    "enable": (
        "run a device YAML as a systemd service, or update that service after a change",
        "enable my_lift.yaml --dry-run",
    ),
    "backup": (
        "save this machine's configuration in one file, or restore it",
        "backup pi-lift1.tar.gz",
    ),
    "disable": ("stop a service with its outputs off, and keep its YAML", "disable my_lift"),
    "schema": ("print the JSON Schema of a device YAML", "schema > rmf-bridge.json"),
    "watch": ("show lifts, doors and chargers live, as RMF sees them", "watch --localhost"),
    "page": (
        "serve a web page of RMF's graph, or of a recording",
        "page --localhost",
    ),
    "mqtt-out": (
        "publish lifts, doors and chargers to an MQTT broker; command nothing",
        "mqtt-out 192.168.1.5 --home-assistant",
    ),
    "exporter": (
        "serve metrics of RMF's graph and this machine's daemons, for Prometheus",
        "exporter --localhost",
    ),
    "notify": (
        "tell people of a site's troubles, by webhook, mail or ntfy",
        "notify recipients.yaml --test",
    ),
    "status": (
        "show every daemon on this machine: state, faults and what to do",
        "status --json",
    ),
    "doctor": (
        "find what keeps a bridge from working on this machine, without switching any output",
        "doctor my_lift.yaml --scan",
    ),
    "explain": (
        "say why a robot waits for a lift, door or charger, live or from a recording",
        "explain --live Lift1 --localhost",
    ),
    "plot": (
        "draw what happened to a lift, door or charger, from a recording",
        "plot incident.mcap --device Lift1 -o ride.html",
    ),
    "send": (
        "send a request as RMF does, and wait for its effect",
        "send lift Lift1 L3 --session me --direct --localhost",
    ),
    "judge": (
        "check any lift, door or charger node against RMF's contract",
        "judge lift Lift1 --active --ride L1 L3 --localhost",
    ),
    "release": ("end the session that holds a lift", "release Lift1"),
    "reset": ("let a running daemon clear its latched faults", "reset my_lift.yaml"),
    "drill": (
        "stop the robots for some time, as in an alarm, and then let them drive on",
        "drill my_panel.yaml --for 300",
    ),
    "workcell": (
        "decide the outcome of a dispenser's or ingestor's request, if it is in doubt",
        "workcell again my_dispenser.yaml",
    ),
    "walk": (
        "try every wire of a device with the electrician, and sign what was seen",
        "walk my_lift.yaml --device Lift1",
    ),
    "press": (
        "in a simulation, act as a person or the building",
        "press my_lift.yaml fire_alarm on",
    ),
    "fail": (
        "in a simulation, let a wire or a part fail, or mend it with `ok`",
        "fail my_lift.yaml door_opened stuck",
    ),
    "log": ("show the log of a device's service", "log my_lift.yaml --follow --event fault"),
    "incident": (
        "make a recording of a daemon's last minutes, to find out what happened",
        'incident my_lift.yaml --note "the robot waits before an open door"',
    ),
    "recorder": (
        "make recordings of this machine's daemons when something goes wrong",
        "recorder --output /var/lib/rmf-bridge-recorder",
    ),
    "replay": (
        "repeat a recording's decisions with the present program, and compare",
        "replay my_lift_2026-11-22_10-00-00.mcap --config other.yaml",
    ),
    "completion": (
        "print the completion script for bash, zsh or fish",
        "completion fish > ~/.config/fish/completions/rmf-bridge.fish",
    ),
    "outputs-off": (
        "switch off every output of a device whose daemon is dead",
        "outputs-off my_lift.yaml",
    ),
}
"""The purpose and an example of each subcommand."""
WORKBENCH = frozenset(
    {
        "init",
        "schema",
        "watch",
        "page",
        "doctor",
        "explain",
        "plot",
        "send",
        "mqtt-out",
        "exporter",
        "notify",
    }
    | {"judge", "release", "walk", "press", "fail", "replay"}
)
"""The subcommands in the package `workbench`, which a machine may lack. No daemon needs these
subcommands."""


def main(argv: list[str] | None = None) -> int:
    """Run one subcommand and return its exit code."""
    # Without this line Python collects garbage at exit. The collection takes a fifth of a short
    # process's CPU time. After `gc.freeze` it finds nothing to do.
    atexit.register(gc.freeze)
    if "_ARGCOMPLETE" in os.environ:  # set by the shell; autocomplete ends the process
        import argcomplete

        argcomplete.autocomplete(whole_parser())
    arguments, ros_args = split_ros_args(sys.argv[1:] if argv is None else argv)
    for argument in arguments:
        # Logs, JSON and messages can hold only UTF-8.
        if any("\ud800" <= one <= "\udfff" for one in argument):
            sys.stderr.write(f"rmf-bridge: {os.fsencode(argument)!r} is not UTF-8: rename it\n")
            return 2
    # If the terminal cannot show a character, print the character as an escape.
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    typed = argparse.Namespace(ros_args=ros_args, typed=arguments)
    try:
        parsed, unknown = parser(arguments).parse_known_args(arguments, typed)
        if unknown:
            parsed.usage(f"unrecognized arguments: {' '.join(unknown)}")
        return int(_module(parsed.command).run(parsed))
    except NotInstalled as error:
        import logging

        for handler in logging.root.handlers:
            handler.flush()  # a thread may still write earlier lines, and the reason comes last
        sys.stderr.write(f"rmf-bridge {arguments[0]}: {error}\n")
        return os.EX_UNAVAILABLE
    except BrokenPipeError:  # the program that reads our output, such as `head`, has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EX_PIPE


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """Report the error and exit. After an invalid choice, suggest the nearest valid choice."""
        wrong = re.search(r"invalid choice: '(.*)' \(choose from (.*)\)", message)
        if wrong and (near := _nearest(wrong[1], wrong[2])):
            message = f"{message[: wrong.start()]}there is no '{wrong[1]}'; did you mean '{near}'?"
        super().error(message)


def _nearest(typed: str, listed: str) -> str:
    from difflib import get_close_matches

    known = [one.strip(" '") for one in listed.split(",")]
    return next(iter(get_close_matches(typed.lower(), known, n=1)), "")


def parser(arguments: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser of the subcommand that the first argument names.

    The other subcommands are left out, because importing them takes time that `outputs-off` does not
    have. If the first argument names no subcommand, return the parser of all subcommands, without their
    options.
    """
    if arguments and arguments[0] in COMMANDS:
        return _parser(arguments[:1], whole=True)
    return _parser(COMMANDS, whole=False)


def whole_parser() -> argparse.ArgumentParser:
    """Return the parser of every installed subcommand with its options. The manual page (`make man`)
    and the shell completion use this parser."""
    lacks = frozenset() if is_there("workbench") else WORKBENCH
    return _parser((name for name in COMMANDS if name not in lacks), whole=True)


def _parser(names: Iterable[str], whole: bool) -> argparse.ArgumentParser:
    top = _Parser(prog="rmf-bridge", description="Connect Open-RMF to lifts, doors and chargers.")
    top.add_argument("--version", action="version", version=f"rmf-bridge {VERSION}")
    subparsers = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name in names:
        text, example = COMMANDS[name]
        subparser = subparsers.add_parser(
            name,
            help=text,
            description=f"{text[0].upper()}{text[1:]}. Exit codes: {exit_codes.told(name)}.",
            epilog=f"example: rmf-bridge {example}",
        )
        subparser.set_defaults(usage=subparser.error)
        if whole:
            _module(name).add_arguments(subparser)
    return top


def split_ros_args(argv: list[str]) -> tuple[list[str], list[str]]:
    """Split the command line into our arguments and ROS's arguments. `--ros-args` begins ROS's
    arguments, and the next `--` ends them."""
    ours, ros = list[str](), list[str]()
    into = ours
    for argument in argv:
        if argument == "--ros-args":
            into = ros
        into.append(argument)
        if argument == "--" and into is ros:
            into = ours
    return ours, ros


def _module(command: str):  # type: ignore[no-untyped-def]
    name = f"commands.{command.replace('-', '_')}"
    if command in WORKBENCH:
        return of_workbench(f"workbench.{name}")
    return importlib.import_module(f"bridges.{name}")


if __name__ == "__main__":
    sys.exit(main())

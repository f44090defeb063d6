"""`rmf-bridge init FILE`: write a first YAML for the device in front of you.

The command takes answers from options, and asks for the rest. The new file passes `check`. The command
never overwrites a file.
"""

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Final, get_args

from bridges import __version__
from bridges.settings.building_map import BuildingMap, load_map
from bridges.settings.fleet_site import read_site
from bridges.settings.load import understood
from bridges.system.written import no_folder, not_written
from bridges.yaml.parsing import SettingsError
from workbench.commissioning.init import draft, gateway
from workbench.commissioning.init.answers import (
    LIFT_INPUTS,
    DraftAnswers,
    Encoding,
    Impossible,
    Kind,
    Level,
    Wiring,
)
from workbench.commissioning.init.questions import QUESTIONS, Given, Question

EX_USAGE, EX_NOINPUT, EX_CANTCREAT, EX_INTERRUPTED = 64, 66, 73, 130
TABLE: Final = (*gateway.PLACES, *gateway.NUMBERS, gateway.NO_CALL)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the argument for the file, and an option for each question."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the YAML to write")
    parser.add_argument("--kind", choices=get_args(Kind))
    parser.add_argument("--name", help="as on RMF's map; the robots of a fleet: AMR01,AMR02")
    parser.add_argument(
        "--wiring",
        choices=get_args(Wiring),
        help="modbus: contacts at a Modbus TCP module; gateway: registers of the device's controller",
    )
    parser.add_argument("--address", help="host, serial port or CAN interface")
    parser.add_argument("--unit", help="unit id of a Modbus module")
    parser.add_argument("--floors", help="the floors, from the lowest up, such as L1,L2,L3")
    parser.add_argument("--signals", help=f"some of: {', '.join(LIFT_INPUTS)}")
    parser.add_argument(
        "--encoding", choices=get_args(Encoding), help="the encoding of the floor lines"
    )
    parser.add_argument("--contacts", choices=get_args(Level), help="level of a closed contact")
    parser.add_argument("--relays", choices=get_args(Level), help="level that switches a relay on")
    for name, (part, offered) in gateway.PLACES.items():
        text = f"the register address of {part} on a gateway, such as {offered}"
        parser.add_argument(f"--{name.replace('_', '-')}", metavar="PLACE", help=text)
    for name, meanings in gateway.NUMBERS.items():
        text = f"a gateway's numbers for {meanings}, such as 0,1,2"
        parser.add_argument(f"--{name.replace('_', '-')}", metavar="N,N", help=text)
    text = "a gateway's number for no call, such as 0; no floor may have this number"
    parser.add_argument("--no-call-number", metavar="N", help=text)
    parser.add_argument("--fleet-config", metavar="FILE", help="RMF's config.yaml of the fleet")
    parser.add_argument("--graph", metavar="FILE", help="the fleet's navigation graph")
    parser.add_argument("--domain-id", help="RMF's ROS_DOMAIN_ID")
    parser.add_argument(
        "--from",
        dest="map",
        metavar="MAP",
        help="read the name and the floors from RMF's building map or navigation graph",
    )
    parser.add_argument(
        "-y", "--yes", action="store_true", help="ask nothing: accept every offered answer"
    )


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: the file was written.
    - 64: an answer is missing, or answers contradict each other.
    - 66: the map cannot be read.
    - 73: the file exists.
    """
    if os.path.lexists(args.file):  # checked first, so that nobody answers in vain
        return _there_already(args.file)
    if why := no_folder(args.file):
        return not_written(args.file, why)
    try:
        given = answered(args, load_map(args.map) if args.map else None)
    except SettingsError as error:
        print("\n".join(map(str, error.problems)), file=sys.stderr)
        return EX_NOINPUT
    except KeyboardInterrupt:
        print("nothing is written", file=sys.stderr)
        return EX_INTERRUPTED
    except Impossible as error:
        print(f"rmf-bridge init: {error}", file=sys.stderr)
        return EX_USAGE
    return _written(args.file, given)


def _there_already(file: Path) -> int:
    print(f"{file} already exists and is not changed: choose another name", file=sys.stderr)
    return EX_CANTCREAT


def _written(file: Path, given: Given) -> int:
    """Write the draft if `check` finds no error in the draft. Return the exit code."""
    try:
        text = draft(answers(given))
        config = understood(file, text.encode())
        if config.kind == "fleet":
            read_site(config)  # reads RMF's files of the fleet, and may raise SettingsError
        write(file, f"{_schema_line()}{text}")
    except SettingsError as error:
        told = "\n".join(problem.text for problem in error.problems)
        print(
            f"rmf-bridge init: with these answers, `check` would report:\n{told}", file=sys.stderr
        )
        return EX_USAGE
    except Impossible as error:
        print(f"rmf-bridge init: {error}", file=sys.stderr)
        return EX_USAGE
    except FileExistsError:
        return _there_already(file)
    except OSError as error:
        return not_written(file, error.strerror)
    print(f"{file} is written. Compare it with the wires; then:")
    print(f"  rmf-bridge check {file}\n  rmf-bridge run {file} --simulate")
    return 0


def answered(args: argparse.Namespace, found: BuildingMap | None) -> Given:
    """Return every answer. An answer comes from its option, or else from the map, or else from the
    person. Raises Impossible."""
    given: Given = {}
    for question in QUESTIONS:
        if not _needed(question, given, args):
            continue
        told = getattr(args, question.name)
        told = told if told is not None else _of_map(question.name, given, found)
        if told is None:
            offered = question.offered(given)
            told = offered if args.yes else _ask(question, offered, given, found)
        given[question.name] = told
    return given


def _needed(question: Question, given: Given, args: argparse.Namespace) -> bool:
    if question.needed(given):
        return True
    if getattr(args, question.name) is not None:
        raise Impossible(
            f"--{question.name.replace('_', '-')} does not apply"
            f" to a {given['kind']} on {given['wiring']}"
        )
    return False


def _of_map(name: str, given: Given, found: BuildingMap | None) -> str | None:
    """Return the answer if the map allows only one answer. Otherwise return None."""
    if found is None:
        return None
    if name == "name" and len(names := tuple(found.named.get(given["kind"], ()))) == 1:
        return names[0]
    if name == "floors":
        return ",".join(found.stops.get(given["name"], found.named["floor"]))
    return None


def _ask(question: Question, offered: str, given: Given, found: BuildingMap | None) -> str:
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        option = question.name.replace("_", "-")
        accept = f", or --yes for '{offered}'" if offered else ""
        raise Impossible(f"there is no terminal for questions: give --{option}{accept}")
    try:
        import questionary
    except ModuleNotFoundError:
        raise Impossible(
            "asking needs questionary: in the git clone of rmf-bridges run .venv/bin/pip install"
            " '.[laptop]'. Or give every answer as an option, or --yes"
        ) from None
    choices = question.choices(given)
    if found is not None and question.name == "name":
        choices = tuple(found.named.get(given["kind"], ()))
    if choices and question.several:
        ticked = offered.split(",")
        boxes = [questionary.Choice(c, checked=c in ticked) for c in choices]
        told = questionary.checkbox(question.text, boxes).unsafe_ask()
        return ",".join(told)
    if choices:
        first = offered if offered in choices else None
        return str(questionary.select(question.text, list(choices), default=first).unsafe_ask())
    asked = f"{question.text} [{offered}]" if offered else question.text
    return str(questionary.text(asked).unsafe_ask()) or offered


def answers(given: Given) -> DraftAnswers:
    """Convert the answers to the draft's types. Raises Impossible. The error's text gives the
    remedy."""
    told = dict(given)
    for name, most in (("unit", 247), ("domain_id", 232)):
        if name in told:
            told[name] = _number(name, told[name], most)
    if not told["name"].strip() or not told["name"].isprintable():
        raise Impossible(f"{told['name']!r} is not a name for a {told['kind']}")
    for name in ("floors", "signals"):
        if name in told:
            told[name] = tuple(part.strip() for part in told[name].split(",") if part.strip())
    if unknown := [signal for signal in told.get("signals", ()) if signal not in LIFT_INPUTS]:
        raise Impossible(
            f"a lift has no input {', '.join(unknown)}; its inputs are {', '.join(LIFT_INPUTS)}"
        )
    places = {name: told.pop(name) for name in TABLE if name in told}
    return DraftAnswers(**told, places=places)


def _number(name: str, text: str, most: int) -> int:
    least = 1 if name == "unit" else 0
    if not (text.isascii() and text.isdigit() and least <= int(text) <= most):
        raise Impossible(f"{name} is '{text}': write a whole number from {least} to {most}")
    return int(text)


def write(path: Path, text: str) -> None:
    """Write a new file. Raises OSError if the file exists or cannot be written."""
    with path.open("x", encoding="utf-8") as out:
        out.write(text)


def _schema_line() -> str:
    """Store this version's schema in the user's data directory. Return the comment line that names the
    schema for editors. Return "" if the schema cannot be stored."""
    from workbench.commissioning.json_schema import schema

    base = os.environ.get("XDG_DATA_HOME") or os.path.expanduser("~/.local/share")
    path = Path(base) / "rmf-bridges" / f"schema-{__version__}.json"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(schema()), encoding="utf-8")
    except OSError:
        return ""
    return f"# yaml-language-server: $schema={path}\n"

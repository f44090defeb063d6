"""Speaks to the plants of a running simulation by their control sockets (`hal_fakes/control.py`)."""

import argparse
import json
import os
import shlex
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from bridges.serve.places import as_told, by_hand

ANSWER_S = 5.0
Completer = Callable[..., list[str]]
"""As argcomplete calls it: with the prefix and what was typed so far."""


def add_simulation(parser: argparse.ArgumentParser) -> None:
    """The options that name a simulation and one of its devices."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the YAML that is simulated")
    parser.add_argument("--device", metavar="NAME", help="which device, if the file has several")
    parser.add_argument("--runtime-dir", metavar="DIR", help="the simulation's runtime directory")


def names(verb: str) -> Completer:
    """Completes what can `press` or `fail`, from the running simulation; nothing where none runs."""

    def complete(prefix: str, parsed_args: argparse.Namespace, **_: object) -> list[str]:
        found = set[str]()
        with suppress(OSError, ValueError):
            for path in _sockets(parsed_args):
                for device, known in json.loads(_ask(path, ["names"])).items():
                    if parsed_args.device in (None, device):
                        found |= set(known[verb])
        return sorted(found)

    return complete


def _sockets(args: argparse.Namespace) -> list[Path]:
    return sorted(_folder(args).glob("plant*.sock"))


def _folder(args: argparse.Namespace) -> Path:
    return (as_told(args.runtime_dir) or by_hand(args.file.absolute())).runtime


def obey(args: argparse.Namespace, verb: str, *words: str) -> int:
    """Send one command. 0; 1 if the simulation refuses it; 64, 69, 78: no device, simulation, YAML."""
    from bridges.commands.by_hand import NoDevice, device_of
    from bridges.settings.load import SettingsError, load

    try:
        device = args.device or device_of(load(args.file), None)
        answers = [_ask(path, [verb, device, *words]) for path in _sockets(args)]
    except (NoDevice, SettingsError) as error:
        print(error, file=sys.stderr)
        return os.EX_USAGE if isinstance(error, NoDevice) else os.EX_CONFIG
    except OSError as error:
        print(f"the simulation of {args.file} does not answer: {error}", file=sys.stderr)
        return os.EX_UNAVAILABLE
    if "ok" in answers:
        return 0
    if not answers:
        print(
            f"no simulation of {args.file} runs: there is no plant.sock in {_folder(args)}."
            f" Start one with rmf-bridge run {args.file} --simulate",
            file=sys.stderr,
        )
        return os.EX_UNAVAILABLE
    known = [one for one in answers if "no device" not in one] or answers
    print("\n".join(one.removeprefix("error ") for one in known), file=sys.stderr)
    return 1


def _ask(path: Path, words: list[str]) -> str:
    """The answer to one line: `ok` or `error TEXT`. Raises OSError."""
    with socket.socket(socket.AF_UNIX) as caller:
        caller.settimeout(ANSWER_S)
        caller.connect(str(path))
        caller.sendall(shlex.join(words).encode() + b"\n")
        with caller.makefile(encoding="utf-8") as lines:
            return lines.readline().strip()

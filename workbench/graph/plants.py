"""Talk to the simulated devices ("plants") of a running simulation. The plants have control sockets
(`hal_fakes/control.py`)."""

import argparse
import json
import os
import shlex
import socket
import sys
from contextlib import suppress
from pathlib import Path

from bridges.runtime.completers import Completer, completed_by, device_names
from bridges.system.directories import as_given, by_hand, opened

ANSWER_S = 5.0


def add_simulation(parser: argparse.ArgumentParser) -> None:
    """Add the options that name a simulation and one of its simulated devices."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the YAML that is simulated")
    device = parser.add_argument(
        "--device", metavar="NAME", help="which device, if the file has several"
    )
    completed_by(device, device_names)
    parser.add_argument("--runtime-dir", metavar="DIR", help="the simulation's runtime directory")


def names(verb: str) -> Completer:
    """Return a function that completes names on the command line of `press` or `fail`. A running
    simulation lists these names."""

    def complete(prefix: str, parsed_args: argparse.Namespace, **_: object) -> list[str]:
        found = set[str]()
        with suppress(OSError, ValueError):
            for path in _sockets(parsed_args):
                for device, known in json.loads(ask(path, ["names"])).items():
                    if parsed_args.device in (None, device):
                        found |= set(known[verb])
        return sorted(found)

    return complete


def _sockets(args: argparse.Namespace) -> list[Path]:
    with suppress(FileNotFoundError, NotADirectoryError), opened(_folder(args)):
        return sorted(_folder(args).glob("plant*.sock"))
    return []


def _folder(args: argparse.Namespace) -> Path:
    return (as_given(args.runtime_dir) or by_hand(args.file.absolute())).runtime


def tell(args: argparse.Namespace, verb: str) -> int:
    """Print the names of everything that `press` or `fail` can change, for each simulated device.
    Return 0, or 69 if no simulation runs."""
    try:
        answers = [json.loads(ask(path, ["names"])) for path in _sockets(args)]
    except (OSError, ValueError) as error:
        return _silent(args, error)
    if not answers:
        return _nobody(args)
    for answer in answers:
        for device, known in answer.items():
            if args.device in (None, device):
                print(f"{device}: {', '.join(known[verb]) or 'nothing'}")
    return 0


def obey(args: argparse.Namespace, verb: str, *words: str) -> int:
    """Send one command to the plant, and print the effect. Return the exit code.

    - 0: the plant obeyed.
    - 1: the plant refused.
    - 64: the device is unknown.
    - 69: no simulation runs.
    - 78: the YAML has an error.
    """
    from bridges.settings.load import SettingsError, load
    from workbench.graph.which_device import NoDevice, device_of

    try:
        device = args.device or device_of(load(args.file), None)
    except (NoDevice, SettingsError) as error:
        print(error, file=sys.stderr)
        return os.EX_USAGE if isinstance(error, NoDevice) else os.EX_CONFIG
    try:
        answers = [ask(path, [verb, device, *words]) for path in _sockets(args)]
    except OSError as error:
        return _silent(args, error)
    if "ok" in answers:
        print(f"{device}: {' '.join(words)}")
        return 0
    if not answers:
        return _nobody(args)
    known = [one for one in answers if "no device" not in one] or answers
    print("\n".join(one.removeprefix("error ") for one in known), file=sys.stderr)
    return 1


def _silent(args: argparse.Namespace, error: Exception) -> int:
    print(f"the simulation of {args.file} does not answer: {error}", file=sys.stderr)
    return os.EX_UNAVAILABLE


def _nobody(args: argparse.Namespace) -> int:
    print(
        f"no simulation of {args.file} runs: there is no plant.sock in {_folder(args)}."
        f" Start one with rmf-bridge run {args.file} --simulate",
        file=sys.stderr,
    )
    return os.EX_UNAVAILABLE


def ask(path: Path, words: list[str]) -> str:
    """Send one line, and return the answer, which is `ok` or `error TEXT`. Raises OSError."""
    with socket.socket(socket.AF_UNIX) as caller:
        caller.settimeout(ANSWER_S)
        caller.connect(str(path))
        caller.sendall(shlex.join(words).encode() + b"\n")
        with caller.makefile(encoding="utf-8") as lines:
            return lines.readline().strip()


MODES = ("off", "stuck", "slow", "garbage", "wrong", "ok")

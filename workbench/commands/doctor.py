"""`rmf-bridge doctor FILE`: find and explain the obstacles to a working bridge on this machine.

Run `doctor` on the target machine, before and after installing. Without `--kill-test`, the doctor only
reads. With `--kill-test`, the doctor switches one output. The doctor never opens a bus that a running
service uses. `commissioning/doctor/` has the examinations, with one file for each subject.
"""

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, TextIO

import msgspec
from msgspec.structs import replace

from bridges.kinds.shared.rmf_section import TRANSPORTS, overridden
from bridges.messages.words import printable
from bridges.runtime.completers import completed_by, device_names
from bridges.settings.load import Config, SettingsError, load
from bridges.system import log
from bridges.system.paint import bold, red
from workbench.commissioning.doctor.finding import Finding, exit_code
from workbench.graph.join import command_line, interruptible, seconds
from workbench.graph.which_device import NoDevice, device_of

if TYPE_CHECKING:
    from bridges.settings.building_map import BuildingMap

INTERRUPTED: Final = 130
LISTEN_S: Final = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `doctor`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML")
    parser.add_argument("--json", action="store_true", help="for programs")
    parser.add_argument(
        "--form",
        type=Path,
        metavar="OUT",
        help="also write the form of docs/how-to/hardware.md, which a person completes",
    )
    parser.add_argument(
        "--scan",
        action="store_true",
        help="ask every unit or node of a bus, not only 1 to 16; list the topics of a broker",
    )
    parser.add_argument(
        "--listen",
        type=seconds(0, 60),
        default=LISTEN_S,
        metavar="SECONDS",
        help="time (s) to hear RMF's graph (default 3; with 0, doctor does not join the graph)",
    )
    parser.add_argument(
        "--localhost", action="store_true", help="join the graph on the loopback interface only"
    )
    parser.add_argument("--domain-id", type=int, metavar="N", help="overrides the YAML's domain_id")
    parser.add_argument("--transport", choices=TRANSPORTS, help="overrides the YAML's transport")
    parser.add_argument(
        "--building-map",
        metavar="MAP",
        help="compare the names with this map or graph of RMF, as check does",
    )
    parser.add_argument(
        "--hardening",
        action="store_true",
        help="check the points of docs/how-to/harden.md instead: networks, files, users",
    )
    kill = parser.add_argument_group(
        "the kill test, the only part of doctor that switches an output on"
    )
    kill.add_argument(
        "--kill-test",
        action="store_true",
        help="hold one output on, kill the holding process, and see the output go off",
    )
    device = kill.add_argument(
        "--device", metavar="NAME", help="the output's device (default: the first)"
    )
    completed_by(device, device_names)
    kill.add_argument("--output", metavar="NAME", help="the output, by its name in walk")
    kill.add_argument("--yes", action="store_true", help="do not ask for confirmation")
    parser.add_argument("--runtime-dir", metavar="DIR", help="the daemon's runtime directory")


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: all is well.
    - 1: there are warnings or unknown facts.
    - 2: something is wrong.
    - 64: nobody confirmed the kill test, or there is no such output.
    - 78: the YAML has an error.
    """
    log.start("CRITICAL")  # no log of errors, because the findings report them
    try:
        config = load(args.file)
        config = replace(config, rmf=overridden(config.rmf, args))
        building = _building(args.building_map)
    except SettingsError as error:
        print("\n".join(map(str, error.problems)), file=sys.stderr)
        return os.EX_CONFIG
    if args.kill_test and (why := _not_confirmed(config, args)):
        print(why, file=sys.stderr)
        return os.EX_USAGE
    found: list[Finding] = []
    show = FindingsText(sys.stdout).show if not args.json else _nothing
    try:
        with interruptible():
            for one in _examined(config, building, args):
                found.append(one)
                show(one)
    except KeyboardInterrupt:
        return INTERRUPTED
    if args.json:
        print(json.dumps(msgspec.to_builtins(found)))
    return _form(config, found, args.form) if args.form else exit_code(found)


def _form(config: Config, found: Sequence[Finding], out: Path) -> int:
    from bridges.system.written import not_written
    from workbench.commissioning.doctor.form import form
    from workbench.commissioning.doctor.machine import Machine

    try:
        out.write_text(form(config, found, Machine()), encoding="utf-8")
    except OSError as error:
        return not_written(out, error.strerror)
    return exit_code(found)


def _building(file: str | None) -> "BuildingMap | None":
    if file is None:
        return None
    from bridges.settings.building_map import load_map

    return load_map(file)


def _not_confirmed(config: Config, args: argparse.Namespace) -> str:
    """Return the reason to refuse the kill test. Return "" if the person confirmed the kill test."""
    from workbench.commissioning.doctor.victim import step_called
    from workbench.commissioning.walk.steps import steps, untestable

    if why := untestable(config):
        return why
    try:
        args.device = device_of(config, args.device or next(iter(config.devices), None))
    except NoDevice as error:
        return str(error)
    if not steps(config, args.device):
        return f"{args.device} has no outputs to test by hand"
    step = step_called(config, args.device, args.output)
    if step is None:
        return f"{args.device} has no such output: rmf-bridge walk shows its outputs"
    text = f"{step.name} of {args.device} will be ON for some seconds. This output {step.does}."
    if args.yes:
        return ""
    if not sys.stdin.isatty():
        return f"{text} Write --yes if nobody can come to harm"
    print(f"{text} Nobody can come to harm? Type yes:", file=sys.stderr, end=" ", flush=True)
    return "" if sys.stdin.readline().strip().lower() == "yes" else "nothing was switched"


def _examined(
    config: Config, building: "BuildingMap | None", args: argparse.Namespace
) -> Iterator[Finding]:
    from workbench.commissioning.doctor.examination import Options, examined
    from workbench.commissioning.doctor.hardening import hardening
    from workbench.commissioning.doctor.machine import Machine

    if args.hardening:
        return hardening(config, Machine())
    asked = Options(
        runtime_dir=args.runtime_dir,
        whole_scan=args.scan,
        listen_s=args.listen,
        localhost=args.localhost,
        ros_args=args.ros_args,
        kill_test=(args.device, args.output) if args.kill_test else None,
        line=command_line(argparse.Namespace(**vars(args), config=args.file)),
    )
    return examined(config, building, Machine(), asked)


def _nothing(one: Finding) -> None:
    """Print nothing for this finding, because `run` prints all findings as JSON at the end."""


class FindingsText:
    """A printer of findings. A heading comes before the findings of each subject."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._subject = ""

    def show(self, one: Finding) -> None:
        """Print the finding's line. Below the line, print the finding's meaning and remedy."""
        if one.subject != self._subject:
            self._subject = one.subject
            print(bold(printable(one.subject), self._out), file=self._out)
        text = f"  {one.level:<8} {printable(one.found)}"
        print(red(text, self._out) if one.level == "wrong" else text, file=self._out)
        for word, said in (("means", one.means), ("do", one.do)):
            if said:
                print(f"           {word}: {printable(said)}", file=self._out)
        self._out.flush()

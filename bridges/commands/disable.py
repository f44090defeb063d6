"""`rmf-bridge disable NAME` stops a service, switches its outputs off, and disables it. The YAML
stays."""

import argparse
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from bridges.runtime.services import (
    INSTANCE,
    NO_INSTANCE,
    Remove,
    Run,
    Step,
    add_root,
    carry_out,
    drop_in_file,
    not_possible,
    service_name,
    services,
    switch_off,
    unit,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `disable`."""
    parser.add_argument("name", metavar="NAME", help="the service: a device YAML, or its name")
    add_root(parser)


def run(args: argparse.Namespace) -> int:
    """Return 0 if the service has stopped and its outputs are off. Return 64 if there is no such
    service, and 77 if the user is not root."""
    name = service_name(args.name)
    if not INSTANCE.fullmatch(name):
        print(NO_INSTANCE.format(name), file=sys.stderr)
        return os.EX_USAGE
    if code := not_possible(args):
        return code
    if name not in (known := services(args.root)):
        there = ", ".join(sorted(known)) or "none"
        print(f"no service {name}; there is {there}", file=sys.stderr)
        return os.EX_USAGE
    return carry_out(steps(name, args.root), args)


def steps(name: str, root: Path) -> Iterator[Step]:
    """Yield the steps that disable the service, in order."""
    yield Run(("systemctl", "stop", unit(name)), running_only=True)
    yield Run(("systemctl", "disable", unit(name)))
    yield switch_off(name)
    yield Remove(root / drop_in_file(name))
    yield Run(("systemctl", "daemon-reload"), running_only=True)

"""`rmf-bridge check FILE...`: the problems of device YAMLs, or their wiring as a table.

The table is for the person at the terminal block: each signal with every spelling of its point, its
level at rest, and what it reads when its wire breaks.
"""

import argparse
import os
import sys
import unicodedata
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec

from bridges.core.graph_kind import GraphKind
from bridges.settings import names as named
from bridges.settings.building_map import BuildingMap, load_map
from bridges.settings.load import Config, Problem, SettingsError, load
from bridges.settings.map_names import mismatches, places
from drivers.hal.points import Wire

HEADINGS = (
    "device",
    "signal",
    "point",
    "direction",
    "active",
    "pull",
    "debounce",
    "at rest",
    "wire broken",
)
BROKEN = {True: "asserted", False: "not asserted", None: "floats"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `check`."""
    parser.add_argument("files", nargs="+", metavar="FILE", help="a device YAML")
    parser.add_argument(
        "-q", "--quiet", action="store_true", help="print problems only: no table, no warning"
    )
    parser.add_argument(
        "--building-map",
        metavar="MAP",
        help="compare the names with RMF's: a *.building.yaml, or a navigation graph",
    )


def run(args: argparse.Namespace) -> int:
    """Check every file. Returns 0, or 78 (EX_CONFIG) if any has a problem."""
    try:
        building = load_map(args.building_map) if args.building_map else None
    except SettingsError as error:
        _print_problems(args.building_map, error.problems)
        return os.EX_CONFIG
    right = [_check(file, args.quiet, building) for file in args.files]
    return 0 if all(right) else os.EX_CONFIG


def _check(file: str, quiet: bool, building: BuildingMap | None) -> bool:
    try:
        config = load(file)
    except SettingsError as error:
        _print_problems(file, error.problems)
        return False
    problems = mismatches(config, building) if building else []
    if not quiet:
        _complain(map(str, config.warnings))
        lines = described(config)
        if building and not problems:
            lines += [_agreement(config, building), ""]
        lines += map(str, config.notes)
        sys.stdout.write("\n".join(lines) + "\n")
    if problems:
        _print_problems(file, problems)
    return not problems


def _agreement(config: Config, building: BuildingMap) -> str:
    names = ", ".join(dict.fromkeys(name for _, _, name in places(config)))
    if not names:
        return f"this file uses no names that {building.file} could confirm"
    return f"same names as in {building.file}: {names}"


def _print_problems(file: str, problems: Sequence[Problem]) -> None:
    many = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
    _complain([*map(str, problems), f"{file}: {many}"])


def _complain(lines: Iterable[str]) -> None:
    """To stderr, in order with stdout: both often end in one log."""
    sys.stdout.flush()
    sys.stderr.writelines(f"{line}\n" for line in lines)


def described(config: Config) -> list[str]:
    """A valid file as lines: its kind and driver, and its wiring or what it talks to."""
    if config.section is not None:
        kind = named.kind_called(config.kind)
        assert isinstance(kind, GraphKind)
        rows = (kind.described or _numbers)(config.section)
        return [f"{config.path}: {config.kind}", "", *aligned(rows), ""]
    lines = [f"{config.path}: {config.kind}, driver {config.driver}"]
    for bus in config.buses:
        devices = config.devices_on(bus)
        lines += ["", f"bus {bus} ({config.bus_types[bus]})", *_bus(config, bus, devices)]
    return [*lines, ""]


def _numbers(section: Any) -> list[tuple[str, ...]]:
    return [
        (key, "-" if value is None else str(value))
        for key, value in msgspec.to_builtins(section).items()
    ]


def _bus(config: Config, bus: str, devices: Sequence[str]) -> list[str]:
    """The wires of its devices, and what those say that have none."""
    wires = [(name, wire) for name in devices for wire in config.wires(name)]
    point = config.bus_type(bus).describe
    table = [_row(name, wire, point(wire.point)) for name, wire in wires]
    rows = [row for name in devices for row in _described(config, name, bus)]
    return [*aligned([HEADINGS, *table] if table else []), *aligned(rows)]


def _described(config: Config, name: str, bus: str) -> list[tuple[str, str, str]]:
    describe = config.driver_type(name).describe
    rows = [(name, *row) for row in describe(config.devices[name], config.buses[bus])]
    return rows if rows or config.wires(name) else [(name, "", "")]


def _row(device: str, wire: Wire, point: str) -> tuple[str, ...]:
    """One wire. `point`: as the bus describes it; the YAML's spelling is added if it differs."""
    spelled = point if f" {wire.point} " in f" {point} " else f"{wire.point} = {point}"
    if wire.flash is not None:
        spelled += f", {wire.flash.on_s:g} s by the module at {wire.flash.point}"
    is_input = wire.direction == "in"
    return (
        device,
        wire.signal,
        spelled,
        wire.direction,
        wire.active,
        wire.pull or "-",
        _debounce(wire) if is_input else "-",
        "-" if is_input else ("high" if wire.level(False) else "low"),
        BROKEN[wire.broken_reads()],
    )


def _debounce(wire: Wire) -> str:
    return "default" if wire.debounce_s is None else f"{wire.debounce_s:g} s"


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of equal length as lines with aligned columns."""
    widths = [max(map(_width, column)) for column in zip(*rows, strict=True)]
    return [
        "".join(f"  {c}{' ' * (w - _width(c))}" for c, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _width(text: str) -> int:
    """Columns on a terminal: 走 takes two."""
    return sum(2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)

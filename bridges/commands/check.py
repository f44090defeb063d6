"""`rmf-bridge check FILE...` prints the errors of device YAMLs. For a valid YAML it prints a wiring
table that a person can sign.

The command checks each file alone, and then all files together
(`bridges/settings/cross_file_checks.py`). It prints the findings
(`bridges/settings/sheets/findings.py`) as text or JSON, or writes them as a sheet.
"""

import argparse
import os
import shutil
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import msgspec

from bridges.settings.cross_file_checks import ExclusiveUse, Found, across
from bridges.settings.load import Config, Problem, SettingsError, load
from bridges.settings.named_files import CERTIFICATES, named_files
from bridges.settings.sheets import text
from bridges.settings.sheets.findings import Findings, findings, wrong
from bridges.system.columns import columns_of, hanging
from bridges.system.written import not_written

if TYPE_CHECKING:
    from bridges.settings.building_map import BuildingMap

COORDINATOR, FLEET = "charger_coordinator", "fleet"
NAMED_BY_GRAPH = ("lift", "door", "charger", COORDINATOR)
RENEW = "after that time no TLS connection succeeds: renew the certificate, and restart the daemon"
NOTHING_BESIDE = (
    "this file is compared with YAMLs of a charger coordinator or lifts, and no such YAML is given"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `check`."""
    parser.add_argument("files", nargs="+", metavar="FILE", help="a device YAML")
    parser.add_argument(
        "-q", "--quiet", action="store_true", help="print problems only: no table, no warning"
    )
    parser.add_argument(
        "--building-map",
        metavar="MAP",
        help="compare the names with RMF's map: a *.building.yaml, or a navigation graph",
    )
    parser.add_argument(
        "--fleet-config",
        metavar="CONFIG",
        action="append",
        default=[],
        help="compare a charger coordinator and lifts with a fleet adapter's config.yaml. If"
        " --building-map is a navigation graph, also compare the positions. Give this option once for"
        " each fleet",
    )
    parser.add_argument(
        "--several-machines",
        action="store_true",
        help="the files run on several machines, so the same pin or port in two files is no mistake",
    )
    parser.add_argument(
        "--json", action="store_true", help="print the findings as JSON, and nothing else"
    )
    parser.add_argument(
        "--sheet",
        metavar="FILE.html",
        help="write the commissioning sheet, with a page for each controller",
    )


def run(args: argparse.Namespace) -> int:
    """Check every file and return the exit code."""
    try:
        building = _building(args.building_map)
    except SettingsError as error:
        return _tell([wrong(args.building_map, error.problems)], args)
    right, found = _read(args.files, building)
    for file in args.fleet_config:
        found |= _beside_fleet(file, right, found, building)
    for file in [file for file, (config, _) in right.items() if config.kind == FLEET]:
        found |= _of_fleet(file, right, found)
    configs = [config for config, _ in right.values()]
    together = across(configs, not args.several_machines)
    together.warnings.extend(_certificates(configs))
    files = [_with(found[file], together) for file in args.files]
    return _tell(files, args)


def _building(file: str | None) -> "BuildingMap | None":
    if file is None:
        return None
    from bridges.settings.building_map import load_map

    return load_map(file)


def _read(
    files: Sequence[str], building: "BuildingMap | None"
) -> tuple[dict[str, tuple[Config, Findings]], dict[str, Findings]]:
    """Read each file once. Return the valid files, and the findings on all files."""
    right: dict[str, tuple[Config, Findings]] = {}
    found: dict[str, Findings] = {}
    for file in dict.fromkeys(files):
        try:
            config = load(file)
        except SettingsError as error:
            found[file] = wrong(file, error.problems)
        else:
            found[file] = findings(config, *_against(config, building))
            right[file] = config, found[file]
    return right, found


def _against(config: Config, building: "BuildingMap | None") -> tuple[list[Problem], list[str]]:
    """Compare a file's names with the names on the map. Return the problems and the notes."""
    if building is None:
        return [], []
    from bridges.settings.map_names import mismatches, places

    problems = mismatches(config, building)
    names = ", ".join(dict.fromkeys(name for _, _, name in places(config)))
    if problems:
        return problems, []
    if not names:
        return [], [f"this file has no names to compare with {building.file}"]
    return [], [f"same names as in {building.file}: {names}"]


def _of_fleet(
    file: str, right: Mapping[str, tuple[Config, Findings]], found: Mapping[str, Findings]
) -> dict[str, Findings]:
    """Compare a fleet's YAML with RMF's two files (config and graph) that this YAML names.

    Compare the YAMLs of the coordinator and the lifts with RMF's two files too. Return the findings on
    all these YAMLs.
    """
    from bridges.settings.building_map import load_map
    from bridges.settings.fleet_site import read_site

    try:
        site = read_site(right[file][0])
        graph = load_map(site.graph_file)
    except SettingsError as error:
        return {file: _more(found[file], errors=error.problems)}
    told_of = {file: _more(found[file], notes=list(site.notes()))}
    beside = [one for one, (config, _) in right.items() if config.kind in (COORDINATOR, "lift")]
    if beside:
        told_of |= _beside_fleet(site.config_file, right, {**found, **told_of}, graph)
    for other, (config, _) in right.items():
        if config.kind in NAMED_BY_GRAPH:
            errors, notes = _against(config, graph)
            before = told_of.get(other, found[other])
            told_of[other] = _more(before, errors, notes=notes)
    return told_of


def _beside_fleet(
    file: str,
    right: Mapping[str, tuple[Config, Findings]],
    found: Mapping[str, Findings],
    building: "BuildingMap | None",
) -> dict[str, Findings]:
    """Compare the YAML of each coordinator and lift with a fleet adapter's `config.yaml`. Return the
    findings on these YAMLs, together with the earlier findings."""
    from bridges.settings.fleet_config import load_fleet
    from bridges.settings.fleet_names import compared, emergency_levels

    ours = {f: config for f, (config, _) in right.items() if config.kind in (COORDINATOR, "lift")}
    try:
        fleet = load_fleet(file)
    except SettingsError as error:
        first = next(iter(ours or found))
        return {first: _more(found[first], errors=error.problems)}
    if not ours:
        first = next(iter(found))
        return {first: _more(found[first], errors=[fleet.problem((), NOTHING_BESIDE)])}
    told_of = {}
    for name, config in ours.items():
        of_lift = config.kind == "lift"
        beside = emergency_levels(config, fleet) if of_lift else compared(config, fleet, building)
        told_of[name] = _more(found[name], beside.errors, beside.warnings, beside.notes)
    return told_of


def _more(
    file: Findings,
    errors: Sequence[Problem] = (),
    warnings: Sequence[Problem] = (),
    notes: Sequence[str] = (),
) -> Findings:
    return msgspec.structs.replace(
        file,
        errors=[*file.errors, *errors],
        warnings=[*file.warnings, *warnings],
        notes=[*file.notes, *notes],
    )


def _certificates(configs: Iterable[Config]) -> Iterator[Problem]:
    """Yield a warning for each certificate that has expired or expires soon.

    If the date is unknown, yield nothing, because `check` may run on another machine than the daemon.
    """
    uses = [
        ExclusiveUse(config, file, path)
        for config in configs
        for path, file in named_files(config, CERTIFICATES)
    ]
    if not uses:
        return
    from bridges.system.certificates import SOON_S, CertificateReader, told

    reader, now = CertificateReader(), time.time()
    for use in uses:
        end = reader.end(use.what)
        if end.at is not None and end.at < now + SOON_S:
            yield use.problem(f"warning: {told(use.what, end, now)}: {RENEW}")


def _with(file: Findings, together: Found) -> Findings:
    """Return a file's findings, and add the results of the comparison with the other files."""
    return _more(
        file,
        [p for p in together.errors if p.file == file.file],
        [p for p in together.warnings if p.file == file.file],
    )


def _tell(files: Sequence[Findings], args: argparse.Namespace) -> int:
    """Print the findings, and write the sheet if `--sheet` asks for it. Return the exit code."""
    errors = sum(len(file.errors) for file in files)
    code = os.EX_CONFIG if errors else 0
    if args.json:
        from bridges.settings.sheets.as_json import document

        sys.stdout.write(document(files, *_counts(files)))
    else:
        for file in files:
            _print(file, args.quiet)
        _verdict(files, args.quiet)
    return _write_sheet(files, args.sheet) or code if args.sheet and not errors else code


def _counts(files: Sequence[Findings]) -> tuple[int, int]:
    return sum(len(f.errors) for f in files), sum(len(f.warnings) for f in files)


def _print(file: Findings, quiet: bool) -> None:
    if not quiet:
        _complain(map(str, file.warnings))
        if file.kind:
            sys.stdout.write(
                "\n".join(text.lines(file, shutil.get_terminal_size((200, 24)).columns)) + "\n"
            )
    _complain(map(str, file.errors))


def _verdict(files: Sequence[Findings], quiet: bool) -> None:
    """Print the last line, which is `OK` or the number of errors."""
    errors, warnings = _counts(files)
    also = f", {_many(warnings, 'warning')}" if warnings else ""
    if errors:
        _complain([f"{_many(errors, 'error')}{also}"])
    elif not quiet:
        sys.stdout.write(f"OK{also}\n")


def _many(number: int, what: str) -> str:
    return f"1 {what}" if number == 1 else f"{number} {what}s"


def _complain(lines: Iterable[str]) -> None:
    """Write lines to stderr. Wrap long lines only if stderr is a terminal.

    Flush stdout first. Both streams often go to one log, whose lines must be in order.
    """
    sys.stdout.flush()
    columns = columns_of(sys.stderr)
    for line in lines:
        shown = hanging(line, columns) if columns else [line]
        sys.stderr.writelines(f"{one}\n" for one in shown)


def _write_sheet(files: Sequence[Findings], path: str) -> int:
    """Write the commissioning sheet. Return 0, or another exit code if writing fails."""
    from bridges.settings.sheets.html import page

    try:
        with open(path, "w", encoding="utf-8") as sheet:
            sheet.write(page(files))
    except OSError as error:
        return not_written(path, error.strerror)
    return 0

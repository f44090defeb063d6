"""The names on which users rely: YAML keys, commands, options, exit codes, JSON, topics, faults and
metrics.

`promised.txt` has one name in each line. Within a major version no line is removed. `make reference`
adds new lines.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import msgspec

from bridges import cli
from bridges.exit_codes import EXIT_CODES
from bridges.messages import topics
from bridges.observe.all_devices import PlainGraph
from bridges.observe.requesters import Moment
from bridges.observe.tally import SiteTally
from bridges.runtime import faults
from bridges.runtime.daemons import DaemonStatus
from bridges.settings.sheets.findings import Findings
from bridges.system.certificates import CertificateReader
from workbench.commissioning import json_schema
from workbench.commissioning.doctor.finding import Finding
from workbench.explain.explanation import Explanation
from workbench.graph.board import BoardRow
from workbench.metrics import families, machine

JSON: Final = {
    "check": Findings,
    "doctor": Finding,
    "explain": Explanation,
    "status": DaemonStatus,
    "watch": BoardRow,
}
"""The struct that each command prints with `--json`. `judge`, `replay` and `log` have no struct
here."""
ENDINGS: Final = {"counter": "_total", "info": "_info"}
"""What Prometheus' text format adds to the name of a metric of this type."""
FILE: Final = Path(__file__).with_suffix(".txt")


def promised() -> list[str]:
    """Return the lines of `promised.txt`."""
    return FILE.read_text().splitlines()


def present() -> set[str]:
    """Return the names of this version, as lines."""
    schema = json_schema.schema()
    keys = {f"key {path}" for path in _keys(schema, schema, ())}
    codes = {f"exit {name} {code}" for name, codes in EXIT_CODES.items() for code in codes}
    told = {f"json {name} {path}" for name, shape in JSON.items() for path in _fields(shape)}
    ours = {f"topic {topic.name}" for topic in topics.every()}
    codes |= {f"fault {code}" for code in faults.remedies()}
    return keys | codes | told | ours | {*_metrics(), *_options(cli.whole_parser(), "rmf-bridge")}


def _metrics() -> Iterator[str]:
    """Yield a line for each metric of the exporter, and for each of its labels."""
    found = [
        *families.of_graph(PlainGraph(), SiteTally(), Moment(0.0, 0.0)),
        *machine.of_machine(()),
        *machine.of_certificates((), (), CertificateReader().end),
        *machine.of_recordings(Path(__file__).parent),
    ]
    for family in found:
        name = family.name + ENDINGS.get(family.type, "")
        yield f"metric {name}"
        labels: tuple[str, ...] = getattr(family, "_labelnames", ())
        yield from (f"metric {name} {label}" for label in labels)


def _fields(shape: type) -> Iterator[str]:
    schema = msgspec.json.schema(shape)
    found = _keys(schema, schema, ())
    # leave out `headings`, which only leads to the keys of a row
    return (path for path in found if not path.endswith(".headings"))


def _keys(node: Any, root: Any, path: tuple[str, ...]) -> Iterator[str]:
    """Yield the path of each key. `*` stands for a name that the user chooses."""
    if isinstance(node, list):
        for one in node:
            yield from _keys(one, root, path)
    if not isinstance(node, dict):
        return
    if "$ref" in node:
        yield from _keys(_component(root, node["$ref"]), root, path)
    for word in ("anyOf", "oneOf", "allOf", "then", "else", "items", "prefixItems"):
        yield from _keys(node.get(word), root, path)
    for name, inner in node.get("properties", {}).items():
        yield ".".join((*path, name))
        yield from _keys(inner, root, (*path, name))
    yield from _keys(node.get("additionalProperties"), root, (*path, "*"))


def _component(root: Any, ref: str) -> Any:
    for part in ref.removeprefix("#/").split("/"):
        root = root[part]
    return root


def _options(parser: argparse.ArgumentParser, name: str) -> Iterator[str]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, inner in action.choices.items():
                yield f"command {name} {word}"
                yield from _options(inner, f"{name} {word}")
        else:
            names = action.option_strings or [f"{action.metavar or action.dest}"]
            yield from (f"option {name} {word}" for word in names)


def add() -> None:
    """Add the names of this version to the file."""
    FILE.write_text("".join(f"{line}\n" for line in sorted({*promised(), *present()})))

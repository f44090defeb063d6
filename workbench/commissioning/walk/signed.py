"""The record of a walk (`rmf-bridge walk`), as Markdown and JSON. The record has the file, the tests,
the results and a place for the signature."""

import hashlib
import json
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from bridges import VERSION
from bridges.system.files import replace
from workbench.commissioning.walk.bench import ContactReading
from workbench.commissioning.walk.core import WalkMemory, WalkStep

NOT_TRIED = "not tried"


def record(
    file: Path,
    device: str,
    by: str,
    at: datetime,
    *,
    inputs: Sequence[ContactReading],
    steps: Sequence[WalkStep],
    memory: WalkMemory,
    end: str,
    simulated: bool,
) -> dict[str, Any]:
    """Return the record. `at` is the start of the walk. `end` tells how the walk ended, or that the
    walk still goes on."""
    return {
        "file": str(file),
        "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
        "version": VERSION,
        "device": device,
        "simulated": simulated,
        "by": by,
        "begun": at.isoformat(timespec="seconds"),
        "end": end,
        "inputs": [
            {"signal": one.wire.signal, "point": one.wire.point, "seen": _seen(one)}
            for one in inputs
        ],
        "outputs": [
            {
                "output": step.name,
                "expected": step.expects,
                "seen": memory.results.get(i, NOT_TRIED),
            }
            for i, step in enumerate(steps)
        ],
    }


def _seen(one: ContactReading) -> str:
    words = [word for value, word in ((True, "on"), (False, "off")) if value in one.seen]
    return " and ".join(words) or "never read"


def markdown(record: dict[str, Any]) -> str:
    """Format the record for people. At the end there is space for a signature."""
    practice = " on fake hardware: practice, no commissioning" if record["simulated"] else ""
    lines = [
        f"# Walk of {record['device']}{practice}",
        "",
        f"- file: `{record['file']}` (sha256 `{record['sha256']}`), rmf-bridges {record['version']}",
        f"- begun {record['begun']} by {record['by']}; {record['end']}",
        "",
        "| input | wire | seen |",
        "|---|---|---|",
        *(f"| {one['signal']} | {one['point']} | {one['seen']} |" for one in record["inputs"]),
        "",
        "| output | should be seen | seen |",
        "|---|---|---|",
        *(f"| {one['output']} | {one['expected']} | {one['seen']} |" for one in record["outputs"]),
        "",
        *(() if record["simulated"] else ("Signed:", "")),
    ]
    return "\n".join(lines)


def write(path: Path, record: dict[str, Any]) -> None:
    """Replace the files `path`.md and `path`.json. Raises OSError."""
    replace(path.with_suffix(".md"), markdown(record).encode())
    replace(path.with_suffix(".json"), json.dumps(record, indent=2).encode())

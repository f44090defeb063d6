"""The figures that the project promises, their aims, and the best earlier figures of the same machine
type.

bench/results/history.jsonl has a line for each run on a quiet machine.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

LOSS = 1.15
"""The ratio to the best earlier figure. A figure above this ratio is reported as a loss."""
LEAST_LOSS = 0.05
"""The least difference that is reported as a loss. The kernel counts CPU time in steps of 0.01 s, so a
smaller difference may be noise."""
LIFT, DOOR, CHARGER = "lift_dry_contact", "door_modbus", "charger_http"
BARE = "bare node on dds"

Figure = tuple[str, tuple[str, ...], tuple[str, ...] | None, float]
"""A title, the keys of a figure, the keys of the figure by which it is divided (or None), and the
aim."""


def _latency(what: str, wire: str, aim: float) -> Figure:
    row = f"{what} on {wire}"
    return f"{row}, times the round trip", ("latency", "latency", row, "p50 ratio"), None, aim


def _idle(what: str, device: str, column: str, aim: float) -> Figure:
    by = ("idle", "idle", BARE, column) if column == "ready s" else None
    return f"{what} {device}", ("idle", "idle", device, column), by, aim


FIGURES: list[Figure] = [
    *(_latency("LiftRequest to relay edge", wire, 1.2) for wire in ("dds", "zenoh")),
    *(_latency("gpiozero's callback to LiftState", wire, 1.5) for wire in ("dds", "zenoh")),
    _idle("ready, times a bare node,", LIFT, "ready s", 1.3),
    _idle("ready, times a bare node,", DOOR, "ready s", 1.6),
    _idle("ready, times a bare node,", CHARGER, "ready s", 1.5),
    _idle("RSS in MB", LIFT, "RSS MB", 39),
    _idle("RSS in MB", DOOR, "RSS MB", 38),
    _idle("RSS in MB", CHARGER, "RSS MB", 42),
    _idle("idle CPU in %", LIFT, "CPU %", 0.5),
    _idle("idle CPU in %", DOOR, "CPU %", 0.5),
    ("CPU in % of 200 doors", ("idle", "doors on one gateway", "200", "CPU %"), None, 15),
]


def table(figures: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of the table of promised figures. Leave out figures that were not measured."""
    yield f"{'promised':64}{'aim':>8}{'seen':>8}"
    for title, seen, aim in _promised(figures):
        yield f"{title:64}{aim:>8g}{seen:>8.2f}"


def losses(figures: dict[str, Any], folder: Path) -> Iterator[str]:
    """Yield a line for each figure that is worse than the best earlier figure of the same machine
    type."""
    like = [run for run in _kept(folder) if run["machine"] == figures["machine"]]
    for title, seen, _ in _promised(figures):
        before = [(run["seen"][title], run["commit"]) for run in like if title in run["seen"]]
        if not before:
            continue
        best, commit = min(before)
        if seen > best * LOSS and seen - best > LEAST_LOSS:
            yield f"LOSS: {title} was {best:.2f} at {commit}, and is {seen:.2f}"


def keep(figures: dict[str, Any], folder: Path) -> None:
    """Add a run to the history."""
    run = {key: figures[key] for key in ("machine", "date", "host", "commit")}
    seen = {title: value for title, value, _ in _promised(figures)}
    with (folder / "history.jsonl").open("a") as history:
        history.write(json.dumps({**run, "seen": seen}) + "\n")


def _kept(folder: Path) -> list[dict[str, Any]]:
    file = folder / "history.jsonl"
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def _promised(figures: dict[str, Any]) -> Iterator[tuple[str, float, float]]:
    """Yield the title, the figure and the aim of each measured figure."""
    for title, keys, by, aim in FIGURES:
        seen = _at(figures, keys)
        divisor = 1.0 if by is None else _at(figures, by)
        if seen is not None and divisor:
            yield title, seen / divisor, aim


def _at(figures: Any, keys: tuple[str, ...]) -> float | None:
    for key in keys:
        if key not in figures:
            return None
        figures = figures[key]
    return float(figures)

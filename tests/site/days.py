"""`python -m tests.site.days --seeds 20` runs a day for each seed and each kind of supervisors.

Each day runs in its own process, which prints its memory use every hour. The output stays in
`build/soak`. A day whose output is already there is not run again. At the end the command prints a
table of all days.
"""

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec

from tests.site.day import SUPERVISORS

HELD = "every law held"
COUNTS = re.compile(r"(\d+) (doors|rides|dispensings|restart)\b")
MEMORY = re.compile(r"^ +([\d.]+) h .* ([\d.]+) MB$", re.MULTILINE)


class PlayedDay(msgspec.Struct, frozen=True):
    """One day. `memory_mb`: the memory after the first hour and at the end (MB). `why`: the broken law,
    or "" if no law was broken."""

    rmf: str
    seed: int
    hours: float
    counts: dict[str, int]
    troubles: int
    memory_mb: tuple[float, float]
    why: str


def main(argv: Sequence[str] | None = None) -> int:
    """Run the missing days, and print the table. Return 1 if a day broke a law, if a resource grew, or
    if a day has no result."""
    parser = argparse.ArgumentParser(prog="python -m tests.site.days", description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="the seeds 1 to this number")
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--rmf", choices=SUPERVISORS, help="only the days under these rules")
    parser.add_argument("--only-table", action="store_true", help="play no day")
    parser.add_argument("--kept", type=Path, default=Path("build/soak"))
    options = parser.parse_args(argv)
    parties = [options.rmf] if options.rmf else SUPERVISORS
    options.kept.mkdir(parents=True, exist_ok=True)
    for seed in range(1, options.seeds + 1):
        for rmf in parties:
            if not options.only_table:
                _play(
                    options.kept / f"{rmf}-{seed}-{options.hours:g}h.txt", seed, rmf, options.hours
                )
    days = [*_days(options.kept, options.hours)]
    sys.stdout.write("\n".join(_table(days, parties)) + "\n")
    return int(any(day.why for day in days))


def _play(kept: Path, seed: int, rmf: str, hours: float) -> None:
    if kept.exists():
        return
    day = ["tests.site", "--seed", str(seed), "--hours", str(hours), "--rmf", rmf]
    played = subprocess.run([sys.executable, "-m", *day], stdout=subprocess.PIPE, text=True)
    if played.returncode in (0, 1):  # else the process was ended
        kept.write_text(played.stdout)
        sys.stderr.write(f"{kept.name}: {played.stdout.strip().splitlines()[-1]}\n")


def _days(kept: Path, hours: float) -> Iterator[PlayedDay]:
    """Yield the days of this length whose output is in the folder."""
    for path in sorted(kept.glob(f"*-{hours:g}h.txt")):
        rmf, seed, _ = path.stem.split("-")
        text = path.read_text()
        counts = {what: int(count) for count, what in COUNTS.findall(text)}
        trouble = re.search(r"^trouble: (.*)$", text, re.MULTILINE)
        troubles = sum(map(int, re.findall(r"\d+", trouble[1]))) if trouble else 0
        looks = [float(mb) for _, mb in MEMORY.findall(text)] or [0.0]
        broken = re.search(r"^BROKEN (.*)$", text, re.MULTILINE)
        why = "" if HELD in text else broken[1] if broken else "no verdict"
        yield PlayedDay(rmf, int(seed), hours, counts, troubles, (looks[0], looks[-1]), why)


def _table(days: Sequence[PlayedDay], parties: Sequence[str]) -> Iterator[str]:
    """Yield the lines of the table. Then yield a line for each day that broke a law or has no
    result."""
    columns = (
        "supervisors, seeds that broke no law, rides, doors, deliveries, faults, restarts, memory"
    )
    yield f"| {columns.replace(',', ' |')} |"
    yield "|---|---|---|---|---|---|---|---|"
    for rmf in parties:
        held = [day for day in days if day.rmf == rmf and not day.why]
        if held:
            yield _row(rmf, held)
    for day in days:
        if day.why:
            yield f"{day.rmf}, seed {day.seed}: {day.why}"


def _row(rmf: str, held: Sequence[PlayedDay]) -> str:
    seeds = ", ".join(str(seed) for seed in sorted(day.seed for day in held))
    sums = [
        sum(day.counts.get(what, 0) for day in held) for what in ("rides", "doors", "dispensings")
    ]
    restarts = sum(day.counts.get("restart", 0) for day in held)
    grown = max(day.memory_mb[1] - day.memory_mb[0] for day in held)
    most = max(day.memory_mb[1] for day in held)
    faults = sum(day.troubles for day in held)
    numbers = " | ".join(f"{number:,}" for number in (*sums, faults, restarts))
    return f"| {rmf} | {seeds} | {numbers} | at most {most:.1f} MB, {grown:+.1f} MB in the day |"


if __name__ == "__main__":
    sys.exit(main())

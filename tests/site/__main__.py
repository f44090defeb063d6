"""`python -m tests.site --seed 7 --hours 24` runs one simulated day.

If a rule of `laws.py` is broken or a resource grows, the exit code is 1. Then the command prints how to
run the same day again.
"""

import argparse
import secrets
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from tests.site.building import SITE, hospital
from tests.site.day import SUPERVISORS, Site
from tests.site.growth import growth
from tests.site.laws import Broken
from tests.site.saved import OtherCode, load, save
from tests.site.timeline import HOUR_S

SHIFT_H = 2.0


def main(argv: Sequence[str] | None = None) -> int:
    """Run one simulated day. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.site", description=__doc__)
    parser.add_argument("--seed", type=int, help="seed of the day; by default random")
    parser.add_argument("--hours", type=float, default=24.0, help="simulated hours, at least 0.3")
    parser.add_argument(
        "--rmf",
        choices=SUPERVISORS,
        help="supervisors: ours, or RMF's of kilted or jazzy; by default the seed decides",
    )
    parser.add_argument(
        "--kill-every",
        type=float,
        metavar="S",
        help="kill RMF's lift supervisor every S seconds, and cause no other trouble",
    )
    parser.add_argument(
        "--size",
        type=int,
        nargs=4,
        metavar=("LIFTS", "DOORS", "CHARGERS", "ROBOTS"),
        help="a larger site; by default 2 lifts, 5 doors, 3 chargers and 5 robots",
    )
    parser.add_argument(
        "--saved",
        type=Path,
        metavar="FILE",
        help=f"play shifts of {SHIFT_H:g} h, keep the site in this file, and go on from there",
    )
    parser.add_argument("--log", type=int, default=60, help="log lines printed after a failure")
    options = parser.parse_args(argv)
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    if options.hours < 0.3:
        parser.error("less than 0.3 hours is no day")
    if options.kill_every and options.rmf not in SUPERVISORS[1:]:
        parser.error("--kill-every needs --rmf kilted or jazzy")
    began = time.perf_counter()
    if options.saved and options.saved.exists():
        try:
            site = load(options.saved)
        except OtherCode as other:
            parser.error(str(other))
        site.looks.clear()  # of another process
    else:
        size = hospital(*options.size) if options.size else SITE
        site = Site(seed, options.rmf, options.kill_every, size)
    _print(f"seed {site.seed}, {options.hours:g} hours, supervisors: {site.rmf}")
    try:
        while (left_h := options.hours - site.timeline.now / HOUR_S) > 0.0:
            site.run(min(SHIFT_H, left_h) if options.saved else left_h, lambda at: _print(str(at)))
            if options.saved:
                save(site, options.saved)
    except Broken as broken:
        return _failed(site, str(broken), options)
    took_s = time.perf_counter() - began
    _print(", ".join(f"{count} {what}" for what, count in site.counts().items()))
    _print("trouble: " + ", ".join(f"{n} {w}" for w, n in sorted(site.trouble.counts.items())))
    _print(f"{took_s:.1f} s")
    grown = growth(site.looks)
    if grown:
        return _failed(site, "growth: " + ", ".join(grown), options)
    _print("every law held, no robot waited too long, and no resource grew")
    return 0


def _failed(site: Site, why: str, options: argparse.Namespace) -> int:
    for at, line in list(site.laws.log)[-options.log :]:
        _print(f"{at:12.3f}  {line}")
    _print(f"present troubles: {', '.join(site.ills.all()) or 'nothing'}")
    _print(f"BROKEN {why}")
    kills = f" KILL_EVERY={options.kill_every:g}" if options.kill_every else ""
    size = f" SIZE='{' '.join(map(str, options.size))}'" if options.size else ""
    saved = f" SAVED={options.saved}" if options.saved else ""
    hours = f"HOURS={options.hours:g} RMF={site.rmf}"
    _print(f"to repeat: make soak SEED={site.seed} {hours}{kills}{size}{saved}")
    return 1


def _print(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())

"""What an idle daemon costs, beside a bare transport node: memory, threads, CPU, time to be ready."""

import sys
import time
from pathlib import Path
from typing import Any

from bench.daemons import ROOT, cpu_s, daemon, memory_mb, running, threads, wait_for_log
from hal_fakes.wire import Wire

DOMAIN = 72
WATCHED_S = 10.0
WIRES: tuple[Wire, ...] = ("dds", "zenoh")


def measure(scratch: Path) -> dict[str, Any]:
    """A row for the bare node on each wire, for a lift on zenoh, and for each shipped device on dds."""
    rows = {}
    for wire in WIRES:
        command = [sys.executable, "-m", "bench.bare", str(DOMAIN), wire]
        rows[f"bare node on {wire}"] = watch(command, scratch / f"{wire}.log")
    lift = ROOT / "config/lift_dry_contact.yaml"
    on_zenoh = daemon(lift, scratch / "on_zenoh", DOMAIN, "zenoh")
    rows["lift_dry_contact on zenoh"] = watch(on_zenoh, scratch / "on_zenoh.log")
    for name in ("lift_dry_contact", "door_modbus", "charger_http"):
        command = daemon(ROOT / f"config/{name}.yaml", scratch / name, DOMAIN)
        rows[name] = watch(command, scratch / f"{name}.log")
    return rows


def show(figures: dict[str, Any]) -> None:
    """The table."""
    print(f"\n{'idle':28}{'RSS MB':>9}{'threads':>9}{'CPU %':>8}{'ready s':>9}")
    for name, row in figures.items():
        size = f"{row['rss_mb']:>9.1f}{row['threads']:>9}"
        print(f"{name:28}{size}{row['cpu_percent']:>8.2f}{row['ready_s']:>9.2f}")


def watch(command: list[str], log: Path) -> dict[str, float]:
    started_at = time.monotonic()
    with running(command, log) as child:
        wait_for_log(log, "ready")
        ready_s = time.monotonic() - started_at
        time.sleep(2.0)
        before_s = cpu_s(child.pid)
        time.sleep(WATCHED_S)
        used_s = cpu_s(child.pid) - before_s
        return {
            "rss_mb": memory_mb(child.pid),
            "threads": threads(child.pid),
            "cpu_percent": 100 * used_s / WATCHED_S,
            "ready_s": ready_s,
        }

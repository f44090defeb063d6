"""Measure the web page (`rmf-bridge page`) with 50 lifts, 200 doors and 50 chargers at 1 Hz. Three real
browsers show the page.

Each lift's session id holds the time at which the state was published. A script in each browser notes
the time at which the screen shows that id. The row `a tenth changes` is like a busy site. In the row
`all change`, every card changes each second. Each device's daemon also publishes its diagnostics.

The row `an hour` needs BENCH_PAGE_HOUR_S=N, and runs for N seconds. Every half minute, the benchmark
notes the memory of the page's process and of two browsers. Before that, it collects the garbage in the
browsers. One browser shows the site, and the other shows a device. The first ten minutes do not count,
because a device's page first fills with ten minutes of history. `first` and `last` are the least memory
in the first and in the last ten minutes.
"""

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from msgspec.structs import replace
from playwright.sync_api import Page, Playwright, sync_playwright

from bench.figures import Row, Rows, Tables, percentiles
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from hal_fakes.domain import free_domain
from hal_fakes.wire import join, wire

LIFTS, DOORS, CHARGERS = 50, 200, 50
DEVICES = LIFTS + DOORS + CHARGERS
BROWSERS: Final = 3
SECONDS: Final = float(os.environ.get("BENCH_PAGE_S", "60"))
SETTLES_S: Final = 10.0
HOUR_S: Final = float(os.environ.get("BENCH_PAGE_HOUR_S", "0"))
FILLS_S: Final = 600.0
EVERY_S: Final = 30.0
TICKS: Final = os.sysconf("SC_CLK_TCK")
CHROMIUM: Final = "/usr/bin/chromium"
FLAGS: Final = ("--headless", "--no-sandbox", "--disable-gpu")
WATCH: Final = """() => { window.late = []; const seen = new Set();
  new MutationObserver(changes => { const now = Date.now();
    for (const change of changes) {
      const found = /at\\/(\\d{13})/.exec(change.target.textContent.slice(0, 2000));
      if (found && !seen.has(found[0])) { seen.add(found[0]); late.push(now - Number(found[1])); }
    } }).observe(document.body, {subtree: true, childList: true, characterData: true}); }"""


def measure(scratch: Path) -> Tables:
    """Return the time from publishing to screen (s), the page's CPU and memory, and the browsers'
    heaps."""
    rows = {}
    for name, share in (("a tenth changes", 10), ("all change", 1)):
        with _page(share, scratch) as seen:
            rows[name] = _looked_at(seen)
    tables: Tables = {"page, 300 devices, 3 browsers": rows}
    if HOUR_S:
        with _page(10, scratch) as seen:
            tables["page, an hour"] = _hour(seen)
    return tables


@dataclass(frozen=True)
class Seen:
    """The running web page, the publisher of its devices' states, and the browsers that show the
    page."""

    pid: int
    site: "_Site"
    tabs: list[Page]

    def live(self, seconds: float) -> None:
        """Publish the devices' states for this time (s)."""
        self.site.live(seconds, self.tabs[0])


@contextmanager
def _page(share: int, scratch: Path) -> Iterator[Seen]:
    domain = free_domain()
    command = [sys.executable, "-m", "bridges.cli", "page", "--listen", "127.0.0.1:0"]
    command += ["--localhost", "--domain-id", str(domain), "--transport", wire()]
    command += ["--runtime-dirs", str(scratch)]
    site = _Site(domain, share)
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as page, closing(site):
        try:
            assert page.stdout is not None
            address = page.stdout.readline().split()[4]
            with sync_playwright() as playwright:
                yield Seen(page.pid, site, _tabs(playwright, site, address))
        finally:
            page.terminate()


def _tabs(playwright: Playwright, site: "_Site", address: str) -> list[Page]:
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*FLAGS])
    tabs = [browser.new_context().new_page() for _ in range(BROWSERS)]
    site.live(3.0, tabs[0])
    for tab in tabs:
        tab.goto(address)
    site.live(SETTLES_S, tabs[0])
    return tabs


class _Site:
    """A publisher that sends the state of every simulated device once a second. The states are spread
    over the second."""

    def __init__(self, domain: int, share: int) -> None:
        self._share = share
        self._transport = join("bench_page", domain)
        self._publish_lift = self._transport.publisher(topics.LIFT_STATES).publish
        self._publish_door = self._transport.publisher(topics.DOOR_STATES).publish
        self._publish_charger = self._transport.publisher(topics.CHARGER_STATES).publish
        self._diagnose = self._transport.publisher(topics.DIAGNOSTICS).publish
        idle = d.LiftState(available_floors=("L1", "L2", "L3"))
        self._lifts = [replace(idle, lift_name=f"lift{n:02}") for n in range(LIFTS)]

    def _say(self, number: int, turn: int) -> None:
        if number < LIFTS:
            lift = self._lift(number, turn)
            self._publish_lift(lift)
            self._told("lift", lift.lift_name)
        elif number < LIFTS + DOORS:
            door = self._door(number - LIFTS, turn)
            self._publish_door(door)
            self._told("door", door.door_name)
        else:
            charger = self._charger(number - LIFTS - DOORS, turn)
            self._publish_charger(charger)
            self._told("charger", charger.charger_name)

    def _told(self, kind: str, name: str) -> None:
        """Publish the diagnostics of the device's daemon."""
        devices = {name: {"input_age_s": 0.05, "waiting": "-"}}
        self._diagnose(diagnosis(f"{name}_node", kind, {}, devices, stamp(time.time())))

    def _changes(self, number: int, turn: int) -> bool:
        return (number + turn) % self._share == 0

    def _lift(self, number: int, turn: int) -> d.LiftState:
        wall = time.time()
        if self._changes(number, turn):
            floor, who = f"L{1 + turn % 3}", f"at/{wall * 1e3:.0f}"
            self._lifts[number] = replace(self._lifts[number], current_floor=floor, session_id=who)
        return replace(self._lifts[number], lift_time=stamp(wall))

    def _door(self, number: int, turn: int) -> d.DoorState:
        mode = d.DoorMode((number + turn) // self._share % 3)
        return d.DoorState(stamp(time.time()), f"door{number:03}", mode)

    def _charger(self, number: int, turn: int) -> d.ChargerState:
        state = 1 + (number + turn) // self._share % 2
        return d.ChargerState(stamp(time.time()), state, f"charger{number:02}")

    def live(self, seconds: float, tab: Page) -> None:
        """Publish for this time (s). Meanwhile, let the browsers work. `tab` may be any of their
        tabs."""
        began, said = time.monotonic(), 0
        while (at := time.monotonic() - began) < seconds:
            while said < at * DEVICES:
                turn, number = divmod(said, DEVICES)
                self._say(number, turn)
                said += 1
            tab.wait_for_timeout(5)

    def close(self) -> None:
        self._transport.close()


def _looked_at(seen: Seen) -> Row:
    """Return the time from publishing to screen, and the page's cost."""
    loads: list[str] = []
    for tab in seen.tabs:
        tab.evaluate(WATCH)
        tab.on("domcontentloaded", lambda _: loads.append("again"))
    used, began = _cpu_s(seen.pid), time.monotonic()
    seen.live(SECONDS)
    took_s = time.monotonic() - began
    late = [one / 1e3 for tab in seen.tabs for one in tab.evaluate("window.late || []")]
    p50, p99 = percentiles(late)
    return {
        "p50 ms": p50 * 1e3,
        "p99 ms": p99 * 1e3,
        "CPU %": 100 * (_cpu_s(seen.pid) - used) / took_s,
        "RSS MB": _rss_mb(seen.pid),
        "reloads": len(loads),
        "load": os.getloadavg()[0],
    }


def _hour(seen: Seen) -> Rows:
    """Return the memory that the page's process and two browsers use, and the growth of that memory."""
    *_, site, device = seen.tabs
    device.goto(f"{device.url}lift/lift00")
    kept: list[tuple[float, float, float, float]] = []
    began = time.monotonic()
    while (at := time.monotonic() - began) < HOUR_S:
        seen.live(EVERY_S)
        kept.append((at, _heap(site), _heap(device), _rss_mb(seen.pid)))
    ats, *columns = zip(*[one for one in kept if one[0] >= FILLS_S], strict=True)
    names = ("the site's heap", "a device's heap", "the page's process")
    return {name: _growth(ats, column) for name, column in zip(names, columns, strict=True)}


def _growth(ats: Sequence[float], kept: Sequence[float]) -> Row:
    some = round(FILLS_S / EVERY_S)
    return {
        "first MB": min(kept[:some]),
        "last MB": min(kept[-some:]),
        "MB per hour": 3600 * statistics.linear_regression(ats, kept).slope,
        "samples": len(kept),
        "load": os.getloadavg()[0],
    }


def _heap(tab: Page) -> float:
    client = tab.context.new_cdp_session(tab)
    client.send("HeapProfiler.enable")
    client.send("HeapProfiler.collectGarbage")
    used: float = client.send("Runtime.getHeapUsage")["usedSize"]
    client.detach()
    return used / 1e6


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def _rss_mb(pid: int) -> float:
    status = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in status if line.startswith("VmRSS")) / 1024

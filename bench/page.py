"""The page with 50 lifts, 200 doors and 50 chargers at 1 Hz, looked at by three real browsers.

A lift's session carries the time of its publishing; a script in each browser notes when it is on
the screen. `a tenth changes`: as on a busy site. `all change`: no card is ever the same twice.
"""

import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Final

from playwright.sync_api import BrowserContext, Page, sync_playwright

from bench.figures import Row, Tables, percentiles
from bridges.rmf import definitions as d
from bridges.rmf import topics
from bridges.rmf.stamps import stamp
from hal_fakes.domain import free_domain
from hal_fakes.wire import join, wire

LIFTS, DOORS, CHARGERS = 50, 200, 50
DEVICES = LIFTS + DOORS + CHARGERS
BROWSERS: Final = 3
SECONDS: Final = float(os.environ.get("BENCH_PAGE_S", "60"))
SETTLES_S: Final = 10.0
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
    """Seconds from publishing to the screen, the page's processor and memory, the browsers' heaps."""
    domain = free_domain()
    rows = {}
    for name, share in (("a tenth changes", 10), ("all change", 1)):
        rows[name] = _measured(domain, share, scratch)
    return {"page, 300 devices, 3 browsers": rows}


def _measured(domain: int, share: int, scratch: Path) -> Row:
    command = [sys.executable, "-m", "bridges.cli", "page", "--listen", "127.0.0.1:0"]
    command += ["--localhost", "--domain-id", str(domain), "--transport", wire()]
    command += ["--runtime-dirs", str(scratch)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as page:
        try:
            assert page.stdout is not None
            address = page.stdout.readline().split()[4]
            return _looked_at(page.pid, address, _Site(domain, share))
        finally:
            page.terminate()


class _Site:
    """Publishes every state once a second, spread over that second."""

    def __init__(self, domain: int, share: int) -> None:
        self._share = share
        self._transport = join("bench_page", domain)
        self._publish_lift = self._transport.publisher(topics.LIFT_STATES).publish
        self._publish_door = self._transport.publisher(topics.DOOR_STATES).publish
        self._publish_charger = self._transport.publisher(topics.CHARGER_STATES).publish
        idle = d.LiftState(available_floors=("L1", "L2", "L3"))
        self._lifts = [replace(idle, lift_name=f"lift{n:02}") for n in range(LIFTS)]

    def _say(self, number: int, turn: int) -> None:
        if number < LIFTS:
            self._publish_lift(self._lift(number, turn))
        elif number < LIFTS + DOORS:
            self._publish_door(self._door(number - LIFTS, turn))
        else:
            self._publish_charger(self._charger(number - LIFTS - DOORS, turn))

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
        """Publish for so long; `tab` is any browser, whose events go on meanwhile."""
        began, said = time.monotonic(), 0
        while (at := time.monotonic() - began) < seconds:
            while said < at * DEVICES:
                turn, number = divmod(said, DEVICES)
                self._say(number, turn)
                said += 1
            tab.wait_for_timeout(5)

    def close(self) -> None:
        self._transport.close()


def _looked_at(pid: int, address: str, site: _Site) -> Row:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*FLAGS])
        contexts = [browser.new_context() for _ in range(BROWSERS)]
        tabs = [context.new_page() for context in contexts]
        site.live(3.0, tabs[0])
        loads: list[str] = []
        for tab in tabs:
            tab.on("domcontentloaded", lambda _: loads.append("again"))
            tab.goto(address)
        site.live(SETTLES_S, tabs[0])
        for tab in tabs:
            tab.evaluate(WATCH)
        loads.clear()
        heap, used, began = _heaps(contexts, tabs), _cpu_s(pid), time.monotonic()
        site.live(SECONDS, tabs[0])
        took_s = time.monotonic() - began
        late = [one / 1e3 for tab in tabs for one in tab.evaluate("window.late || []")]
        p50, p99 = percentiles(late)
        row = {
            "p50 ms": p50 * 1e3,
            "p99 ms": p99 * 1e3,
            "CPU %": 100 * (_cpu_s(pid) - used) / took_s,
            "RSS MB": _rss_mb(pid),
            "heap MB": heap,
            "heap + MB": _heaps(contexts, tabs) - heap,
            "reloads": len(loads),
            "load": os.getloadavg()[0],
        }
        browser.close()
    site.close()
    return row


def _heaps(contexts: list[BrowserContext], tabs: list[Page]) -> float:
    """What JavaScript keeps in the first browser after a collection (MB)."""
    client = contexts[0].new_cdp_session(tabs[0])
    client.send("HeapProfiler.enable")
    client.send("HeapProfiler.collectGarbage")
    used: float = client.send("Runtime.getHeapUsage")["usedSize"]
    return used / 1e6


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def _rss_mb(pid: int) -> float:
    status = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in status if line.startswith("VmRSS")) / 1024

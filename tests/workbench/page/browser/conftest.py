"""Fixtures: the page in a separate process, a real browser, and a node on the loopback interface. The
node publishes the states of a site."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import product
from pathlib import Path
from typing import Final, Literal

import pytest
from axe_playwright_python.sync_playwright import Axe
from msgspec.structs import replace
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from bridges.transports.transport import Transport, TransportError
from hal_fakes.wire import join, wire
from tests.workbench.page import recorded
from workbench.page import access

CHROMIUM = "/usr/bin/chromium"
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-component-update",
]
WITHIN_S = 120.0
"""The longest wait (s), enough for a busy machine. Normally no step takes this long."""
USER, PASSWORD = "ann", "correct horse"
SCHEMES: Final[tuple[Literal["light", "dark"], ...]] = ("light", "dark")
SHOTS = Path("build/screenshots")
VIOLATIONS = {"resultTypes": ["violations"]}
"""Options for axe-core, so that its report has details of violations only."""


class Graph:
    """A node that publishes the states of all devices of a site. `turn` publishes these states, at most
    once a second. A device that a test takes out of it is silent, and so something that is wrong, in
    each later test of the module."""

    def __init__(self, domain: int, transport: Transport | None = None) -> None:
        self.options = on_graph(domain)
        self._transport = transport or join("site", domain)
        self._lifts = self._transport.publisher(topics.LIFT_STATES)
        self._doors = self._transport.publisher(topics.DOOR_STATES)
        self._chargers = self._transport.publisher(topics.CHARGER_STATES)
        self._said_at = 0.0
        self.lifts: dict[str, d.LiftState] = {}
        self.doors: dict[str, d.DoorState] = {}
        self.chargers: dict[str, d.ChargerState] = {}
        self.faults: dict[str, dict[str, str]] = {}
        self._diagnostics = self._transport.publisher(topics.DIAGNOSTICS)

    def lift(
        self, name: str, floor: str = "L1", door: int = 0, session: str = "", motion: int = 0
    ) -> None:
        """Set the state of a lift with three floors. `motion` is RMF's motion_state."""
        floors = ("L1", "L2", "L3")
        state = d.LiftState(
            lift_name=name,
            available_floors=floors,
            current_floor=floor,
            door_state=door,
            motion_state=motion,
            current_mode=2,
            session_id=session,
        )
        self.lifts[name] = state
        self._said_at = 0.0

    def turn(self) -> None:
        """Publish all states, at most once a second."""
        if time.monotonic() - self._said_at < 1.0:
            return
        self._said_at = time.monotonic()
        with suppress(TransportError):  # the transport may fail for a time
            self.say()

    def say(self) -> None:
        """Publish all states now."""
        now = stamp(time.time())
        for lift in self.lifts.values():
            self._lifts.publish(replace(lift, lift_time=now))
        for door in self.doors.values():
            self._doors.publish(replace(door, door_time=now))
        for charger in self.chargers.values():
            self._chargers.publish(replace(charger, charger_time=now))
        status = {
            lift: {"faults": [{"code": code, "detail": detail} for code, detail in faults.items()]}
            for lift, faults in self.faults.items()
        }
        self._diagnostics.publish(diagnosis("node", "lift", {}, status, now))

    def close(self) -> None:
        """Leave the graph."""
        self._transport.close()


@pytest.fixture(scope="module")
def graph(module_domain: int) -> Iterator[Graph]:
    made = Graph(module_domain)
    yield made
    made.close()


@contextmanager
def program(
    *words: str, ends: int = 0, state: Path | None = None, log: Path = Path("/dev/stderr")
) -> Iterator[subprocess.Popen[str]]:
    """Run one of our commands as a process. SIGTERM ends the process, whose exit code must be
    `ends`."""
    command = [sys.executable, "-m", "bridges.cli", *words]
    # With PYTEST_CURRENT_TEST in its environment, NiceGUI would believe that the test tests NiceGUI.
    environment = {k: v for k, v in os.environ.items() if k != "PYTEST_CURRENT_TEST"}
    if state is not None:
        environment["STATE_DIRECTORY"] = str(state)
    pipe = subprocess.PIPE
    with (
        log.open("a") as said,
        subprocess.Popen(command, stdout=pipe, stderr=said, text=True, env=environment) as started,
    ):
        try:
            yield started
            started.terminate()
            assert started.wait(timeout=WITHIN_S) == ends
        finally:
            started.kill()


@contextmanager
def page(
    *words: str,
    listen: str = "127.0.0.1:0",
    state: Path | None = None,
    log: Path = Path("/dev/stderr"),
) -> Iterator[str]:
    """Run a page on a free port, and yield its address. In `state` the page records who did what."""
    with program("page", "--listen", listen, *words, state=state, log=log) as started:
        assert started.stdout is not None
        yield started.stdout.readline().split()[4]


def on_graph(domain: int) -> tuple[str, ...]:
    """Return the options with which a page joins this domain."""
    return ("--localhost", "--domain-id", str(domain), "--transport", wire())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder for passwords, recordings, and the runtime directories of the daemons in the
    tests."""
    made = tmp_path_factory.mktemp("page")
    access.add_user(made / "passwords", USER, PASSWORD)
    (made / "run").mkdir()
    (made / "incidents").mkdir()
    recorded.write(made / "incidents" / "ride.mcap")
    return made


@pytest.fixture(scope="module")
def address(module_domain: int, folder: Path) -> Iterator[str]:
    """Yield the address of a page on which a user may log in."""
    words = ["--passwords", str(folder / "passwords"), "--incidents", str(folder / "incidents")]
    words += ["--runtime-dirs", str(folder / "run")]
    with page(*on_graph(module_domain), *words) as found:
        yield found


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield launched
        launched.close()


@pytest.fixture
def complaints() -> list[str]:
    """Return a list that collects the complaints of the browser's console and network."""
    return []


@pytest.fixture(scope="module")
def profile(browser: Browser) -> Iterator[BrowserContext]:
    """Yield one browser profile for all tests of a module. So the browser fetches and compiles the
    scripts only once."""
    made = browser.new_context(viewport={"width": 1200, "height": 800})
    made.set_default_timeout(WITHIN_S * 1e3)
    yield made
    made.close()


@pytest.fixture
def context(profile: BrowserContext) -> Iterator[BrowserContext]:
    """Yield the browser profile, without cookies and tabs of earlier tests."""
    yield profile
    for tab in profile.pages:
        tab.close()
    profile.clear_cookies()


@pytest.fixture
def tab(context: BrowserContext, address: str, complaints: list[str]) -> Iterator[Page]:
    """Yield an empty tab. If the browser complains or asks another machine, the test fails."""
    opened = context.new_page()
    opened.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    opened.on("request", lambda r: None if _own(r.url, address) else complaints.append(r.url))
    yield opened
    assert complaints == []


def _own(url: str, address: str) -> bool:
    host = address.removeprefix("http://").rstrip("/")
    return url.startswith((f"http://{host}/", f"ws://{host}/", "data:", "blob:"))


def log_in(tab: Page, address: str, password: str, to: str = "/lift/Lift1") -> None:
    """Fill in the login form and send it."""
    tab.goto(f"{address}login?next={to}")
    tab.get_by_label("User").fill(USER)
    tab.get_by_label("Password").fill(password)
    tab.get_by_role("button", name="Log in").click()


def settled(tab: Page) -> None:
    """Wait until all fades have ended. The contrast of half-transparent text cannot be judged."""
    tab.wait_for_function("document.getAnimations().every(one => one.playState !== 'running')")


def serious_faults(tab: Page) -> list[tuple[str, str, list[str]]]:
    """Return axe-core's serious findings in light and in dark colours, with the HTML of the
    elements."""
    found: list[tuple[str, str, list[str]]] = []
    for scheme in SCHEMES:
        tab.emulate_media(color_scheme=scheme)
        settled(tab)
        told = Axe().run(tab, options=VIOLATIONS).response["violations"]
        serious = [one for one in told if one["impact"] in ("serious", "critical")]
        found += [(scheme, one["id"], [node["html"] for node in one["nodes"]]) for one in serious]
    return found


Shot = Callable[[str], None]
Until = Callable[[Callable[[], bool], str], None]


@pytest.fixture
def until(graph: Graph, tab: Page) -> Until:
    """Return a function that lets the site publish until a condition holds."""

    def wait(ready: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + WITHIN_S
        while not ready():
            assert time.monotonic() < deadline, f"never happened: {what}"
            graph.turn()
            tab.wait_for_timeout(50)

    return wait


@pytest.fixture
def shot(tab: Page) -> Shot:
    """Return a function that saves screenshots of the tab. It saves four: phone and wall screen, light
    and dark."""

    def take(name: str) -> None:
        SHOTS.mkdir(parents=True, exist_ok=True)
        before = tab.viewport_size
        for width, scheme in product((390, 1920), SCHEMES):
            tab.emulate_media(color_scheme=scheme)
            tab.set_viewport_size({"width": width, "height": 800})
            tab.screenshot(path=str(SHOTS / f"{name}_{width}_{scheme}.png"), full_page=True)
        tab.emulate_media(color_scheme="light")
        if before is not None:
            tab.set_viewport_size(before)

    return take

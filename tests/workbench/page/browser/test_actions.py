"""Actions in a real browser, with a real daemon beside the page. Without a valid login, a user may not
act."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page

from tests.workbench.page.browser.conftest import (
    PASSWORD,
    SCHEMES,
    USER,
    Graph,
    Shot,
    Until,
    log_in,
    on_graph,
    page,
    program,
    serious_faults,
    settled,
)

pytestmark = pytest.mark.browser
COLOURS = """selector => { const style = getComputedStyle(document.querySelector(selector));
  return [style.color, style.backgroundColor]; }"""
"""A script that returns the two colours of an element. Under a dialog axe-core takes the body's colour
for every background. Outside a dialog axe-core judges buttons and panels correctly. So the test
compares a dialog's colours with those of buttons and panels."""
BEYOND = """() => [...document.querySelectorAll('#main :is(p, td, th, li, button)')].filter(
  one => one.getBoundingClientRect().right > innerWidth).map(one => one.outerHTML)"""
DOOR = Path("config/door_modbus.yaml").absolute()
LIFT = Path("config/lift_dry_contact.yaml").absolute()


@pytest.fixture(scope="module", autouse=True)
def daemons(folder: Path, module_domain: int) -> Iterator[None]:
    """Run a simulated lift and a simulated door in this test's domain."""
    graph = on_graph(module_domain)[1:]
    lift = ("run", str(LIFT), "--simulate", "--runtime-dir", str(folder / "run/lift"), *graph)
    door = ("run", str(DOOR), "--simulate", "--runtime-dir", str(folder / "run/door"), *graph)
    with program(*lift), program(*door):
        yield


def confirm(tab: Page, button: str, until: Until) -> None:
    """Press a button, and then confirm in the dialog."""
    until(lambda: tab.get_by_role("button", name=button, exact=True).count() == 1, button)
    tab.get_by_role("button", name=button, exact=True).click()
    tab.get_by_role("dialog").get_by_role("button").first.click()


def now_of(tab: Page, signal: str) -> str:
    """Return the present value of a signal from the wiring table."""
    row = tab.locator("tr", has=tab.locator("td:first-child", has_text=re.compile(f"^{signal}$")))
    return row.first.locator("td").nth(1).inner_text() if row.count() else ""


def main(tab: Page) -> str:
    return tab.locator("#main").inner_text()


def colours(tab: Page, selector: str) -> list[str]:
    """Return the text colour and the background colour of an element."""
    found: list[str] = tab.evaluate(COLOURS, selector)
    return found


def logged(folder: Path) -> str:
    """Return the page's log."""
    return (folder / "log").read_text()


def deeds(folder: Path) -> list[tuple[str, int, str]]:
    """Return (user, exit code, command) for each action that the page has recorded."""
    file = folder / "state/actions.jsonl"
    lines = file.read_text().splitlines() if file.exists() else []
    told = [json.loads(line) for line in lines]
    return [(one["user"], one["exit"], one["command"][0]) for one in told]


@pytest.fixture(scope="module")
def address(module_domain: int, folder: Path) -> Iterator[str]:
    (folder / "state").mkdir()
    words = ["--passwords", str(folder / "passwords"), "--runtime-dirs", str(folder / "run")]
    with page(
        *on_graph(module_domain), *words, state=folder / "state", log=folder / "log"
    ) as found:
        yield found


def test_a_simulation_can_be_pressed_and_failed_and_each_action_is_recorded(
    tab: Page, address: str, until: Until, folder: Path, shot: Shot
) -> None:
    tab.goto(address)
    until(lambda: tab.get_by_role("link", name="Lift1").count() == 1, "the lift")
    log_in(tab, address, PASSWORD, "/lift/Lift1")
    until(lambda: "floor_bit0" in main(tab), "the wiring of the daemon beside the page")
    until(lambda: "SIMULATED" in main(tab), "the daemon's diagnostics")
    confirm(tab, "Press", until)
    said = tab.locator(".q-notification")
    assert said.evaluate("one => getComputedStyle(one).backgroundColor") == "rgb(0, 103, 76)"
    until(lambda: "fire" in tab.locator("article.card").inner_text().lower(), "the fire")
    until(lambda: now_of(tab, "fire_alarm").startswith("● asserted ("), "the contact itself")
    done = "Press fire_alarm: done. In the simulation fire_alarm of Lift1 is on."
    until(lambda: f"{USER}\tPress fire_alarm\t{done}" in main(tab), "who did what, in a sentence")
    shot("actions")
    confirm(tab, "Let go", until)
    until(lambda: len(deeds(folder)) == 2, "the release of the button")
    until(lambda: now_of(tab, "fire_alarm").startswith("○ not asserted ("), "its contact again")
    confirm(tab, "Let it fail", until)
    until(lambda: len(deeds(folder)) == 3, "three deeds")
    assert deeds(folder) == [(USER, 0, "press"), (USER, 0, "press"), (USER, 0, "fail")]
    told = re.findall(r"action user=(\w+) command=\"rmf-bridge (\w+) .* exit=(\d)", logged(folder))
    assert told == [(USER, "press", "0"), (USER, "press", "0"), (USER, "fail", "0")]


def test_what_the_driver_senses_is_seen_live(tab: Page, address: str, until: Until) -> None:
    tab.goto(f"{address}door/ward_door")
    until(lambda: "Levels now" in main(tab), "the levels")
    until(lambda: bool(re.search(r"closed\s+sensed\s+on", main(tab))), "the door's contact")


def test_a_release_reaches_the_daemon(
    tab: Page, address: str, graph: Graph, until: Until, folder: Path
) -> None:
    before = len(deeds(folder))
    asked = ("send", "lift", "Lift1", "L3", "--session", "me", "--direct", *graph.options)
    log_in(tab, address, PASSWORD, "/lift/Lift1")
    with program(*asked, ends=130):  # a requester asks, and goes without an END
        until(lambda: "me" in tab.locator("article.card").inner_text().split(), "the session")
    confirm(tab, "Release the lift", until)
    until(lambda: len(deeds(folder)) > before, "the command's end")
    assert deeds(folder)[before:] == [(USER, 0, "release")]
    until(lambda: "held by" not in tab.locator("article.card").inner_text(), "the release")


def test_a_session_that_has_ended_can_do_nothing(
    tab: Page, address: str, until: Until, folder: Path
) -> None:
    before = len(deeds(folder))
    log_in(tab, address, PASSWORD, "/lift/Lift1")
    until(lambda: tab.get_by_role("button", name="Let it fail").count() == 1, "the button")
    other = tab.context.new_page()
    other.goto(address)
    other.get_by_role("button", name="Log out").click()
    other.get_by_role("link", name="Log in").wait_for()
    confirm(tab, "Let it fail", until)
    tab.get_by_text("nothing was done").wait_for()
    assert len(deeds(folder)) == before
    until(lambda: tab.get_by_role("link", name="Log in").count() == 1, "the view loaded again")


def test_settings_at_their_defaults_are_folded_and_no_column_is_beyond_the_edge(
    tab: Page, address: str, until: Until
) -> None:
    tab.goto(address)
    until(lambda: tab.get_by_role("link", name="Lift1").count() == 1, "the lift")
    until(lambda: tab.get_by_role("link", name="ward_door").count() == 1, "the door")
    for width in (390, 1200, 1920):
        tab.set_viewport_size({"width": width, "height": 800})
        for device in ("lift/Lift1", "door/ward_door"):
            tab.goto(f"{address}{device}")
            until(lambda: tab.get_by_text("settings at their defaults").count() > 0, "the wiring")
            assert tab.get_by_role("cell", name="start_timeout", exact=True).count() == 0
            assert tab.evaluate(BEYOND) == []
    tab.get_by_text("settings at their defaults").first.click()
    assert tab.get_by_role("table").last.is_visible()


def test_axe_finds_no_serious_fault_in_the_question_of_an_action(
    tab: Page, address: str, until: Until
) -> None:
    tab.goto(address)
    until(lambda: tab.get_by_role("link", name="Lift1").count() == 1, "the lift")
    log_in(tab, address, PASSWORD, "/lift/Lift1")
    until(lambda: tab.get_by_role("button", name="Let it fail").count() == 1, "the buttons")
    for button in ("Reset faults", "Press", "Let go", "Let it fail"):
        tab.get_by_role("button", name=button, exact=True).click()
        tab.get_by_role("dialog").get_by_role("button").first.wait_for()
        found = [one for one in serious_faults(tab) if one[1] != "color-contrast"]
        assert (button, found) == (button, [])
        for scheme in SCHEMES:
            tab.emulate_media(color_scheme=scheme)
            settled(tab)
            assert colours(tab, ".q-dialog .q-btn.no") == colours(tab, "section.panel")
            assert colours(tab, ".q-dialog .q-btn") == ["rgb(255, 255, 255)", "rgb(176, 42, 0)"]
            assert colours(tab, ".q-dialog .q-card") == colours(tab, "section.panel")
        tab.keyboard.press("Escape")
        tab.get_by_role("dialog").wait_for(state="detached")

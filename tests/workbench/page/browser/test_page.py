"""The page in a real browser. The test itself publishes the states of the site."""

import pytest
from playwright.sync_api import BrowserContext, Page

from bridges.messages import definitions as d
from tests.workbench.page.browser.conftest import (
    PASSWORD,
    Graph,
    Shot,
    Until,
    log_in,
    serious_faults,
)

pytestmark = pytest.mark.browser
FOCUSED = """() => { const e = document.activeElement;
  return [e.getAttribute('aria-label') || e.textContent.trim(),
          parseFloat(getComputedStyle(e).outlineWidth)]; }"""
BACK = "one => getComputedStyle(one).backgroundColor"
HOSTILE = '<img src=x onerror="document.title=1">'


def card(tab: Page, name: str) -> str:
    """Return the text of a device's card, or "" without a card."""
    found = tab.locator("article.card", has=tab.locator("h3", has_text=name))
    return found.first.inner_text() if found.count() else ""


def drawn(tab: Page, name: str) -> str:
    """Return the text that describes the drawing of a device."""
    found = tab.locator("article.card", has=tab.locator("h3", has_text=name)).locator("svg")
    return (found.first.get_attribute("aria-label") or "") if found.count() else ""


def test_a_ride_is_seen_moving(
    tab: Page, address: str, graph: Graph, until: Until, shot: Shot
) -> None:
    graph.lift("Lift1", "L1", 2, "fleet/robot")
    graph.doors["ward"] = d.DoorState(door_name="ward")
    graph.chargers["pad"] = d.ChargerState(charger_name="pad", state=1)
    tab.goto(address)
    until(lambda: "car at L1, door open" in drawn(tab, "Lift1"), "the car at L1")
    assert "fleet/robot" in card(tab, "Lift1")
    graph.lift("Lift1", "L3", 0, "fleet/robot")
    until(lambda: "car at L3, door closed" in drawn(tab, "Lift1"), "the car at L3")
    shot("site")


def test_a_device_that_falls_silent_is_marked_as_old(
    tab: Page, address: str, graph: Graph, until: Until
) -> None:
    graph.lift("Lift1")
    graph.lift("Lift9")
    tab.goto(address)
    until(lambda: "now" in card(tab, "Lift9"), "Lift9")
    del graph.lifts["Lift9"]
    until(lambda: "OLD: silent" in card(tab, "Lift9"), "Lift9 to turn old")
    assert "was" in card(tab, "Lift9")
    assert "OLD" not in card(tab, "Lift1")


def test_a_name_from_the_graph_is_shown_as_text(
    tab: Page, address: str, graph: Graph, until: Until
) -> None:
    graph.lift(HOSTILE, HOSTILE, 2, HOSTILE)
    tab.goto(address)
    until(lambda: HOSTILE in card(tab, "onerror"), "the hostile name")
    assert tab.locator("article img").count() == 0
    tab.get_by_role("link", name=HOSTILE).click()
    until(lambda: tab.locator("h1", has_text=HOSTILE).count() == 1, "its own page")
    assert tab.locator("main img").count() == 0
    assert tab.title() != "1"


def test_the_timeline_of_a_device_grows(
    tab: Page, address: str, graph: Graph, until: Until, shot: Shot
) -> None:
    graph.lift("Lift1", "L1", 0, "")
    tab.goto(f"{address}lift/Lift1")
    graph.lift("Lift1", "L2", 2, "fleet/other")
    until(lambda: tab.locator(".timeline").count() == 1, "the timeline")
    until(lambda: "fleet/other" in tab.locator(".timeline").inner_text(), "the session's lane")
    shot("device")


def test_a_page_that_was_opened_too_early_shows_its_device_once_it_is_heard(
    tab: Page, address: str, graph: Graph, until: Until, complaints: list[str]
) -> None:
    answer = tab.goto(f"{address}lift/Lift77")
    assert answer is not None
    assert answer.status == 404
    assert ["404" in complaints.pop()] == [True]
    tab.get_by_text("No lift named Lift77 was heard").wait_for()
    graph.lift("Lift77", "L1", 0, "")
    until(lambda: tab.locator("article.card").count() == 1, "its card")


def see_lift_held(tab: Page, address: str, graph: Graph, until: Until) -> None:
    """Let fleet/robot have a lift, and wait until the page shows the session."""
    graph.lift("Lift1", "L1", 2, "fleet/robot")
    tab.goto(address)
    until(lambda: "fleet/robot" in card(tab, "Lift1"), "the lift")


def test_without_a_login_nothing_can_be_done(
    tab: Page, address: str, graph: Graph, until: Until
) -> None:
    see_lift_held(tab, address, graph, until)
    tab.goto(f"{address}lift/Lift1")
    until(lambda: tab.locator("article.card").count() == 1, "its card")
    assert tab.get_by_role("button", name="Release").count() == 0


def test_a_wrong_password_is_refused(tab: Page, address: str, complaints: list[str]) -> None:
    log_in(tab, address, "wrong")
    assert "wrong user or password" in tab.get_by_role("alert").inner_text()
    assert all("403" in one for one in complaints)
    complaints.clear()


def test_a_logged_in_user_confirms_and_then_releases_a_lift(
    tab: Page, context: BrowserContext, address: str, graph: Graph, until: Until
) -> None:
    see_lift_held(tab, address, graph, until)
    log_in(tab, address, PASSWORD)
    until(lambda: tab.get_by_role("button", name="Release the lift").count() == 1, "the button")
    tab.get_by_role("button", name="Release the lift").click()
    until(lambda: "End the session of fleet/robot?" in tab.inner_text("body"), "the question")
    dialog = tab.get_by_role("dialog")
    acts, stays = (one for one in dialog.get_by_role("button").all())
    assert [acts.inner_text(), stays.inner_text()] == ["Release the lift", "No, change nothing"]
    assert acts.evaluate(BACK) != stays.evaluate(BACK)
    assert (
        dialog.locator(".q-card").evaluate("one => parseFloat(getComputedStyle(one).padding)") >= 16
    )
    stays.click()
    until(lambda: dialog.count() == 0, "the question to go")
    tab.get_by_role("button", name="Log out").click()
    until(lambda: tab.get_by_role("link", name="Log in").count() == 1, "the logout")
    (cookie,) = [one for one in context.cookies() if one["name"] == "rmf_bridge_page"] or [{}]
    assert cookie == {}


def test_axe_finds_no_serious_fault(
    tab: Page, address: str, graph: Graph, until: Until, shot: Shot
) -> None:
    see_lift_held(tab, address, graph, until)
    found = {"": serious_faults(tab)}
    for path in ("lift/Lift1", "incidents", "login"):
        tab.goto(address + path)
        until(lambda: tab.locator("h1").count() == 1, "the page")
        found[path] = serious_faults(tab)
    shot("login")
    log_in(tab, address, PASSWORD)
    until(lambda: tab.get_by_role("button", name="Release the lift").count() == 1, "the button")
    found["buttons"] = serious_faults(tab)
    assert found == {"": [], "lift/Lift1": [], "incidents": [], "login": [], "buttons": []}


def test_on_a_phone_nothing_is_wider_than_the_screen(
    tab: Page, address: str, graph: Graph, until: Until
) -> None:
    tab.set_viewport_size({"width": 390, "height": 800})
    graph.lift("Lift1", "L1", 2, "a_fleet_with_a_long_name/and_a_robot_with_a_longer_one_than_that")
    tab.goto(address)
    until(lambda: "longer_one" in card(tab, "Lift1"), "the lift")
    for path in ("", "lift/Lift1"):
        tab.goto(address + path)
        until(lambda: tab.locator("article.card").count() > 0, "its card")
        assert tab.evaluate("document.documentElement.scrollWidth") <= 390


def test_everything_can_be_reached_by_keyboard_and_the_focus_is_seen(
    tab: Page, address: str, graph: Graph, until: Until
) -> None:
    see_lift_held(tab, address, graph, until)
    reached = []
    for _ in range(6):
        tab.keyboard.press("Tab")
        reached.append(tab.evaluate(FOCUSED))
    names = [name for name, _ in reached]
    assert names[:5] == ["To the content", "Site", "Incidents", "Day and week", "Log in"]
    assert all(outline >= 2 for _, outline in reached)
    tab.get_by_role("link", name="Lift1").focus()
    graph.lift("Lift1", "L2", 0, "fleet/robot")
    until(lambda: "car at L2" in drawn(tab, "Lift1"), "the car at L2")
    assert tab.evaluate(FOCUSED)[0] == "Lift1"
    tab.keyboard.press("Enter")
    until(lambda: tab.locator("h1", has_text="Lift1").count() == 1, "its page")


def test_a_moving_car_is_animated_unless_the_reader_prefers_no_motion(
    tab: Page, address: str, graph: Graph, until: Until
) -> None:
    tab.emulate_media(reduced_motion="reduce")
    graph.lift("Lift1", "L1", 0, "fleet/robot")
    tab.goto(address)
    until(lambda: "car at L1" in drawn(tab, "Lift1"), "the car at L1")
    graph.lift("Lift1", "L2", 0, "fleet/robot")
    until(lambda: tab.locator(".moves").count() == 1, "the car to move")
    style = "getComputedStyle(document.querySelector('.moves') || document.body).animationName"
    assert tab.evaluate(style) == "none"

"""The first screen of the page. The screen says what is wrong and how to mend it. After the first load,
the browser's tab receives only changes."""

import json
from collections.abc import Iterator
from functools import partial

import pytest
from playwright.sync_api import Page

from bridges.messages import definitions as d
from bridges.runtime import faults
from tests.workbench.page.browser.conftest import Graph, Until
from tests.workbench.page.browser.test_page import card, drawn

pytestmark = pytest.mark.browser
SMALL = """() => [...document.querySelectorAll('a, button, input, summary')].filter(one => {
  const box = (one.closest('label') || one).getBoundingClientRect();
  return box.width && !one.closest('.skip') && (box.width < 44 || box.height < 44);
}).map(one => one.outerHTML)"""
AT_END = """() => { const one = document.querySelector('.timeline');
  const right = one.scrollLeft + one.clientWidth;
  return one.scrollWidth > one.clientWidth && right >= one.scrollWidth - 1; }"""
ON_SCREEN = """told => [...document.querySelectorAll('#wrong p, #why p, #why li')].some(one => {
  const box = one.getBoundingClientRect();
  return one.textContent.includes(told) && box.left >= 0 && box.right <= innerWidth
    && box.bottom <= innerHeight && document.documentElement.scrollWidth <= innerWidth; })"""
RIGHT = """() => Math.max(...[...document.querySelectorAll('article')].map(
  one => one.getBoundingClientRect().right)) / innerWidth"""


@pytest.fixture
def overloaded(graph: Graph) -> Iterator[str]:
    """Overload Lift1, and leave Lift2 without a fault. Yield the remedy's text for OVERLOAD."""
    graph.lift("Lift1")
    graph.lift("Lift2")
    graph.faults["Lift1"] = {"OVERLOAD": "for 9 s"}
    yield faults.for_explain()["OVERLOAD"][1]
    graph.faults.clear()


def stands_at(tab: Page, floor: str) -> bool:
    """Return whether the drawing shows the car at this floor."""
    return f"car at {floor}" in drawn(tab, "Lift1")


@pytest.mark.parametrize("width", [390, 1200, 1920])
@pytest.mark.parametrize("path", ["", "lift/Lift1"], ids=["site", "device"])
def test_what_is_wrong_and_its_remedy_are_on_the_first_screen(
    tab: Page, address: str, overloaded: str, until: Until, width: int, path: str
) -> None:
    tab.set_viewport_size({"width": width, "height": 844})
    tab.goto(address + path)
    until(lambda: bool(tab.evaluate(ON_SCREEN, overloaded)), "the remedy, on the screen")


def test_the_title_counts_and_the_filter_shows_what_needs_attention(
    tab: Page, address: str, overloaded: str, until: Until
) -> None:
    tab.goto(address)
    until(lambda: "OVERLOAD" in card(tab, "Lift1"), "the fault")
    until(lambda: tab.title() == "(1) Site · RMF bridges", "the count in the title")
    tab.get_by_label("Only what needs attention").check()
    until(lambda: not tab.get_by_role("heading", name="Lift2").is_visible(), "the filter")
    assert tab.get_by_role("heading", name="Lift1").is_visible()
    tab.get_by_label("Only what needs attention").uncheck()
    tab.get_by_label("Find a device").fill("LIFT2")
    until(lambda: not tab.get_by_role("heading", name="Lift1").is_visible(), "the search")
    assert tab.get_by_role("heading", name="Lift2").is_visible()


def test_a_car_between_floors_is_drawn_between_the_last_and_the_next(
    tab: Page, address: str, graph: Graph, until: Until
) -> None:
    graph.lift("Lift1", "L1")
    tab.goto(address)
    until(lambda: "car at L1" in drawn(tab, "Lift1"), "the car at L1")
    graph.lift("Lift1", "", motion=d.LiftMotion.MOTION_UP)
    until(lambda: "car between L1 and L2, going up" in drawn(tab, "Lift1"), "the car on its way")
    assert "car between L1 and L2" in card(tab, "Lift1")
    assert tab.locator("article.card", has_text="Lift1").locator("rect.car").count() == 1
    graph.lift("Lift1", "L2")
    until(lambda: "car at L2" in drawn(tab, "Lift1"), "the car at L2")


@pytest.mark.parametrize("path", ["", "lift/Lift1", "incidents", "login"])
def test_every_target_is_large_enough_and_there_is_one_main(
    tab: Page, address: str, overloaded: str, until: Until, path: str
) -> None:
    tab.goto(address)
    until(lambda: tab.locator("#wrong a").count() == 1, "the lift")
    tab.goto(address + path)
    until(lambda: tab.locator("h1").count() == 1, "the view")
    assert tab.locator("main").count() == 1
    assert tab.evaluate(SMALL) == []


def test_the_sections_use_a_wide_screen(
    tab: Page, address: str, graph: Graph, until: Until, overloaded: str
) -> None:
    tab.set_viewport_size({"width": 1920, "height": 1080})
    tab.goto(address)
    until(lambda: tab.locator("article.card").count() >= 2, "the lifts")
    assert tab.evaluate(RIGHT) > 0.9
    graph.doors["ward"] = d.DoorState(door_name="ward")
    until(lambda: card(tab, "ward") != "", "the door")
    assert tab.evaluate(RIGHT) > 0.9


def test_a_timeline_opens_at_its_newest_end(
    tab: Page, address: str, overloaded: str, until: Until
) -> None:
    tab.set_viewport_size({"width": 390, "height": 844})
    tab.goto(address)
    until(lambda: tab.locator("#wrong a").count() == 1, "the lift")
    tab.goto(f"{address}lift/Lift1")
    until(lambda: bool(tab.evaluate(AT_END)), "the timeline's end")


def test_a_tab_gets_what_has_changed(
    tab: Page, address: str, graph: Graph, overloaded: str, until: Until
) -> None:
    came: list[str] = []
    tab.on(
        "websocket", lambda opened: opened.on("framereceived", lambda one: came.append(str(one)))
    )
    tab.goto(address)
    until(lambda: tab.locator("#wrong a").count() == 1, "the lift")
    for floor in ("L1", "L2", "L3") * 3:
        graph.lift("Lift1", floor)
        until(partial(stands_at, tab, floor), floor)
    came.clear()
    tab.goto(f"{address}lift/Lift1")
    drawings = 'patch(\\"timeline\\"'
    until(lambda: sum(drawings in one for one in came) >= 6, "drawings of the timeline")
    first, *later = [len(one) for one in came if drawings in one]
    assert sorted(later)[len(later) // 2] < first / 4
    settled = json.loads(tab.evaluate("JSON.stringify(pieces.timeline.join('').length)"))
    assert settled > 4 * sorted(later)[len(later) // 2]


def test_a_phone_shows_the_wiring_when_it_is_asked_for(
    tab: Page, address: str, overloaded: str, until: Until
) -> None:
    """On a phone, the wiring tables are folded, because they need more than six phone screens."""
    for width, unfolded in ((390, False), (1200, True)):
        tab.set_viewport_size({"width": width, "height": 844})
        tab.goto(address)
        until(lambda: tab.locator("#wrong a").count() >= 1, "the lift")
        tab.goto(f"{address}lift/Lift1")
        until(lambda: tab.locator("details[data-unfolded]").count() == 1, "the view")
        shown = "document.querySelector('details.wiring').open"
        assert tab.evaluate(shown) is unfolded
        assert tab.locator("#wiring p").is_visible() is unfolded


def test_an_old_card_with_a_fault_looks_as_strong_as_a_fault(
    tab: Page, address: str, graph: Graph, overloaded: str, until: Until
) -> None:
    tab.goto(address)
    until(lambda: "OVERLOAD" in card(tab, "Lift1"), "the fault")
    look = """() => { const one = getComputedStyle(document.querySelector('.card.faulty'));
      return [one.borderLeftStyle, one.borderLeftColor, one.backgroundColor]; }"""
    now = tab.evaluate(look)
    state = graph.lifts.pop("Lift1")
    until(lambda: "OLD: silent" in card(tab, "Lift1"), "the silence")
    assert tab.evaluate(look) == now
    graph.lifts["Lift1"] = state


def test_a_long_fault_is_told_whole_with_an_action(
    tab: Page, address: str, graph: Graph, overloaded: str, until: Until
) -> None:
    why = "http://192.168.1.70/rpc/Shelly.GetStatus: no complete HTTP answer: is it an HTTP server?"
    graph.faults["Lift1"] = {"INPUTS_NOT_FRESH": f"{why * 3} END"}
    tab.goto(address)
    until(lambda: "END" in tab.locator("#wrong").inner_text(), "the whole detail")
    remedy = faults.for_explain()["INPUTS_NOT_FRESH"][1]
    assert f"Do: {remedy}" in tab.locator("#wrong").inner_text()

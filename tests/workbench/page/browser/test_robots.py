"""Robots of our own fleet daemon on the page. Each robot has a card. The view of a robot says why the
robot stands, and has no empty sections."""

from typing import cast

import pytest
from playwright.sync_api import Page

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.explain.test_robot import reported
from tests.workbench.page.browser.conftest import Graph, Shot, Until, serious_faults

pytestmark = pytest.mark.browser
OFF = ("ROBOT_OFF_GRAPH", "9 m from the nearest lane")


@pytest.fixture
def fleet(graph: Graph, until: Until) -> Until:
    """Return a function that lets the fleet's daemon report, until a condition holds."""
    fleet = graph._transport.publisher(topics.FLEET_STATES)
    robots = (d.RobotState("AMR01"), d.RobotState("AMR02"))

    def wait(ready: object, what: str) -> None:
        def said() -> bool:
            fleet.publish(d.FleetState("tiny", robots))
            graph._diagnostics.publish(cast(d.DiagnosticArray, reported(0.0, OFF).message))
            return bool(ready())  # type: ignore[operator]

        until(said, what)

    return wait


def test_a_robot_has_a_card_and_its_view_says_why_it_stands(
    tab: Page, address: str, fleet: Until, shot: Shot
) -> None:
    tab.goto(address)
    fleet(lambda: tab.locator("h3", has_text="tiny/AMR01").count() == 1, "the robot's card")
    fleet(lambda: "tiny/AMR02" in tab.locator("#robots").inner_text(), "a robot without a daemon")
    assert "tiny/AMR01" not in tab.locator("#robots").inner_text(), "it has its card"
    assert "drive the robot back to a lane" in tab.locator(".troubles").inner_text()
    assert serious_faults(tab) == []
    shot("robots")
    tab.get_by_role("link", name="tiny/AMR01").first.click()
    why = tab.locator(".why")
    fleet(lambda: "tiny/AMR01 is off the graph" in why.inner_text(), "the reason")
    assert "a person: drive the robot back to a lane" in why.inner_text()
    assert "Last ten minutes" not in tab.inner_text("body"), "no timeline of a robot is kept"
    assert "What happened" not in tab.inner_text("body")
    tab.set_viewport_size({"width": 390, "height": 800})
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    assert serious_faults(tab) == []
    shot("robot")

"""The first screen during an alarm. The screen says why every robot must stand, and whether the alarm
is a drill."""

import time

import pytest
from playwright.sync_api import Page

from bridges.kinds.shared import alarming
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmCause,
    FleetAlarmReport,
)
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from hal_fakes.wire import join
from tests.workbench.page.browser.conftest import Graph, Until, serious_faults

pytestmark = pytest.mark.browser
ON_SCREEN = """told => [...document.querySelectorAll('#standing p')].some(one => {
  const box = one.getBoundingClientRect();
  return one.textContent.includes(told) && box.left >= 0 && box.right <= innerWidth
    && box.bottom <= innerHeight && document.documentElement.scrollWidth <= innerWidth; })"""
CAUSE = (AlarmCause("Main panel", "fire_panel"),)


class Daemon:
    """A node that publishes the diagnostics of a fire panel's daemon."""

    def __init__(self, domain: int) -> None:
        self._transport = join("rmf_bridge_panel", domain)
        self._diagnostics = self._transport.publisher(topics.DIAGNOSTICS)

    def states(self, state: str, since: str = "2026-11-22T09:12:03Z") -> None:
        report = FleetAlarmReport(state, CAUSE if state == "alarm" else ())
        statement = {**alarming.statement(report, frozenset()), "since": since}
        told = diagnosis(
            self._transport.name, "alarm", {"alarm": statement}, {}, stamp(time.time())
        )
        self._diagnostics.publish(told)

    def close(self) -> None:
        self._transport.close()


@pytest.mark.parametrize("width", [390, 1200])
def test_the_first_screen_says_why_every_robot_stands(
    tab: Page, address: str, graph: Graph, until: Until, width: int, module_domain: int
) -> None:
    graph.lift("Lift1")
    daemon = Daemon(module_domain)
    tab.set_viewport_size({"width": width, "height": 844})
    tab.goto(address)

    def says(state: str, told: str) -> None:
        def said() -> bool:
            daemon.states(state)
            return bool(tab.evaluate(ON_SCREEN, told))

        until(said, told)

    says(
        "alarm", "Every robot must stand still because fire_panel of Main panel raised an alarm at "
    )
    assert tab.locator("#standing time").inner_text() not in ("", "00:00:00")
    assert serious_faults(tab) == []
    tab.goto(f"{address}lift/Lift1")
    why = "because fire_panel of Main panel raised an alarm at"
    until(lambda: why in tab.locator("#why").inner_text(), "the device's view says it too")
    tab.goto(address)
    says("drill", "for a drill of rmf_bridge_panel, which began at")
    assert serious_faults(tab) == []

    def is_over() -> bool:
        daemon.states("quiet")
        return tab.locator("#standing p").count() == 0

    until(is_over, "the end of the drill")
    daemon.close()


def test_an_alarm_of_a_foreign_node_is_told_too(
    tab: Page, address: str, until: Until, module_domain: int
) -> None:
    desk = join("desk", module_domain)
    alarm = desk.publisher(topics.FIRE_ALARM_TRIGGER)
    tab.goto(address)

    def said() -> bool:
        alarm.publish(d.Bool(True))
        return bool(tab.evaluate(ON_SCREEN, "because desk published an alarm on fire_alarm"))

    until(said, "the foreign alarm")
    alarm.publish(d.Bool(False))
    until(lambda: tab.locator("#standing p").count() == 0, "its end")
    desk.close()

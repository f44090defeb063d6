"""Check whom an explanation blames when a part of a lift or door fails while a robot waits."""

import pytest

from bridges.runtime.faults import for_explain
from tests.site.building import DOORS, LIFTS
from tests.site.trouble import breakable, pressable
from tests.workbench.explain.story import Scene
from workbench.explain.answer import RELAYS_OFF
from workbench.explain.explanation import Explanation
from workbench.explain.heard_devices import HeardDevices
from workbench.explain.lift import ALARMS, UNTIL


def failures(name: str) -> list[tuple[str, str]]:
    """Return what can happen to the device: (signal, "") for a signal that is pressed, or the part that
    fails and its failure."""
    device = Scene(name).devices[name]
    wires, parts = breakable(device)
    fails = [
        (part, how) for part, ways in [*wires, *parts] for how in ("off", "wrong") if how in ways
    ]
    return [*((signal, "") for signal in pressable(device)), *fails]


def explained(name: str, what: str, how: str) -> Explanation:
    """Let a robot wait for a device to which this happens, and explain the device."""
    scene = Scene(name)
    if how:
        scene.fail(name, what, how)
    else:
        scene.press(name, what, True)
    robot = scene.robot("fleet/red")
    robot.asks(name, "L3") if name in LIFTS else robot.opens(name)
    scene.run(30.0)
    site = HeardDevices(name)
    for one in scene.heard:
        site.take(one)
    return site.explain("lift" if name in LIFTS else "door", name, None, for_explain())


@pytest.mark.parametrize("name", [*LIFTS, *DOORS])
def test_a_controller_that_is_asked_for_nothing_is_not_to_act(name: str) -> None:
    for what, how in failures(name):
        told = explained(name, what, how)
        text = " ".join(told.now)
        blamed = any(step.who == "the controller" for step in told.next)
        asked_for_nothing = RELAYS_OFF in text or UNTIL in text
        in_alarm = any(f"in {mode} mode" in text for mode in ALARMS)
        assert not (blamed and asked_for_nothing) or in_alarm, (what, how, text)

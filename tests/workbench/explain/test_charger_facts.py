"""The events of a charger that `explain` tells and counts once, although they are heard twice."""

import json

import pytest

from bridges.kinds.charger.refusals import refused
from bridges.kinds.charger.settings import RobotName
from bridges.messages import definitions as d
from bridges.messages.definitions import ChargerStateValue as State
from bridges.messages.heard import Heard, Own
from workbench.explain.charger_facts import ChargerFacts
from workbench.explain.heard_devices import HeardDevices

NAME = "bay1"


def state(at: float, condition: State, request: str = "") -> Heard:
    shown = d.ChargerState(d.Time(int(at)), int(condition), NAME, request_id=request)
    return Heard(at, at, "charger_states", shown)


@pytest.mark.parametrize("note_first", [True, False])
def test_a_refusal_that_is_noted_and_published_is_told_once(note_first: bool) -> None:
    site = HeardDevices(NAME)
    site.take(state(0.0, State.CHARGER_IDLE))
    reason = "charger occupied"
    noted = Own(9.0, 9.0, "rmf_bridge/decisions", json.dumps({"subject": NAME, "refused": reason}))
    answer = refused("r2", NAME, RobotName("fleet", "blue"), reason)
    published = Heard(9.1, 9.1, "charger_refusals", answer.message())
    for one in (noted, published) if note_first else (published, noted):
        site.take(one)
    told = [line.text for line in site.explain("charger", NAME, None).story]
    assert [one for one in told if "refuse" in one] == ["bay1 refuses fleet/blue: charger occupied"]


def test_a_charge_that_goes_on_after_a_pause_is_counted_once() -> None:
    site = HeardDevices(NAME)
    charges = State.CHARGER_CHARGING
    heard = [
        (State.CHARGER_IDLE, ""),
        (charges, "r1"),
        (State.CHARGER_ERROR, "r1"),
        (charges, "r1"),
        (State.CHARGER_RELEASED, "r1"),
        (charges, "r2"),
    ]
    for at, (condition, request) in enumerate(heard):
        site.take(state(float(at), condition, request))
    known = site.known["charger", NAME]
    assert isinstance(known, ChargerFacts)
    assert known.charges == 2


def next_step(*more: Heard, until: float, timeout_s: int = 60) -> str:
    """Return who has to act after an idle station was asked once to charge a robot, at 10.5 s."""
    wish = d.ChargerRequest(NAME, "fleet", "red", d.Duration(timeout_s), "r1")
    idle = [state(float(at), State.CHARGER_IDLE) for at in range(int(until) + 1)]
    site = HeardDevices(NAME)
    lines = [*idle, Heard(10.5, 10.5, "charger_requests", wish), *more]
    for one in sorted(lines, key=lambda one: one.at):
        site.take(one)
    return site.explain("charger", NAME, None).next[0].who


@pytest.mark.parametrize(
    ("until", "timeout_s", "who"),
    [
        (39.0, 60, "the device's node"),
        (70.0, 60, "the device's node"),
        (71.0, 60, "nobody"),
        (39.0, 20, "nobody"),
        (12.0, 0, "the device's node"),
    ],
)
def test_a_request_that_an_idle_station_ignores_stands_until_its_start_timeout(
    until: float, timeout_s: int, who: str
) -> None:
    assert next_step(until=until, timeout_s=timeout_s) == who


def test_a_request_that_was_cancelled_refused_or_served_stands_no_longer() -> None:
    cancelled = Heard(12.0, 12.0, "charger_cancels", d.ChargerCancel(NAME, "r1"))
    refusal = refused("r1", NAME, RobotName("fleet", "red"), "unknown robot").message()
    served = state(12.5, State.CHARGER_CHARGING, "r1")
    for one in (cancelled, Heard(12.0, 12.0, "charger_refusals", refusal), served):
        assert next_step(one, until=39.0) == "nobody"

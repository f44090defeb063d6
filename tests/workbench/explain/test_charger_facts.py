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

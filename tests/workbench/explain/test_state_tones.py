"""The tone for each of RMF's state numbers. A tone is a kind of state, such as "wrong", which decides
the colour. An unused number must not shift the tones."""

import pytest

from bridges.messages import definitions as d
from workbench.explain.state_tones import TONES, tone


def test_each_number_has_its_tone() -> None:
    assert tone(d.ChargerStateValue, d.ChargerStateValue.CHARGER_ERROR) == "wrong"
    assert tone(d.ChargerStateValue, 0) == "unknown"
    assert tone(d.DoorModeValue, d.DoorModeValue.MODE_OFFLINE) == "wrong"
    assert tone(d.LiftMode, d.LiftMode.MODE_HUMAN) == "calm"
    assert tone(d.LiftMotion, 99) == "unknown"


@pytest.mark.parametrize("kind", TONES)
def test_no_number_that_rmf_defines_is_left_out(kind: type[d.LiftMode]) -> None:
    assert len(TONES[kind]) == len(kind)

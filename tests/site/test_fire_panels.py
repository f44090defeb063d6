"""The fire panels without the rest of the site, through all their exercises. Every fleet hears of each
alarm, and only resets end an alarm."""

import logging
from random import Random

import pytest

from bridges.kinds.shared import fleet_alarm
from tests.depth import depth
from tests.site.fire_panels import CASE_S, EVERY_S, FIRST_S, FirePanels
from tests.site.timeline import Timeline

LASTS_S = FIRST_S + 30.0 + 10 * CASE_S


def wrong_in_a_day(seed: int, days: int = 1) -> tuple[list[str], dict[str, int]]:
    timeline, wrong = Timeline(), list[str]()
    panels = FirePanels(
        timeline,
        Random(f"fire {seed}"),
        lambda holds, law: None if holds else wrong.append(law),
    )
    panels.open()
    timeline.run((days - 1) * EVERY_S + LASTS_S)
    return wrong, panels.done


@pytest.mark.long(4)
@pytest.mark.parametrize("seed", range(depth(2, 40)))
def test_a_day_of_drills_and_alarms(seed: int, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL)
    wrong, done = wrong_in_a_day(seed, days=2)
    assert wrong == []
    assert set(done.values()) == {2}
    assert len(done) == 10


@pytest.mark.parametrize(
    ("name", "instead", "law"),
    [
        ("_waits", lambda memory: (), "publishes false in an alarm"),
        ("_latch", lambda memory: memory, "drives during an alarm"),
    ],
)
def test_a_daemon_that_breaks_a_rule_is_noticed(
    name: str, instead: object, law: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fleet_alarm, name, instead)
    wrong, _ = wrong_in_a_day(0)
    assert any(law in one for one in wrong), wrong[:3]

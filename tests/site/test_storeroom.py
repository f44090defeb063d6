"""The storeroom without the rest of the site, for whole days. In spite of all troubles, RMF's task
continues only if the item has left the dispenser."""

import logging
from random import Random

import pytest

from tests.depth import depth
from tests.site.storeroom import EVERY_S, TROUBLES, WAITS_S, Storeroom
from tests.site.timeline import Timeline


@pytest.mark.long(3)
@pytest.mark.parametrize("seed", range(depth(1, 20)))
def test_a_day_of_deliveries(seed: int, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL)
    timeline = Timeline()
    wrong: list[str] = []
    storeroom = Storeroom(
        timeline, Random(f"day {seed}"), lambda holds, law: None if holds else wrong.append(law)
    )
    storeroom.open()
    hours = depth(12, 24)
    timeline.run(hours * EVERY_S + WAITS_S + 60.0)
    assert wrong == []
    assert storeroom.done.keys() == set(TROUBLES)
    assert sum(storeroom.done.values()) == hours + 1

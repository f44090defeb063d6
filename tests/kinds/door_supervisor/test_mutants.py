"""The supervisor's core at its edges: what a mutation run found untested (docs/mutation.md)."""

import pytest
from msgspec.structs import replace

from bridges.kinds.door_supervisor import keep
from bridges.kinds.door_supervisor.memory import VISIT_S, Holder
from bridges.kinds.door_supervisor.settings import Settings
from tests.kinds.door_supervisor.alone import Alone


def test_nothing_that_counts_is_refused() -> None:
    desk = Alone()
    desk.opens()
    desk.shows("OPEN")
    desk.until(0.5)
    desk.closes()
    desk.shows("CLOSED")
    assert (desk.sent, desk.refused) == ([(0.0, "OPEN"), (0.5, "CLOSED")], [])


def test_a_file_that_is_not_a_table_is_refused_with_what_it_should_be() -> None:
    with pytest.raises(ValueError, match=r"^not a table of who holds which door: "):
        keep.restore(b"[]", Settings(), 0.0)


def test_a_repeat_belongs_to_the_same_visit_unless_it_comes_late() -> None:
    holder = Holder("fleet/a", since=1.0, asked_at=5.0, stamp=7, visit=3)
    late = 5.0 + VISIT_S
    assert holder.repeats(8, late) == replace(holder, asked_at=late, stamp=8)
    assert holder.repeats(8, late + 0.1) == replace(holder, asked_at=late + 0.1, stamp=8, visit=8)

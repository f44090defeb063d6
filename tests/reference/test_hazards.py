"""Check that `hazards.toml` has rows for every output. Check that each row names an existing guard and
test."""

import re
from typing import get_args

import pytest

from bridges.kinds.charger.signals import ChargerOutputs
from bridges.kinds.dispenser.signals import WorkcellOutputs
from bridges.kinds.door.signals import DoorOutputs
from bridges.kinds.fleet.signals import Doing
from bridges.kinds.lift.signals import LiftOutputs
from tests.reference.hazards import PAGE, ROOT, UnsafeAction, actions, page

ROWS = actions()
WAYS = ("given", "not_given", "timing", "duration")
NO_COMMANDS = {"door.between_pulses", "dispenser.guid", "dispenser.item"}
"""Fields of the outputs that switch nothing. They only tell the driver why a hold ended, or what a
start dispenses."""


def test_the_page_has_the_table() -> None:
    """If this test fails, run `make reference`."""
    assert PAGE.read_text() == page()


ORDERS = {
    "lift_supervisor.request",
    "lift_supervisor.end",
    "door_supervisor.open",
    "door_supervisor.close",
    "coordinator.request",
    "coordinator.cancel",
    "coordinator.assignment",
    "alarm.fleets",
    *(f"robot.{doing}" for doing in get_args(Doing)),
}
"""The messages by which a supervisor, the coordinator or an alarm orders a device or robots, and our
orders to a robot."""


def test_every_output_of_every_kind_and_every_order_has_its_four_rows() -> None:
    kinds = {
        "lift": LiftOutputs,
        "door": DoorOutputs,
        "charger": ChargerOutputs,
        "dispenser": WorkcellOutputs,  # an ingestor has the same outputs
    }
    outputs = {f"{kind}.{field}" for kind, of in kinds.items() for field in of.__struct_fields__}
    wanted = {f"{one}.{way}" for one in (outputs - NO_COMMANDS) | ORDERS for way in WAYS}
    assert wanted - {row.id for row in ROWS} == set()


def test_each_row_has_its_own_id_with_the_way_in_its_place() -> None:
    assert len({row.id for row in ROWS}) == len(ROWS)
    form = re.compile(rf"(every|[a-z_]+\.[a-z_]+)\.({'|'.join(WAYS)})(\.[a-z_0-9]+)*")
    assert [row.id for row in ROWS if not form.fullmatch(row.id)] == []


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.id)
def test_a_row_names_an_existing_guard_and_test_or_states_a_gap(
    row: UnsafeAction,
) -> None:
    if row.gap:
        assert row.guard + row.test == ""
        return
    file, _, test = row.test.partition("::")
    assert re.search(rf"^def {test}\(", (ROOT / file).read_text(), re.M)
    assert f"def {row.guard.partition('::')[2]}(" in (ROOT / row.file).read_text()
    assert [(ROOT / one.file).read_text().count(one.cut) for one in row.cuts] == [1] * len(row.cuts)

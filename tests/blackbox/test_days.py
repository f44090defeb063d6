"""The daily counts of this machine's devices. The counts are made from the rings, and stored in a file.
They are shown as a table or as CSV."""

from datetime import date, timedelta
from pathlib import Path

import pytest

from bridges.blackbox import days
from bridges.messages.definitions import LiftMode, LiftRequest, LiftState
from bridges.observe.tally import DeviceCounts
from tests.blackbox.test_recorder import Machine

DAY = date(2026, 11, 24)


def counts(waits: int = 0, cycles: int = 0, watched_s: float = 3600.0) -> DeviceCounts:
    made = DeviceCounts(cycles=cycles, watched_s=watched_s, served_s=watched_s / 2)
    for number in range(waits):
        made.waits.add(8.0 + number)
        made.rides.add(15.0)
    return made


def test_counts_of_a_day_add_up_and_a_week_is_the_sum_of_its_days(tmp_path: Path) -> None:
    for day in (DAY.replace(day=17), DAY.replace(day=18), DAY, DAY):
        days.add(tmp_path, day, {("lift", "Lift 1"): counts(2, 4), ("door", "ward"): counts(0, 7)})
    found = days.read(tmp_path)
    assert [row.cells for row in days.rows(found, DAY, 1)] == [
        ("door", "ward", "", "", "", "", "14", "", "", "50.0", "2.0"),
        ("lift", "Lift 1", "4", "4", "≤ 10", "≤ 10", "8", "", "", "50.0", "2.0"),
    ]
    assert [row.cells[9:] for row in days.rows(found, DAY, 7)] == [("50.0", "3.0")] * 2
    assert days.rows(found, date(2026, 1, 1), 7) == []


def test_a_charger_shows_charges_and_energy_and_what_is_not_known_is_empty(tmp_path: Path) -> None:
    bay = DeviceCounts(cycles=3, energy_j=7_200_000.0, watched_s=7200.0, served_s=7200.0)
    days.add(tmp_path, DAY, {("charger", "bay"): bay})
    assert days.as_csv(days.read(tmp_path)).splitlines() == [
        "day,kind,device,rides,waits,wait p50 s,wait p95 s,door cycles,charges,energy Wh,"
        "in service %,watched h",
        "2026-11-24,charger,bay,,,,,,3,2000,100.0,2.0",
    ]


def test_a_name_with_a_comma_or_a_quote_stays_one_cell_of_the_csv(tmp_path: Path) -> None:
    days.add(tmp_path, DAY, {("door", 'ward 3, "east"'): counts()})
    assert '"ward 3, ""east"""' in days.as_csv(days.read(tmp_path))


def test_old_days_are_removed_and_a_broken_file_begins_anew(tmp_path: Path) -> None:
    for month in range(1, 13):
        for day in range(1, 8):
            days.add(tmp_path, date(2026, month, day), {("door", "ward"): counts()})
    assert len(days.read(tmp_path)) == days.MOST_DAYS
    assert min(days.read(tmp_path)) == "2026-04-04"
    (tmp_path / days.FILE).write_bytes(b"{")
    assert days.read(tmp_path) == {}
    days.add(tmp_path, DAY, {("door", "ward"): counts()})
    assert list(days.read(tmp_path)) == ["2026-11-24"]


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_the_recorder_counts_its_lifts_rides_and_writes_once_an_hour_and_at_its_end(
    machine: Machine,
) -> None:
    asks = LiftRequest(lift_name="Lift1", session_id="f/r", request_type=1, destination_floor="L1")
    state = LiftState(lift_name="Lift1", current_floor="L2", current_mode=LiftMode.MODE_AGV)
    here = LiftState(
        lift_name="Lift1", current_floor="L1", door_state=2, session_id="f/r", current_mode=2
    )

    def waits() -> None:
        machine.say("adapter_lift_requests", asks)
        machine.say("lift_states", state, sent=True)

    machine.live(5, lambda: machine.say("lift_states", state, sent=True))
    machine.live(20, waits)
    machine.live(1, lambda: machine.say("lift_states", here, sent=True))
    assert machine.files() == []
    machine.day += timedelta(days=1)
    machine.live(1)
    assert list(days.read(machine.out)) == ["2026-11-24"]
    machine.recorder.close()
    found = days.read(machine.out)
    [row] = days.rows(found, DAY, 1)
    assert row.cells[:7] == ("lift", "Lift1", "0", "1", "≤ 20", "≤ 20", "1")

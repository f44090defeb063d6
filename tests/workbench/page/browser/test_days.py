"""The page's views of one day and of one week. Their tables fit a phone, and there is a CSV file."""

from collections.abc import Iterator
from datetime import date, timedelta
from pathlib import Path

import pytest
from playwright.sync_api import Page

from bridges.blackbox import days
from bridges.observe.tally import DeviceCounts
from tests.workbench.page import recorded
from tests.workbench.page.browser.conftest import Shot, page, serious_faults

pytestmark = pytest.mark.browser
HOSTILE = "<img src=x onerror=alert(1)>"


def counts(waits: int, cycles: int) -> DeviceCounts:
    made = DeviceCounts(cycles=cycles, watched_s=36000.0, served_s=35640.0)
    for number in range(waits):
        made.waits.add(10.0 + number)
        made.rides.add(20.0)
    return made


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("days")
    today = date.today()
    for back in range(3):
        lift = counts(20, 41)
        days.add(
            made,
            today - timedelta(back),
            {("lift", "Lift1"): lift, ("door", HOSTILE): counts(0, 7)},
        )
    return made


@pytest.fixture(scope="module")
def address(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    ride = recorded.write(tmp_path_factory.mktemp("ride") / "ride.mcap")
    with page(str(ride), "--incidents", str(folder)) as found:
        yield found


def test_the_day_and_the_week_stand_in_two_tables_and_no_name_is_markup(
    tab: Page, address: str, shot: Shot
) -> None:
    tab.goto(address)
    tab.get_by_role("link", name="Day and week").click()
    tab.locator("table").nth(1).wait_for()
    rows = [row.split("\t") for row in tab.locator("tbody tr").all_inner_texts()]
    assert [(row[1], row[2]) for row in rows] == [
        (HOSTILE, ""),
        ("Lift1", "20"),
        (HOSTILE, ""),
        ("Lift1", "60"),
    ]
    assert tab.locator("main img").count() == 0
    shot("days")
    assert serious_faults(tab) == []


def test_the_csv_has_every_day(tab: Page, address: str, tmp_path: Path) -> None:
    tab.goto(f"{address}days")
    with tab.expect_download() as download:
        tab.get_by_role("link", name="Every day as CSV").click()
    download.value.save_as(tmp_path / "days.csv")
    lines = (tmp_path / "days.csv").read_text().splitlines()
    assert len(lines) == 1 + 3 * 2
    assert lines[0].startswith("day,kind,device,rides")

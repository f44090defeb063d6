"""Recordings on the page: the list, the view of a recording with timeline and explanation, and the
file."""

import shutil
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest
from mcap.writer import CompressionType
from playwright.sync_api import Browser, BrowserContext, Page
from zstandard import compress

from tests.workbench.page import recorded
from tests.workbench.page.browser.conftest import Shot, page, serious_faults
from tests.workbench.replay.test_hostile_bags import chunk, states
from workbench.replay.bags import heard_in
from workbench.replay.mcap_read import LONGEST_RECORD, MAGIC

pytestmark = pytest.mark.browser
KEPT = "lift_north_2026-11-18_13-04-05_fault-overload_0a1b2c3d.mcap"
TITLE = "lift_north: fault overload"
MIDDLE = """() => { const one = document.querySelector('.timeline');
  return (one.scrollLeft + one.clientWidth / 2) / one.scrollWidth; }"""
HOSTILE = "<img src=x onerror=alert(1)>.mcap"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("incidents")
    whole = recorded.write(made / "ride.mcap")
    (made / "cut.mcap").write_bytes(whole.read_bytes()[:3000])
    (made / HOSTILE).write_bytes(b"nothing of ours")
    (made / "bomb.mcap").write_bytes(MAGIC + chunk(b"zstd", compress(bytes(4 * LONGEST_RECORD)), 9))
    (made / "rosbag2.mcap").write_bytes(states(20, compression=CompressionType.ZSTD))
    recorded.write(made / KEPT)
    (made / "notes.txt").write_text("secret")
    (made / "passwd.mcap").symlink_to("/etc/passwd")
    recorded.write(made / "hostile.mcap", lift="<img src=x onerror=alert(1)>")
    return made


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    """Yield the address of a page that shows no live graph. The page shows one recording, and a folder
    of recordings."""
    with page(str(folder / "ride.mcap"), "--incidents", str(folder)) as found:
        yield found


def test_the_list_has_the_recordings_and_nothing_else(tab: Page, address: str, shot: Shot) -> None:
    tab.goto(f"{address}incidents")
    tab.locator(".incidents li").first.wait_for()
    found = sorted(tab.locator(".incidents a").all_inner_texts())
    assert found == [
        HOSTILE,
        "bomb.mcap",
        "cut.mcap",
        "hostile.mcap",
        TITLE,
        "ride.mcap",
        "rosbag2.mcap",
    ]
    assert tab.locator("main img").count() == 0
    shot("incidents")


def test_an_incident_opens_with_its_sentences_and_its_timeline(
    tab: Page, address: str, folder: Path, shot: Shot
) -> None:
    tab.goto(f"{address}incidents")
    tab.get_by_role("link", name="ride.mcap", exact=True).click()
    tab.locator(".timeline svg").wait_for()
    assert "car is at L3" in tab.inner_text("main")
    assert "fleet/robot" in tab.locator(".timeline").inner_text()
    shot("incident")
    with tab.expect_download() as download:
        tab.get_by_role("link", name="Download").click()
    kept = folder.parent / "kept.mcap"
    download.value.save_as(kept)
    assert kept.read_bytes() == (folder / "ride.mcap").read_bytes()
    assert len(list(heard_in(kept))) == 105


def test_the_list_shows_device_reason_and_the_browsers_time_and_has_a_filter(
    browser: Browser, address: str
) -> None:
    """Check that the filter finds the day that the list shows. In the browser's time zone, this day
    differs from the day in the file's name."""
    zone = ZoneInfo("Pacific/Kiritimati")
    with browser.new_context(timezone_id=zone.key) as context:
        tab = context.new_page()
        tab.goto(f"{address}incidents")
        kept = tab.locator(".incidents li", has_text="lift_north")
        at = datetime.strptime("2026-11-18 13:04:05", "%Y-%m-%d %H:%M:%S").timestamp()
        day = f"{datetime.fromtimestamp(at, zone):%Y-%m-%d}"
        assert kept.locator("a").inner_text() == TITLE
        assert KEPT in kept.locator(".file").inner_text()
        when = kept.locator("time")
        assert when.inner_text() == f"{datetime.fromtimestamp(at, zone):%Y-%m-%d %H:%M:%S}"
        assert tab.locator(".zone").inner_text() == f"Times: {zone.key}"
        for typed in ("Overload", day):
            tab.get_by_label("Find a device, reason or day").fill(typed)
            assert tab.locator(".incidents a:visible").all_inner_texts() == [TITLE]
        tab.get_by_label("Find a device, reason or day").fill("2026-11-18")
        found = [] if day != "2026-11-18" else [TITLE]
        assert tab.locator(".incidents a:visible").all_inner_texts() == found


def test_an_incidents_title_is_its_device_and_reason(tab: Page, address: str) -> None:
    tab.goto(f"{address}incidents/{KEPT}")
    tab.locator(".timeline svg").wait_for()
    assert tab.locator("h1").inner_text() == TITLE
    assert tab.title() == f"{TITLE} · RMF bridges"
    assert KEPT in tab.locator(".about").inner_text()


def test_an_incident_opens_at_its_reason_and_in_the_browsers_zone(
    browser: Browser, address: str
) -> None:
    with browser.new_context(
        viewport={"width": 390, "height": 800}, timezone_id="Asia/Kolkata"
    ) as context:
        tab = context.new_page()
        tab.goto(f"{address}incidents/{KEPT}")
        tab.locator(".timeline[data-opened] svg").wait_for()
        assert "Kept for: OPERATOR: Lift1: <b>it was slow</b>" in tab.locator("#main").inner_text()
        middle = tab.evaluate(MIDDLE)
        assert 0.4 < middle < 0.6  # the note is in the middle of the minute
        began = datetime.fromtimestamp(recorded.WALL, ZoneInfo("Asia/Kolkata"))
        assert f"from {began:%Y-%m-%d %H:%M:%S}" in tab.locator(".timeline").inner_text()


@pytest.mark.parametrize("path", ["incidents/none.mcap", "nothing", "incidents/none.mcap/file"])
def test_there_is_no_view_of_what_is_not_there(tab: Page, address: str, path: str) -> None:
    assert tab.request.get(f"{address}{path}").status == 404


def test_a_recording_is_shown_without_any_graph(tab: Page, address: str) -> None:
    tab.goto(address)
    tab.locator(".timeline svg").wait_for()
    assert tab.locator("h1").inner_text() == "ride.mcap"
    assert tab.title() == "ride.mcap · RMF bridges"


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("cut.mcap", "damaged"),
        ("bomb.mcap", "does not unpack to"),
        (HOSTILE, "not a recording"),
        ("passwd.mcap", "no incident"),
    ],
)
def test_a_foreign_file_is_reported_as_damaged_or_as_no_recording(
    tab: Page, address: str, name: str, told: str, complaints: list[str]
) -> None:
    answer = tab.goto(f"{address}incidents/{name}")
    tab.get_by_text(told).first.wait_for()
    there = told != "no incident"
    assert answer is not None
    assert answer.status == (200 if there else 404)
    assert len(complaints) == (0 if there else 1)
    complaints.clear()


def test_a_recording_of_rosbag2_is_shown(tab: Page, address: str) -> None:
    tab.goto(f"{address}incidents/rosbag2.mcap")
    tab.get_by_role("heading", name="lift Lift19").wait_for()
    assert tab.locator(".timeline svg").count() == 20


def test_a_file_from_elsewhere_is_opened_by_its_name_too(
    context: BrowserContext, folder: Path, tmp_path: Path
) -> None:
    told = {
        "cut.mcap": "damaged",
        "bomb.mcap": "does not unpack to",
        HOSTILE: "not a recording",
        "rosbag2.mcap": "lift Lift19",
    }
    opened = tmp_path / HOSTILE
    shutil.copy(folder / "rosbag2.mcap", opened)
    tab = context.new_page()
    with page(str(opened)) as alone:
        opened.unlink()
        tab.goto(alone)
        tab.get_by_text("No such file").first.wait_for()
        for name, text in told.items():
            shutil.copy(folder / name, opened)
            tab.reload()
            tab.get_by_text(text).first.wait_for()
            assert tab.locator("h1").inner_text() == HOSTILE
        tab.close()


def test_axe_finds_no_serious_fault_in_an_opened_incident(tab: Page, address: str) -> None:
    tab.goto(f"{address}incidents/ride.mcap")
    tab.locator(".timeline svg").wait_for()
    tab.locator("summary").first.click()
    tab.locator("details[open]").wait_for()
    assert serious_faults(tab) == []


def test_a_hostile_device_name_in_a_recording_is_shown_as_text(tab: Page, address: str) -> None:
    tab.goto(f"{address}incidents/hostile.mcap")
    tab.locator(".timeline svg").wait_for()
    assert tab.locator("main img").count() == 0
    assert "<img src=x onerror=alert(1)>" in tab.locator("h2").first.inner_text()


@pytest.mark.parametrize(
    "name",
    ["../notes.txt", "..%2f..%2fetc%2fpasswd", "%2fetc%2fpasswd", "notes.txt", "passwd.mcap"],
)
def test_no_path_leads_out_of_the_folder(tab: Page, address: str, name: str) -> None:
    found = tab.request.get(f"{address}incidents/{name}/file")
    assert found.status == 404
    assert "root:" not in found.text()
    assert "secret" not in found.text()

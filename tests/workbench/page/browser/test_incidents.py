"""Recordings on the page: the list, one of them with its timeline and its why, and the file itself."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from mcap.writer import CompressionType
from playwright.sync_api import BrowserContext, Page
from zstandard import compress

from tests.workbench.page import recorded
from tests.workbench.page.browser.conftest import Shot, page, serious_faults
from tests.workbench.replay.test_hostile_bags import chunk, states
from workbench.replay.bags import heard_in
from workbench.replay.mcap_read import LONGEST_RECORD, MAGIC

pytestmark = pytest.mark.browser
HOSTILE = "<img src=x onerror=alert(1)>.mcap"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("incidents")
    whole = recorded.write(made / "ride.mcap")
    (made / "cut.mcap").write_bytes(whole.read_bytes()[:3000])
    (made / HOSTILE).write_bytes(b"nothing of ours")
    (made / "bomb.mcap").write_bytes(MAGIC + chunk(b"zstd", compress(bytes(4 * LONGEST_RECORD)), 9))
    (made / "rosbag2.mcap").write_bytes(states(20, compression=CompressionType.ZSTD))
    (made / "notes.txt").write_text("secret")
    (made / "passwd.mcap").symlink_to("/etc/passwd")
    recorded.write(made / "hostile.mcap", lift="<img src=x onerror=alert(1)>")
    return made


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    """A page that has opened one recording, without a graph, and knows a folder of them."""
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
    tab: Page, address: str, name: str, told: str
) -> None:
    tab.goto(f"{address}incidents/{name}")
    tab.get_by_text(told).first.wait_for()


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

"""The list of recordings. Device, reason and time come from the file's name."""

import os
from pathlib import Path

import pytest

from tests.workbench.page import recorded
from workbench.page.incidents import listed, read


@pytest.mark.parametrize(
    ("stem", "device", "reason"),
    [
        ("door_1_2026-11-18_03-04-05_fault-stuck", "door_1", "fault-stuck"),
        ("lift_2026-11-18_03-04-05_died", "lift", "died"),
        ("lift_2026-13-18_03-04-05_died", "", ""),
        ("ride", "", ""),
        ("a_b_c_d", "", ""),
    ],
)
def test_device_and_reason_are_in_the_name_of_our_recorders_files(
    tmp_path: Path, stem: str, device: str, reason: str
) -> None:
    (tmp_path / f"{stem}_0a1b2c3d.mcap").write_bytes(b"")
    (found,) = listed(tmp_path)
    assert (found.device, found.reason) == (device, reason)


def test_the_newest_by_its_name_comes_first_whatever_copied_it(tmp_path: Path) -> None:
    for day, written in ((17, 300), (19, 100), (18, 200)):
        path = tmp_path / f"lift_2026-11-{day}_03-04-05_died_0a1b2c3d.mcap"
        path.write_bytes(b"")
        os.utime(path, (written, written))
    assert [one.name[13:15] for one in listed(tmp_path)] == ["19", "18", "17"]


def test_the_reason_for_a_file_is_marked_where_it_was(tmp_path: Path) -> None:
    found = read(recorded.write(tmp_path / "ride.mcap"), {})
    ((_, timeline),) = found.devices
    assert [text for _, text in found.reasons] == ["OPERATOR: Lift1: <b>it was slow</b>"]
    assert [mark.label for mark in timeline.steps] == ["OPERATOR: Lift1: <b>it was slow</b>"]
    assert found.opens_at(timeline) == pytest.approx(30 / 59, abs=0.02)

"""Recordings of rosbag2. Each release and storage format gives the same values."""

import shutil
from pathlib import Path

import pytest
from rosbags.rosbag2 import StoragePlugin

from bridges.messages.definitions import (
    Bool,
    DoorMode,
    DoorRequest,
    FleetState,
    LiftRequest,
    LiftState,
    RobotMode,
    RobotState,
    Time,
)
from bridges.messages.heard import Heard
from bridges.messages.releases import JAZZY, KILTED, RELEASES, Release
from bridges.messages.rihs01 import MESSAGES, type_name
from bridges.messages.texts import releases_of, text
from tests.workbench.replay.written import MCAP, SQLITE, store, write
from workbench.replay.bags import BagError, Notes, heard_in
from workbench.replay.sources import releases

WALL = 1_800_000_000.0
FLEET = FleetState("mir", (RobotState(name="r1", mode=RobotMode(mode=2)),))


def heard(*messages: tuple[str, object]) -> list[Heard]:
    """Return these messages with times of hearing. One message comes each second."""
    return [
        Heard(WALL + second, WALL + second, topic, message)  # type: ignore[arg-type]
        for second, (topic, message) in enumerate(messages)
    ]


RIDE = heard(
    ("lift_requests", LiftRequest("Lift1", Time(5, 6), "mir/r1", 1, "L3", 2)),
    ("lift_states", LiftState(Time(5, 7), "Lift1", ("L1", "L3"), "L1", "L3", 0, 1, (1, 2), 2)),
    ("door_requests", DoorRequest(Time(9), "mir/r1", "D1", DoorMode(2))),
    ("fire_alarm_trigger", Bool(True)),
    ("fleet_states", FLEET),
)


@pytest.mark.parametrize("storage", [MCAP, SQLITE], ids=["mcap", "sqlite3"])
@pytest.mark.parametrize("release", RELEASES.values(), ids=lambda release: release.name)
def test_a_recording_of_each_release_and_storage_gives_what_was_heard(
    tmp_path: Path, release: Release, storage: StoragePlugin
) -> None:
    notes = Notes()
    bag = write(tmp_path / "bag", RIDE, release, storage)

    assert list(heard_in(bag, notes)) == RIDE
    assert (notes.skipped, notes.damage) == ({"scan: not RMF's": 5}, "")


@pytest.mark.parametrize("storage", [MCAP, SQLITE], ids=["mcap", "sqlite3"])
def test_the_file_alone_is_read_as_its_directory_is(tmp_path: Path, storage: StoragePlugin) -> None:
    bag = write(tmp_path / "bag", RIDE, KILTED, storage)
    (bag / "metadata.yaml").unlink()
    only = next(bag.iterdir())

    assert list(heard_in(only)) == RIDE
    assert list(heard_in(bag)) == RIDE


def test_the_files_of_a_long_recording_are_read_in_their_order(tmp_path: Path) -> None:
    whole = tmp_path / "whole"
    whole.mkdir()
    for number, one in ((10, RIDE[1]), (2, RIDE[0])):
        bag = write(tmp_path / str(number), [one], KILTED)
        shutil.move(next(bag.glob("*.mcap")), whole / f"ride_{number}.mcap")

    assert list(heard_in(whole)) == RIDE[:2]


def test_a_clock_that_is_set_back_in_the_middle_never_turns_recorded_time_back(
    tmp_path: Path,
) -> None:
    state = LiftState(lift_name="Lift1")
    walls = [WALL, WALL + 1, WALL - 3599, WALL - 3598.5, WALL - 3598.6]
    bag = write(tmp_path / "bag", [Heard(w, w, "lift_states", state) for w in walls], KILTED)

    read = list(heard_in(bag))

    assert [one.wall for one in read] == walls
    assert [one.at - WALL for one in read] == pytest.approx([0, 1, 1, 1.5, 1.5], abs=1e-5)


@pytest.mark.parametrize("release", RELEASES.values(), ids=lambda release: release.name)
def test_each_definition_is_recognised_in_our_text_and_in_that_of_rosbags(
    release: Release,
) -> None:
    types = store(release)
    for message_type in filter(release.has, MESSAGES.values()):
        theirs, _ = types.generate_msgdef(type_name(message_type), ros_version=2)
        assert release in releases_of(message_type, text(message_type, release))
        assert release in releases_of(message_type, theirs)


def test_constants_comments_and_defaults_of_a_definition_change_nothing() -> None:
    written = (
        "# The mode.\nuint32 MODE_CLOSED = 0\nuint32 MODE_OPEN=2 # open\n"
        'builtin_interfaces/msg/Time request_time\nstring requester_id "x"\nstring<=64 door_name\n'
        "DoorMode requested_mode\n" + "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\n"
        "uint32 nanosec\n" + "=" * 80 + "\nMSG: rmf_door_msgs/DoorMode\nuint32 value\n"
    )
    assert releases_of(DoorRequest, written) == [KILTED, JAZZY]


def test_a_message_of_our_name_and_another_definition_is_skipped() -> None:
    other = text(LiftRequest, KILTED).replace("uint8 door_state\n", "")
    deep = "rmf_lift_msgs/LiftRequest again\n" + "=" * 80 + "\nMSG: rmf_lift_msgs/LiftRequest\n"

    assert releases("rmf_lift_msgs/msg/LiftRequest", other) == []
    assert releases("rmf_lift_msgs/msg/LiftRequest", deep + "LiftRequest again\n") == []
    assert releases("rmf_lift_msgs/msg/LiftRequest", "", "RIHS01_of_nobody") == []


def test_a_file_that_is_not_a_recording_is_named_with_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "packed").mkdir()
    (tmp_path / "packed" / "ride_0.db3.zstd").touch()
    said = {}
    for name in ("none", "notes.txt", "packed", "."):
        with pytest.raises(BagError) as refused:
            list(heard_in(tmp_path / name))
        said[name] = str(refused.value).replace(str(tmp_path), "")

    assert said == {
        "none": "/none cannot be read: No such file or directory",
        "notes.txt": "/notes.txt is not a recording: neither MCAP nor a .db3 file of rosbag2",
        "packed": "/packed is compressed as whole files: unpack them with zstd -d",
        ".": " holds no recording: it has no .mcap or .db3 file",
    }

"""The file in which a daemon keeps the memories of its devices. Also a person's order about a
device."""

from pathlib import Path

import msgspec
import pytest

from bridges.kinds.dispenser import keep
from bridges.kinds.dispenser.memory import Job, WorkcellMemory
from bridges.kinds.shared.decision import (
    DecidedByPerson,
    DrillOrdered,
    MemoryKept,
    MemoryNotKept,
    OperatorReset,
)
from bridges.runtime import holder, order
from bridges.runtime.device_memory import NO_FILE, AlarmMemory, DeviceKeeper, DeviceMemories
from bridges.runtime.runtime_directory import MemoryFile

QUEUED = WorkcellMemory(jobs=(Job("a"),))


class Full:
    """A disk that becomes full after this number of writes."""

    def __init__(self, writes: int) -> None:
        self.writes = writes

    def read(self) -> bytes | None:
        return None

    def write(self, kept: bytes) -> None:
        self.writes -= 1
        if self.writes < 0:
            raise OSError("no space left on device")


def test_two_devices_share_a_file_and_each_finds_its_own_part(tmp_path: Path) -> None:
    file = MemoryFile(tmp_path / "state" / "kept.json")
    memories = DeviceMemories(file)
    for name in ("a", "b"):
        memories.write(name, keep.persist(WorkcellMemory(jobs=(Job(name),))))
    again = DeviceMemories(file)
    assert again.lost == ""
    found = {name: keep.restore(again.read(name) or b"", 0.0).jobs[0].guid for name in ("a", "b")}
    assert found == {"a": "a", "b": "b"}
    for of in (again, DeviceMemories(MemoryFile(tmp_path / "none" / "kept.json"))):
        assert DeviceKeeper("c", keep.KEEPING, of).restore(WorkcellMemory(), 0.0).lost == NO_FILE


def test_the_alarm_shares_the_file_with_the_devices(tmp_path: Path) -> None:
    """Two stores of one path would each replace what the other has written."""
    file = MemoryFile(tmp_path / "kept.json")
    memories = DeviceMemories(file)
    alarm = AlarmMemory(memories)
    assert alarm.read() is None
    alarm.write(b'"raised"')
    memories.write("a", b'"latched"')
    alarm.write(b'"over"')
    again = DeviceMemories(file)
    assert (again.read("a"), AlarmMemory(again).read()) == (b'"latched"', b'"over"')
    file.write(b"{")
    with pytest.raises(OSError, match="the memory on disk cannot be read"):
        AlarmMemory(DeviceMemories(file)).read()


def test_a_simulation_without_a_file_has_lost_nothing() -> None:
    keeper = DeviceKeeper("a", keep.KEEPING, DeviceMemories(Full(9), new=True))
    assert keeper.restore(QUEUED, 0.0) == QUEUED


def test_a_failed_write_is_repeated_each_second_and_only_changes_are_written() -> None:
    disk = Full(1)
    keeper = DeviceKeeper("a", keep.KEEPING, DeviceMemories(disk, new=True))
    assert keeper.keep(WorkcellMemory(), 0.0) == MemoryKept()
    assert keeper.keep(WorkcellMemory(), 0.1) is None
    failed = MemoryNotKept("no space left on device")
    assert [keeper.keep(QUEUED, at) for at in (0.2, 0.3, 1.3)] == [failed, None, failed]
    disk.writes = 1
    assert [keeper.keep(QUEUED, at) for at in (2.0, 2.4, 2.5)] == [None, MemoryKept(), None]


def _left(folder: Path, number: int, **fields: object) -> Path:
    """Write an order to this process, with these fields more. Return its path."""
    ours = holder.ourselves(folder / "x.yaml", serves=True)
    path = folder / order.ORDERS.replace("*", str(number))
    order_ = {"pid": ours.pid, "started": ours.started, "id": str(number)} | fields
    path.write_bytes(msgspec.json.encode(order_))
    return path


def _taken(folder: Path) -> list[str]:
    folder.chmod(0o700)
    found = [f"{one.id} {one.event}" for one in order.take(folder, folder / "x.yaml")]
    assert list(folder.glob(order.ORDERS)) == []
    return found


def test_every_order_is_taken_once_and_the_oldest_first(tmp_path: Path) -> None:
    _left(tmp_path, 2, verdict={"verdict": "again", "request": "guid"}, device="store")
    _left(tmp_path, 3, reset=True)
    _left(tmp_path, 1, drill_s=0.0)
    told = [DrillOrdered(0.0), DecidedByPerson("again", "guid"), OperatorReset()]
    assert _taken(tmp_path) == [f"{at} {event}" for at, event in enumerate(told, start=1)]
    assert _taken(tmp_path) == []


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"drill_s": 0.0, "of_a_later_version": 1},
        {"drill_s": 0.0, "reset": True},
        {"reset": True, "started": 1},
    ],
    ids=["says nothing", "later version", "says two things", "to another process"],
)
def test_an_order_that_is_not_to_us_or_not_understood_is_logged_and_is_no_order(
    tmp_path: Path, fields: dict[str, object], caplog: pytest.LogCaptureFixture
) -> None:
    path = _left(tmp_path, 1, **fields)
    assert _taken(tmp_path) == []
    assert str(path) in caplog.text


def test_a_damaged_order_is_no_order(tmp_path: Path) -> None:
    _left(tmp_path, 1).write_bytes(b"{")
    assert _taken(tmp_path) == []

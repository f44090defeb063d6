"""The file in which a daemon keeps the memories of its devices. Also a person's order about a
device."""

import os
from pathlib import Path

import msgspec
import pytest

from bridges.kinds.dispenser import keep
from bridges.kinds.dispenser.memory import Job, WorkcellMemory
from bridges.kinds.shared.decision import DecidedByPerson, MemoryKept, MemoryNotKept
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


@pytest.mark.parametrize("shift", [0, 1])
def test_an_order_is_obeyed_by_the_process_that_it_names_and_by_no_other(
    tmp_path: Path, shift: int
) -> None:
    tmp_path.chmod(0o700)
    ours = holder.ourselves(tmp_path / "x.yaml", serves=True)
    verdict = DecidedByPerson("again", "guid")
    started = ours.started + shift
    given = order.PersonsOrder(os.getpid(), started, "1", "store", verdict)
    path = tmp_path / order.ORDER
    path.write_bytes(msgspec.json.encode(given))
    assert order.take(tmp_path, tmp_path / "x.yaml") == (None if shift else given)
    assert not path.exists()
    assert order.take(tmp_path, tmp_path / "x.yaml") is None


def test_a_damaged_order_is_no_order(tmp_path: Path) -> None:
    tmp_path.chmod(0o700)
    path = tmp_path / order.ORDER
    path.write_bytes(b"{")
    assert order.take(tmp_path, tmp_path / "x.yaml") is None
    assert not path.exists()

"""The memories of a daemon's devices, and of its alarm, that must survive a restart. They share one
file.

A device's thread first writes the device's memory to the file. Only then does the thread switch an
output or publish a state that depends on this memory. If writing fails, the thread tells the device's
core the reason, and tries again each second.
"""

import logging
import threading
from typing import Final, Generic

import msgspec

from bridges.kinds.shared import keep
from bridges.kinds.shared.decision import M, MemoryKept, MemoryNotKept
from bridges.kinds.shared.durations import AGES_AGO
from bridges.kinds.shared.kind import Keeping
from bridges.runtime.keeper import AGAIN_S, MemoryStore
from bridges.system.log import pairs

log = logging.getLogger(__name__)

VERSION: Final = 1
NO_FILE: Final = "no memory on disk: this is the first start, or the memory was removed"
ALARM: Final = ""
"""The name of the alarm's entry in the file. No device has an empty name."""


class KeptDevices(keep.Kept, frozen=True, forbid_unknown_fields=True):
    """The content of the file. `devices`: maps each device to its memory as JSON text. Each kind of
    device defines the form of this text."""

    devices: dict[str, msgspec.Raw]


class Unkept:
    """A store that keeps nothing. It serves for tests, and for kinds that keep no memory on disk."""

    def read(self) -> bytes | None:
        """Return None."""
        return None

    def write(self, kept: bytes) -> None:
        """Do nothing."""


class DeviceMemories:
    """The file of one daemon's devices. `lost`: the reason why the file cannot be read, or "".

    `new`: Does a missing entry mean that the device has never run before? A simulation may assume this
    of every kind.
    """

    def __init__(self, store: MemoryStore, *, new: bool = False) -> None:
        self._store = store
        self._lock = threading.Lock()
        self._found: dict[str, bytes] = {}
        self.lost, self.new = "", new
        try:
            kept = store.read()
            if kept is not None:
                found = keep.read(kept, KeptDevices, VERSION, "the memory of devices")
                self._found = {name: bytes(raw) for name, raw in found.devices.items()}
        except (OSError, ValueError) as error:
            self.lost = f"the memory on disk cannot be read: {error}"

    def read(self, device: str) -> bytes | None:
        """Return the bytes of this device's memory. Return None if the file has no entry for the
        device."""
        return self._found.get(device)

    def write(self, device: str, kept: bytes) -> None:
        """Replace the bytes of this device's memory. On return the bytes are on disk. Any thread may
        call this method. Raises OSError."""
        with self._lock:
            found = {**self._found, device: kept}
            content = KeptDevices(VERSION, {name: msgspec.Raw(raw) for name, raw in found.items()})
            self._store.write(msgspec.json.encode(content))
            self._found = found


class AlarmMemory:
    """The alarm's entry in the file, as a store of its own."""

    def __init__(self, memories: DeviceMemories) -> None:
        self._memories = memories

    def read(self) -> bytes | None:
        """Return the alarm's bytes, or None without an entry. Raises OSError for a damaged file."""
        if self._memories.lost:
            raise OSError(self._memories.lost)
        return self._memories.read(ALARM)

    def write(self, kept: bytes) -> None:
        """Replace the alarm's bytes. Raises OSError."""
        self._memories.write(ALARM, kept)


class DeviceKeeper(Generic[M]):
    """The keeper of one device's memory."""

    def __init__(self, device: str, keeping: Keeping[M], memories: DeviceMemories) -> None:
        self._device = device
        self._keeping = keeping
        self._memories = memories
        self._part: object = None
        self._bytes: bytes | None = None
        self._again_at = AGES_AGO
        self._failing = False

    def restore(self, initial: M, now: float) -> M:
        """Return the device's memory from disk. For a device that has never run return `initial`. If
        the memory is lost, log the reason, and return the memory with which the kind begins after such
        a loss."""
        kept, lost = self._memories.read(self._device), self._memories.lost
        new = self._memories.new or self._keeping.missing_is_new
        if kept is None and new and not lost:
            self._part = self._keeping.part(initial)
            return initial
        reason = lost or NO_FILE
        try:
            if kept is not None:
                return self._keeping.restore(kept, now)
        except ValueError as error:
            reason = f"the memory on disk is damaged: {error}"
        log.error(pairs("not_restored", device=self._device, reason=reason))
        return self._keeping.lost(reason)

    def keep(self, memory: M, now: float) -> MemoryKept | MemoryNotKept | None:
        """Write the memory if the part that must survive has changed. Return None if nothing was
        written."""
        part = self._keeping.part(memory)
        if now < self._again_at or (part == self._part and not self._failing):
            return None
        kept = self._keeping.persist(memory)
        self._part = part
        if kept == self._bytes and not self._failing:
            return None
        try:
            self._memories.write(self._device, kept)
        except OSError as error:
            self._again_at, self._failing = now + AGAIN_S, True
            return MemoryNotKept(str(error))
        self._bytes, self._failing = kept, False
        return MemoryKept()

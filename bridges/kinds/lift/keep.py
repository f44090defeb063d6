"""The part of a lift's memory that is saved to disk: whether a fire has latched. If this memory is
damaged, a fire counts as latched, because only a person may decide that there was none."""

from typing import Final

import msgspec

from bridges.kinds.lift.memory import LiftMemory
from bridges.kinds.shared import keep
from bridges.kinds.shared.kind import Keeping

VERSION: Final = 1


class KeptLift(keep.Kept, frozen=True, forbid_unknown_fields=True):
    """The part of LiftMemory that is saved to disk."""

    fire_latched: bool


def restore(kept: bytes, now: float) -> LiftMemory:
    """Decode the memory. Raises ValueError for bytes that are no such memory."""
    found = keep.read(kept, KeptLift, VERSION, "the memory of a lift")
    return LiftMemory(fire_latched=found.fire_latched)


def lost(reason: str) -> LiftMemory:
    """Return the memory for a start that cannot know of a fire. The lift waits for an operator."""
    return LiftMemory(fire_latched=True)


KEEPING: Final = Keeping[LiftMemory](
    part=lambda memory: memory.fire_latched,
    persist=lambda memory: msgspec.json.encode(KeptLift(VERSION, memory.fire_latched)),
    restore=restore,
    lost=lost,
    missing_is_new=True,
    outputs_first=True,
)

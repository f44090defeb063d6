"""The part of one robot's memory that is saved to disk: whether we have paused the robot. If this
memory is lost, the robot is not resumed."""

from typing import Final

import msgspec

from bridges.kinds.fleet.memory import LightMemory, RobotMemory
from bridges.kinds.shared import keep
from bridges.kinds.shared.kind import Keeping

VERSION: Final = 1


class KeptRobot(keep.Kept, frozen=True, forbid_unknown_fields=True):
    """The part of RobotMemory that is saved to disk."""

    held: bool


def restore(kept: bytes, now: float) -> RobotMemory:
    """Decode the memory. Raises ValueError for bytes that are no such memory."""
    found = keep.read(kept, KeptRobot, VERSION, "the memory of a robot")
    return RobotMemory(light=LightMemory(held=found.held), started_at=now)


KEEPING: Final = Keeping[RobotMemory](
    part=lambda memory: memory.light.held,
    persist=lambda memory: msgspec.json.encode(KeptRobot(VERSION, memory.light.held)),
    restore=restore,
    lost=lambda reason: RobotMemory(),
    missing_is_new=True,
)

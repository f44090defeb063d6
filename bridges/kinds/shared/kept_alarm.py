"""The memory of a daemon's alarm on disk, for a restart."""

from typing import Final

import msgspec

from bridges.kinds.shared import keep
from bridges.kinds.shared.fleet_alarm import UNKNOWN
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmCause,
    FleetAlarmMemory,
)

VERSION: Final = 1


class KeptAlarm(keep.Kept, frozen=True, forbid_unknown_fields=True):
    """The parts of a `FleetAlarmMemory` that are saved to disk. `latched` lists the alarm's causes.
    Each cause is the name of a device and the name of its signal."""

    latched: list[tuple[str, str]]
    told: list[str] | None
    others: dict[str, list[str]]


def persist(memory: FleetAlarmMemory) -> bytes:
    """Encode the memory for the next start. The bytes change only when a part that is saved changes."""
    return msgspec.json.encode(
        KeptAlarm(
            VERSION,
            sorted((cause.device, cause.signal) for cause in memory.latched),
            None if memory.told is None else sorted(memory.told),
            {
                node: sorted(fleets)
                for node, fleets in sorted(memory.others.items())
                if not node.startswith(UNKNOWN)  # its retained message comes again after a restart
            },
        )
    )


def restore(kept: bytes) -> FleetAlarmMemory:
    """Return the `FleetAlarmMemory` after a restart, from the bytes of `persist`. Raises ValueError for
    bytes that `persist` did not make."""
    found = keep.read(kept, KeptAlarm, VERSION, "an alarm's memory")
    memory = FleetAlarmMemory(
        latched=tuple(AlarmCause(*cause) for cause in found.latched),
        told=None if found.told is None else frozenset(found.told),
        owed=True,
        others={node: frozenset(fleets) for node, fleets in found.others.items()},
    )
    return msgspec.structs.replace(memory, shown=memory.state)

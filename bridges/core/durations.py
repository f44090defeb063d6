"""Durations (s) that several kinds share, and when a message to a device's node is due."""

import math
from typing import Final

NEVER: Final = math.inf
AGES_AGO: Final = -math.inf

RIVAL_QUIET_S: Final = 5.0
"""A device is ours again when no other node has published its states for so long; they come at 1 Hz."""
SILENT_S: Final = 3.0
"""States of lifts and doors come at 1 Hz. After a gap as long as this the device was silent."""
FORGOTTEN_S: Final = 60.0
"""What nobody holds and nobody mentions is forgotten after so long."""
GAP_S: Final = 0.1
"""A supervisor never sends two requests for one device closer together."""
REPEAT_S: Final = 1.0
"""A request that is still to be obeyed is repeated this often."""


def due_at(sent_at: float, *, new: bool, again: bool) -> float:
    """When a request is to be sent: a new one after GAP_S, the last one `again` after REPEAT_S.

    `sent_at`: when the last one was sent (s; AGES_AGO: never).
    """
    if new:
        return sent_at + GAP_S
    return sent_at + REPEAT_S if again else NEVER

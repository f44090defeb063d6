"""Durations (s) that several kinds share, and when a request to a device is due."""

import math
from typing import Final

NEVER: Final = math.inf
AGES_AGO: Final = -math.inf

RIVAL_QUIET_S: Final = 5.0
"""A device is ours again once no other node has published its states for this long. States come at
1 Hz."""
SILENT_S: Final = 3.0
"""A lift or door is silent after this long without a state. States come at 1 Hz."""
FORGOTTEN_S: Final = 60.0
"""A device or requester that holds nothing is forgotten after this long without a message about it."""
GAP_S: Final = 0.1
"""The least time between two requests that a supervisor sends for one device."""
REPEAT_S: Final = 1.0
"""A request that is not obeyed yet is repeated this often."""


def due_at(sent_at: float, *, new: bool, again: bool) -> float:
    """When a request is due: GAP_S after the last one if it is `new`, REPEAT_S if sent `again`.

    `sent_at`: when the last one was sent (s; AGES_AGO: never).
    """
    if new:
        return sent_at + GAP_S
    return sent_at + REPEAT_S if again else NEVER

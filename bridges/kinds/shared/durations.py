"""Durations (s) shared by several kinds, and the time of the next request to a device."""

import math
from typing import Final

NEVER: Final = math.inf
AGES_AGO: Final = -math.inf

RIVAL_QUIET_S: Final = 5.0
"""Another node that has published no state for this long is no rival any more. States come at 1 Hz."""
SILENT_S: Final = 3.0
"""A lift or door is silent after this long without a state. States come at 1 Hz."""
FORGOTTEN_S: Final = 60.0
"""A device or requester without a message for this long is forgotten, unless it belongs to a
session."""
GAP_S: Final = 0.1
"""The least time between two requests that a supervisor sends for one device."""
REPEAT_S: Final = 1.0
"""The time between repeats of a request that is not obeyed yet."""


def due_at(sent_at: float, *, new: bool, again: bool) -> float:
    """Return the time of the next request: GAP_S after the last if `new`, REPEAT_S if `again`.

    `sent_at`: the time of the last request (s; AGES_AGO: never).
    """
    if new:
        return sent_at + GAP_S
    return sent_at + REPEAT_S if again else NEVER

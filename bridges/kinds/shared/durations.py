"""Durations (s) shared by several kinds, and the function that finds the time of a supervisor's next
request."""

import math
from typing import Final

NEVER: Final = math.inf
AGES_AGO: Final = -math.inf

RIVAL_QUIET_S: Final = 5.0
"""The silence (s) after which another node for the same device no longer counts as a rival. It is
enough because nodes publish states at 1 Hz."""
SILENT_S: Final = 3.0
"""The time (s) without a state after which a lift or door counts as silent. It is enough because states
come at 1 Hz."""
FORGOTTEN_S: Final = 60.0
"""The time (s) without a message after which a device or requester is forgotten, unless it belongs to a
session."""
GAP_S: Final = 0.1
"""The least time (s) between two requests that a supervisor sends for one device."""
REPEAT_S: Final = 1.0
"""The time (s) between repeats of a request that is not obeyed yet."""


def due_at(sent_at: float, *, new: bool, again: bool) -> float:
    """Return the time of the next request. A `new` request is due GAP_S after the last request. A
    repeat (`again`) is due after REPEAT_S.

    `sent_at`: the time (s) of the last request; AGES_AGO if there was none.
    """
    if new:
        return sent_at + GAP_S
    return sent_at + REPEAT_S if again else NEVER

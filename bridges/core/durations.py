"""Times that mean the same everywhere, in monotonic seconds."""

import math
from typing import Final

NEVER: Final = math.inf
"""Later than any time. `-NEVER` is earlier than any."""

RIVAL_GONE_S: Final = 5.0
"""A second node for a device is gone when nothing was heard of it for so long; states come at 1 Hz."""

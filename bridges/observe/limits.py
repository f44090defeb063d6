"""The durations (s) and bounds by which silence, age and repeats are told: one table."""

from typing import Final

from bridges.kinds.shared import durations

SILENT_S: Final = durations.SILENT_S
"""States, heartbeats and diagnostics come at 1 Hz: after three missed ones their sender is silent."""
SLOWEST_S: Final = 5.0
"""The slowest pace that RMF's contract permits is a state every 2 s (docs/how-to/judge.md, RATE):
after this long two are missing, whoever made the node."""
ASKS_WITHIN_S: Final = 3.5
"""A waiting requester repeats itself at each state or each second (rmf_ros2, RobotContext.cpp:1732 and
DoorOpen.cpp). After three missed repeats it has stopped."""
REPEATS_S: Final = 1.5
"""Until we have listened this long, the first request that we hear of somebody may be a repeat."""
GIVEN_UP_S: Final = 10.0
"""A request that was not repeated for this long, though states came, begins anew."""
UNSEEN_S: Final = 10.0
"""After a longer silence it is unknown who was there meanwhile."""
FORGOTTEN_S: Final = durations.FORGOTTEN_S
"""Where there is no room, a device that was silent for this long gives way to another."""
OLD_S: Final = 3.0
"""A reading of this age is old: three polls were missed. One this far ahead is of another clock."""
CLOCKS_DIFFER_S: Final = 5.0
"""A request whose stamp is this far off comes from another clock."""
QUIET_S: Final = 60.0
"""A refusal that comes again within this time is no news."""
STEP_S: Final = 2.0
"""A wall clock that moves this much against the steady one was stepped."""

MOST_REQUESTERS: Final = 100
"""Of one device; a site has some dozens of robots."""
MOST_HOLDERS: Final = 64
"""Of one door."""
MOST_NODES: Final = 8
"""Of ours, that speak of one device."""
MOST_DAEMONS: Final = 500
MOST_VALUES: Final = 100
"""Of one diagnosis; ours have a third of it."""
MOST_CODES: Final = 20
"""Of faults and reasons in one diagnosis."""
MOST_DEVICES: Final = 300
"""Of each kind; a large hospital has 200 doors."""

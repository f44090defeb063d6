"""All durations (s) and bounds for the judgement of silence, age and repeats."""

from typing import Final

from bridges.kinds.shared import durations

SILENT_S: Final = durations.SILENT_S
"""States, heartbeats and diagnostics come at 1 Hz: after three missed ones their sender is silent."""
SLOWEST_S: Final = 5.0
"""RMF's contract permits one state every 2 s at the slowest (docs/how-to/judge.md, RATE): after this
long two states are missing from any make of node."""
REQUESTER_SILENT_S: Final = 3.5
"""A waiting requester repeats itself at each state or each second (rmf_ros2, RobotContext.cpp:1732 and
DoorOpen.cpp). After three missed repeats it has stopped."""
REPEATS_S: Final = 1.5
"""In this time after we began to listen, a requester's first request may be a repeat."""
GIVEN_UP_S: Final = 10.0
"""After this long without a repeat, though states came, a request begins anew."""
UNSEEN_S: Final = 10.0
"""After a longer silence the requesters and holders in between are unknown."""
FORGOTTEN_S: Final = durations.FORGOTTEN_S
"""In a full table, a device silent for this long is replaced by another."""
OLD_S: Final = 3.0
"""A reading of this age is old: three polls were missed. This far ahead, it is by another clock."""
CLOCKS_DIFFER_S: Final = 5.0
"""A request with a stamp this far off comes from another clock."""
FLAPS: Final = 3
FLAPS_WITHIN_S: Final = 30.0
"""A device that goes OFFLINE or comes back this often in this time has readings that come and go."""
QUIET_S: Final = 60.0
"""A repeated refusal within this time is no news."""
STEP_S: Final = 2.0
"""A wall clock that moves this much against the steady clock was stepped."""

MOST_REQUESTERS: Final = 100
"""Bound for one device; a site has some dozens of robots."""
MOST_HOLDERS: Final = 64
"""Bound for one door."""
MOST_SENDERS: Final = 8
"""Bound for the publishers of one device's states."""
MOST_NODES: Final = 8
"""Bound for our nodes that report on one device."""
MOST_DAEMONS: Final = 500
MOST_VALUES: Final = 100
"""Bound for one diagnosis; ours have a third of this number."""
MOST_SPEAKERS: Final = 500
"""Bound for robots and fleets with a last word."""
MOST_CODES: Final = 20
"""Bounds for the faults and for the reasons of refusals in one diagnosis."""
MOST_DEVICES: Final = 300
"""Bound for each kind of device; a large hospital has 200 doors."""

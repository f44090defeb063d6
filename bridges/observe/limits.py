"""All durations (s) and bounds by which silence, age and repeats are judged."""

from typing import Final

from bridges.kinds.shared import durations

SILENT_S: Final = durations.SILENT_S
"""The silence after which a sender of states, heartbeats or diagnostics is silent. They come at 1 Hz,
so three are missing."""
SLOWEST_S: Final = 5.0
"""The silence after which two states are missing from any make of node. RMF's contract permits one
state every 2 s at the slowest (docs/how-to/judge.md, RATE)."""
REQUESTER_SILENT_S: Final = 3.5
"""The silence after which a requester has stopped, because three repeats are missing. A waiting
requester repeats itself at each state or each second (rmf_ros2, RobotContext.cpp:1732 and
DoorOpen.cpp)."""
REPEATS_S: Final = 1.5
"""The time after the start of listening in which a requester's first request may be a repeat."""
GIVEN_UP_S: Final = 10.0
"""The time without a repeat after which a request begins anew, if states came during that time."""
UNSEEN_S: Final = 10.0
"""The longest silence that is bridged. After a longer silence we do not know the requesters and holders
in between."""
FORGOTTEN_S: Final = durations.FORGOTTEN_S
"""The silence after which another device may replace a device in a full table."""
OLD_S: Final = 3.0
"""The age at which a reading is old, because three polls are missing. If a reading's stamp is as far in
the future, the stamp comes from another clock."""
CLOCKS_DIFFER_S: Final = 5.0
"""The distance from our time at which a request's stamp must come from another clock."""
FLAPS: Final = 3
FLAPS_WITHIN_S: Final = 30.0
"""The time in which FLAPS changes to OFFLINE or back show that a device's readings come and go."""
QUIET_S: Final = 60.0
"""The time within which a repeated refusal is no news."""
STEP_S: Final = 2.0
"""The least difference between the wall clock's and the steady clock's progress that counts as a
step."""

MOST_REQUESTERS: Final = 100
"""The most requesters of one device. A site has some dozens of robots."""
MOST_HOLDERS: Final = 64
"""The most holders of one door."""
MOST_SENDERS: Final = 8
"""The most publishers of one device's states."""
MOST_NODES: Final = 8
"""The most nodes of ours that report on one device."""
MOST_DAEMONS: Final = 500
MOST_VALUES: Final = 100
"""The most values in one diagnosis. Our own diagnoses have a third of this number."""
MOST_SPEAKERS: Final = 500
"""The most robots and fleets of which the time of their last message is kept."""
MOST_CODES: Final = 20
"""The most faults, and the most reasons of refusals, in one diagnosis."""
MOST_DEVICES: Final = 300
"""The most devices of one kind. A large hospital has 200 doors."""

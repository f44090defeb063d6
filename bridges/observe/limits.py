"""All durations (s) and limits for the judgement of silence, age and repeats."""

from typing import Final

from bridges.kinds.shared import durations

SILENT_S: Final = durations.SILENT_S
"""The time (s) after which a sender of states, heartbeats or diagnostics counts as silent. The messages
come at 1 Hz, so three are missing."""
SLOWEST_S: Final = 5.0
"""The time (s) without a state after which at least two states of any node are missing. RMF's contract
permits 2 s between states (docs/how-to/judge.md, RATE)."""
REQUESTER_SILENT_S: Final = 3.5
"""The time (s) after which a requester counts as gone, because three repeats are missing. A waiting
requester repeats its request at each state or each second (rmf_ros2, RobotContext.cpp:1732 and
DoorOpen.cpp)."""
REPEATS_S: Final = 1.5
"""The time (s) after the start of listening in which a requester's first request may be a repeat."""
GIVEN_UP_S: Final = 10.0
"""The time (s) without a request after which a requester's next request begins a new visit. This holds
only while the device publishes states."""
UNSEEN_S: Final = 10.0
"""The longest silence (s) after which the holder is assumed to be unchanged. After a longer silence we
do not know when the holder got the device."""
FORGOTTEN_S: Final = durations.FORGOTTEN_S
"""The silence (s) of a device after which another device may take its place in a full table."""
OLD_S: Final = 3.0
"""The age (s) from which a reading is old, because three polls are missing. A stamp that is this far in
the future comes from another clock."""
CLOCKS_DIFFER_S: Final = 5.0
"""The minimum difference (s) between our time and a request's stamp that shows another clock."""
FLAPS: Final = 3
FLAPS_WITHIN_S: Final = 30.0
"""The time (s) in which FLAPS changes to or from OFFLINE show that a device's readings come and go."""
QUIET_S: Final = 60.0
"""The time (s) in which a repeated refusal is no news."""
STEP_S: Final = 2.0
"""The minimum change (s) of the wall clock against the steady clock that counts as a step."""

MOST_REQUESTERS: Final = 100
"""The maximum number of requesters of one device. A site has some dozens of robots."""
MOST_HOLDERS: Final = 64
"""The maximum number of holders of one door."""
MOST_SENDERS: Final = 8
"""The maximum number of publishers of one device's states."""
MOST_NODES: Final = 8
"""The maximum number of our nodes that report on one device."""
MOST_DAEMONS: Final = 500
MOST_VALUES: Final = 100
"""The maximum number of values in one diagnosis. Our own diagnoses have a third of this number."""
MOST_SPEAKERS: Final = 500
"""The maximum number of robots and fleets whose last time of speaking is kept."""
MOST_CODES: Final = 20
"""The maximum number of faults in one diagnosis. The same limit holds for reasons of refusals."""
MOST_DEVICES: Final = 300
"""The maximum number of devices of one kind. A large hospital has 200 doors."""

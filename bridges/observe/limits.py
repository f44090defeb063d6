"""All durations (s) and limits by which silence, old readings and repeated requests are judged."""

from typing import Final

from bridges.kinds.shared import durations

SILENT_S: Final = durations.SILENT_S
"""The time (s) after which a sender of states, heartbeats or diagnostics counts as silent. These
messages come at 1 Hz, so after this time three messages are missing."""
SLOWEST_S: Final = 5.0
"""The longest time (s) between two states of a node. After this time at least two states are missing,
because RMF's contract permits 2 s between states (docs/how-to/judge.md, RATE)."""
REQUESTER_SILENT_S: Final = 3.5
"""The time (s) without a request after which a requester counts as gone, because three repeats are
missing. A waiting requester repeats its request with each state or each second (rmf_ros2,
RobotContext.cpp:1732 and DoorOpen.cpp)."""
REPEATS_S: Final = 1.5
"""The time (s) after the start of listening in which a first heard request may be a repeat of an
earlier request."""
GIVEN_UP_S: Final = 10.0
"""The time (s) without a request after which the next request of a requester begins a new visit. This
rule applies only while the device publishes states."""
UNSEEN_S: Final = 10.0
"""The longest silence (s) after which the holder is assumed to be unchanged. After a longer silence we
do not know when the holder got the device."""
FORGOTTEN_S: Final = durations.FORGOTTEN_S
"""The time (s) after a device's last state after which another device may replace it in a full
table."""
OLD_S: Final = 3.0
"""The age (s) from which a reading is old, because three polls are missing. A stamp that is this far in
the future comes from another clock."""
CLOCKS_DIFFER_S: Final = 5.0
"""The minimum difference (s) between our time and a request's stamp that proves different clocks."""
FLAPS: Final = 3
FLAPS_WITHIN_S: Final = 30.0
"""The time (s) in which FLAPS changes to or from OFFLINE prove that the device's readings are
intermittent."""
QUIET_S: Final = 60.0
"""The time (s) for which a repeated refusal is not reported as news."""
STEP_S: Final = 2.0
"""The minimum change (s) of the wall clock against the steady clock that counts as a step."""

MOST_REQUESTERS: Final = 100
"""The maximum number of requesters of one device. It is enough, because a site has some dozens of
robots."""
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
"""The maximum number of robots and fleets for which the time of the last message is kept."""
MOST_CODES: Final = 20
"""The maximum number of faults in one diagnosis. The same limit holds for reasons of refusals."""
MOST_DEVICES: Final = 300
"""The maximum number of devices of one kind. It is enough, because a large hospital has 200 doors."""

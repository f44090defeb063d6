"""Observes lifts, doors, chargers and workcells, on RMF's live ROS graph or in a recording.

The observers note the requesters and the holder of each device, how long a requester waits, and how
long a device sends nothing. They also note the unmet conditions of the phases of RMF's tasks.

The package is pure: it has no I/O and no clock. Therefore the caller gives the time with every message
and every query. The memory is bounded, even if somebody on the network invents names. A full memory
drops the names that were heard longest ago.

The users of this package are the recorder's triggers, `send`, `watch`, `explain`, `judge` and the page.

    requesters.py   the requesters of one device, past and present
    device.py       the facts of every kind: states, their rate and age, the age of each fact
    lift.py door.py charger.py workcell.py      each kind's requests and holders, and RMF's phases
    diagnosis.py    reports of our nodes on /diagnostics, about a device or about the node itself
    all_devices.py  all devices, and the daemons' reports on themselves

A message yields `News` for each change that the message makes. `limits.py` has the durations.
"""

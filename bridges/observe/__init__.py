"""Observes lifts, doors, chargers and workcells, on a live graph or in a recording.

The observers note requesters, holders, waits and silences. They also note the unmet conditions of RMF's
phases.

The package is pure: it has no I/O and no clock. Every message and every question brings its own time.
The memory is bounded, even if somebody on the network invents names. It drops the names that it heard
longest ago.

The users of this package are the recorder's triggers, `send`, `watch`, `explain`, `judge` and the page.

    requesters.py   the requesters of one device, past and present
    device.py       the facts of every kind: states, their pace and age, the age of each fact
    lift.py door.py charger.py workcell.py      each kind's requests and holders, and RMF's phases
    diagnosis.py    reports of our nodes on /diagnostics, about a device or about the node itself
    all_devices.py  all devices, and the daemons' reports on themselves

A message yields `News` for each change that the message makes. `limits.py` has the durations.
"""

"""Observation of lifts, doors and chargers, on a live graph or in a recording. The observers note
requesters, holders, waits and silences, and the conditions of RMF's phases that are not met.

The package is pure: it has no I/O and no clock, and every message and every question brings its own
time. Its memory is bounded even if the network invents names: the names that were heard longest ago are
dropped. All observers of a graph or a ring use this package: the recorder's triggers, `send`, `watch`,
`explain`, `judge` and the page.

    requesters.py   the requesters of one device, past and present
    device.py       the facts of every kind: states, their pace and age, the age of each fact
    lift.py door.py charger.py      each kind's requests and holders, and RMF's phases
    diagnosis.py    reports of our nodes on /diagnostics, about a device or about the node itself
    all_devices.py  all devices, and the daemons' reports on themselves

Each message yields `News`: the changes that the message makes, as values. `limits.py` has the
durations.
"""

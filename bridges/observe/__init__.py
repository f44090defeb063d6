"""Observation of lifts, doors and chargers, on a live graph or in a recording: requesters, holders,
waits, silences, and the unmet conditions of RMF's phases.

Pure: no I/O and no clock; every message and every question brings its time. Bounded even if the network
invents names: the names heard longest ago are dropped. All observers of a graph or a ring use this
package: the recorder's triggers, `send`, `watch`, `explain`, `judge` and the page.

    requesters.py   the requesters of one device, past and present
    device.py       shared by all kinds: states, their pace and age, the age of each fact
    lift.py door.py charger.py      each kind's requests and holders, and RMF's phases
    diagnosis.py    reports of our nodes on /diagnostics, about a device or themselves
    all_devices.py  all devices, and the daemons' reports on themselves

Each message yields `News`: its changes, as values. Durations are in `limits.py`.
"""

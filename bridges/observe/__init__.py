"""What was heard of lifts, doors and chargers, on a live graph or in a recording: who asks, who has
it, who waits, who is silent, and what RMF's phases still miss.

Pure: no I/O and no clock; every message and every question brings its time. Bounded, whatever names
the network makes up: the names heard longest ago give way. Whoever looks at a graph or a ring asks
here: the recorder's triggers, `send`, `watch`, `explain`, `judge` and the page.

    requesters.py   who asks for one device, and whether they still do
    device.py       what all kinds share: states, their pace and age, since when a fact is so
    lift.py door.py charger.py      each kind's requests and holders, and RMF's phases
    diagnosis.py    what nodes of ours say of a device or of themselves, on /diagnostics
    all_devices.py  all devices, and the daemons that speak of themselves

Each message gives `News`: what it changed, as values. Durations are in `limits.py`.
"""

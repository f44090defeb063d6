"""`make demo`: three daemons on fake hardware, and RMF, each in a process of its own, on real DDS.

A robot goes through a door, rides a lift from L1 to L3 and charges. `python -m hal_fakes.demo`
starts the daemons from the YAMLs in `config/` and plays RMF itself.

    daemons.py  the daemons' processes, and the control sockets of their plants
    journal.py  what happened, and how it is printed
    world.py    RMF on the graph: supervisors, fleet adapter, what was heard
    day.py      the robot's day
    verdict.py  whether it went right, from the journal alone
"""

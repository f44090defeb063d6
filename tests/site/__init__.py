"""A whole site for a day: 2 lifts, 5 doors, 3 chargers, 5 robots, and all that goes wrong.

In virtual time. Drivers, cores, nodes and supervisors are the daemons' own, on the `memory` transport;
behind the drivers stand the plants of `hal_fakes`, and RMF is its stand-in. One seed makes one day:
`make soak SEED=7 HOURS=24` plays it, and a failure prints the command that plays it again.

    timeline.py  virtual time
    network.py   the graph: delay, loss, repeats and cuts, within what DDS may do
    building.py  the devices: settings, plants, drivers
    daemons.py   what serves them, and the supervisors: each can be killed and started
    robots.py    fleet adapters and their robots, each with an endless day
    trouble.py   what goes wrong, and its repair
    laws.py      what must hold, judged from messages, relays and where things really are
    growth.py    threads, file descriptors, objects and memory, by the hour
    day.py       all of it together
    on_dds.py    the same robots in real time, on DDS, with daemons that are processes
"""

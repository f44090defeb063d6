"""A whole site for a day: 2 lifts, 5 doors, 3 chargers and 5 robots, with many faults.

The day runs in virtual time. Drivers, cores, nodes and supervisors are those of the daemons, on the
`memory` transport. The plants of `hal_fakes` stand behind the drivers, and stand-ins play RMF. One seed
makes one day. `make soak SEED=7 HOURS=24` plays that day. A failed day prints the command that plays it
again.

    timeline.py  virtual time
    network.py   the graph: delay, loss, repeats and cuts, within the limits of DDS
    building.py  the devices: settings, plants, drivers
    daemons.py   the daemons of the devices, and the supervisors: a test can kill and start each
    robots.py    fleet adapters and their robots, each with an endless day
    trouble.py   faults and their repair
    laws.py      rules for messages, relays, and the true positions of cars, doors and robots
    storeroom.py a dispenser, with a delivery each hour
    fire_panels.py  two fire panels and three fleet adapters, with drills and alarms once a day
    growth.py    threads, file descriptors, objects and memory, by the hour
    day.py       all parts together
    on_dds.py    the same robots in real time, on DDS, with daemons that are processes
"""

"""A whole site for a day: 2 lifts, 5 doors, 3 chargers and 5 robots, with many faults.

The day runs in virtual time. It uses the daemons' own drivers, decision code (cores), nodes and
supervisors, on the `memory` transport. Behind the drivers are simulated devices (the plants of
`hal_fakes`). Stand-ins replace RMF. The same seed always gives the same day. `make soak SEED=7
HOURS=24` runs that day. If a day fails, it prints the command that runs it again.

    timeline.py  virtual time
    network.py   the graph: delay, loss, repeats and cuts, within the limits of DDS
    building.py  the devices: settings, plants, drivers
    daemons.py   the daemons of the devices, and the supervisors: a test can kill and start each
    robots.py    fleet adapters and their robots, which move until the end of the day
    trouble.py   faults and their repair
    laws.py      rules for messages, relays, and the true positions of cars, doors and robots
    storeroom.py a dispenser, with a delivery each hour
    fire_panels.py  two fire panels and three fleet adapters, with drills and alarms once a day
    growth.py    threads, file descriptors, objects and memory, by the hour
    day.py       all parts together
    on_dds.py    the same robots in real time, on DDS, with daemons that are processes
"""

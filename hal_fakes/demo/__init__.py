"""`make demo` and `make demo-charging`: daemons on fake hardware. A real transport (DDS or zenoh)
connects them to a program that plays RMF.

`python -m hal_fakes.demo` starts the daemons of one demo, and plays the part of RMF for one day of the
demo. In `ride` a robot goes through a door, rides a lift and charges. In `charging` three robots share
two chargers.

    daemons.py   the daemons' processes, and the control sockets of their plants
    journal.py   events, and their printed lines
    demo_run.py  starts the daemons, plays the day, and always stops everything
    world.py     RMF's side of the graph: the messages that RMF hears, sends and awaits
    ride.py      the robot's day, and the check of this day
    charging.py  the chargers' day, and the check of this day
"""

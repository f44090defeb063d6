"""`make demo` and `make demo-charging`: daemons on fake hardware, connected to RMF by a real wire.

`python -m hal_fakes.demo` starts the daemons of one demo, and plays the part of RMF. In `ride` a robot
goes through a door, rides a lift and charges. In `charging` three robots share two chargers.

    daemons.py   the daemons' processes, and the control sockets of their plants
    journal.py   events, and their printed lines
    demo_run.py  starts the daemons, plays the day, and always stops everything
    world.py     RMF's side of the graph: messages heard, sent and awaited
    ride.py      the robot's day, and its verdict
    charging.py  the chargers' day, and its verdict
"""

"""A stand-in for RMF's fleet adapter. `run --simulate` uses it on a machine without ROS, and tests use
it.

The stand-in offers the names of `rmf_adapter` that the daemon uses, and behaves as RMF does. It calls
the callbacks on a thread of its own. It refuses a robot that is far from the graph or has no charger.
It ignores a battery charge that is not between 0 and 1. It joins only if there is a schedule node.
Unlike RMF it has no tasks, no schedule, no doors and no lifts. Its robots patrol (`patrol.py`).

Source: open-rmf/rmf_ros2, branch jazzy: adapter.cpp of rmf_fleet_adapter_python, EasyFullControl.cpp.
"""

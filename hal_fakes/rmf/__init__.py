"""A stand-in of RMF's fleet adapter, for `run --simulate` on a machine without ROS, and for tests.

It has the names of `rmf_adapter` that the daemon uses, and behaves as RMF does: it calls back on a
thread of its own, adds no robot that is off the graph or has no charger, ignores a battery that is
no fraction, and joins only if there is a schedule node. It is no RMF: it has no tasks, no schedule,
no doors and no lifts. Its robots patrol (`patrol.py`).

Source: open-rmf/rmf_ros2, branch jazzy: adapter.cpp of rmf_fleet_adapter_python, EasyFullControl.cpp.
"""

"""`ros2 launch rmf_bridges charger_coordinator.launch.py config:=FILE`"""

from bridges.runtime.ros_launch import LaunchDescription, daemon


def generate_launch_description() -> LaunchDescription:
    """Describe the launch of the daemon."""
    return daemon("charger_coordinator")

"""`ros2 launch rmf_bridges fleet.launch.py config:=FILE`"""

from bridges.runtime.ros_launch import LaunchDescription, daemon


def generate_launch_description() -> LaunchDescription:
    """Describe the launch of the daemon."""
    return daemon("fleet")

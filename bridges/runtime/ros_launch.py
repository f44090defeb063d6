"""Starts the daemon as a ROS node: `ros2 launch rmf_bridges <kind>.launch.py config:=FILE`.

After any death of the daemon, a shell process (its guard) runs `rmf-bridge outputs-off`
(`bridges/runtime/guard.py`).

Only the launch files in `ros/launch/` import this module. Each kind has one launch file. `ros2` runs
this module with ROS's own Python. That Python has `launch` and `yaml`, but none of the other packages
that this project needs.
"""

from pathlib import Path

import yaml
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

__all__ = ["LaunchDescription", "daemon"]


def daemon(kind: str) -> LaunchDescription:
    """Return the launch description for one kind. If the YAML has another kind, nothing is started."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", description=f"the YAML of the {kind}"),
            DeclareLaunchArgument(
                "simulate",
                default_value="false",
                choices=["true", "false"],
                description="use fake hardware, and talk only to this machine's nodes",
            ),
            OpaqueFunction(function=lambda context: _actions(kind, context)),
        ]
    )


def _actions(kind: str, context: LaunchContext) -> list[Node]:
    file = str(Path(LaunchConfiguration("config").perform(context)).absolute())
    simulate = LaunchConfiguration("simulate").perform(context) == "true"
    _check(kind, file)
    return [_rmf_bridge("run", file, *(["--simulate"] if simulate else []))]


def _check(kind: str, file: str) -> None:
    """Raise RuntimeError for a file of another kind. The daemon itself reports all other errors."""
    try:
        settings = yaml.safe_load(Path(file).read_bytes())
    except (OSError, yaml.YAMLError) as error:
        raise RuntimeError(f"{file}: {error}") from None
    found = settings.get("kind") if isinstance(settings, dict) else None
    if found != kind:
        raise RuntimeError(
            f"{file} is for a {found}: use ros2 launch rmf_bridges {found}.launch.py"
            if found
            else f"{file} does not say for which kind it is"
        )


def _rmf_bridge(*arguments: str) -> Node:
    return Node(
        package="rmf_bridges", executable="rmf-bridge", arguments=arguments, output="screen"
    )

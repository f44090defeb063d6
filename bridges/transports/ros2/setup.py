"""Sources ROS's setup file before the daemon starts, for `ros_setup:` in the YAML.

rclpy needs the paths that the setup file sets. Without these paths, `transport: auto` would choose
another transport under systemd than in a shell.

The daemon's process executes a shell in its place. The shell sources the file, and then executes the
daemon again. So the process id stays the same, and systemd still watches the right process.
"""

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path

from bridges.kinds.shared.rmf_section import Rmf
from bridges.system.log import pairs
from bridges.transports.transport import TransportError

log = logging.getLogger(__name__)

SOURCED = "RMF_BRIDGE_ROS_SETUP"
"""The environment variable that holds the path of the sourced setup file."""
SHELL = 'setup=$1; shift; ours=("$@"); set --; . "$setup"; exec "${ours[@]}"'


def sourcing(rmf: Rmf, environ: Mapping[str, str], argv: Sequence[str]) -> list[str]:
    """Return the shell command that this process must execute. Return an empty list if no setup file
    must be sourced.

    `argv`: `sys.orig_argv`. Raises TransportError for a missing file, if the YAML says `transport:
    ros2`.
    """
    if (
        rmf.ros_setup is None
        or rmf.transport in ("dds", "zenoh")
        or environ.get(SOURCED) == rmf.ros_setup
    ):
        return []
    if Path(rmf.ros_setup).is_file():
        return ["bash", "-c", SHELL, "rmf-bridge", rmf.ros_setup, *argv]
    if rmf.transport == "ros2":
        raise TransportError(f"ros_setup: {rmf.ros_setup} does not exist: is ROS 2 installed?")
    log.info(pairs("no_ros_setup", file=rmf.ros_setup, reason="it does not exist"))
    return []


def sourced(rmf: Rmf, environ: Mapping[str, str]) -> dict[str, str]:
    """Return the environment for the command of `sourcing`. A variable marks the file as sourced."""
    return {**environ, SOURCED: rmf.ros_setup or ""}

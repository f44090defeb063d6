"""ROS's setup file, sourced for a daemon whose starter has not done so: `ros_setup:` in the YAML.

Without the paths that it sets rclpy does not import, and `transport: auto` would choose another
transport under systemd than in a shell. A shell that replaces us sources it, and we replace the
shell: the process id, which systemd knows us by, stays.
"""

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path

from bridges.log import pairs
from bridges.rmf.settings import Rmf
from bridges.rmf.transport import TransportError

log = logging.getLogger(__name__)

SOURCED = "RMF_BRIDGE_ROS_SETUP"
"""Which setup file this process comes from."""
SHELL = 'setup=$1; shift; ours=("$@"); set --; . "$setup"; exec "${ours[@]}"'


def sourcing(rmf: Rmf, environ: Mapping[str, str], argv: Sequence[str]) -> list[str]:
    """The command to go on as, for this `sys.orig_argv`; empty where there is nothing to source.

    Raises TransportError where `transport: ros2` cannot be for lack of the file.
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
        raise TransportError(f"ros_setup: {rmf.ros_setup} is not there: is ROS 2 installed?")
    log.info(pairs("no_ros_setup", file=rmf.ros_setup, reason="it is not there"))
    return []


def sourced(rmf: Rmf, environ: Mapping[str, str]) -> dict[str, str]:
    """The environment of that command: it must not source again."""
    return {**environ, SOURCED: rmf.ros_setup or ""}

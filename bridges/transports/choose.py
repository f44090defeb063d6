"""Chooses a daemon's transport, ROS domain and network.

The YAML decides. If a key is missing in the YAML, ROS's environment variables decide, as for any ROS
node. Each transport has a folder beside this file: `ros2/`, `dds/`, `zenoh/`.
"""

import importlib
import importlib.util
import logging
import os
import re
from collections.abc import Mapping, Sequence

from bridges.kinds.shared.rmf_section import Rmf
from bridges.messages.definitions import OF_WORKCELLS, PACKAGES
from bridges.messages.releases import RELEASES, Release
from bridges.system.log import pairs
from bridges.transports.cyclone import static_peers
from bridges.transports.transport import Transport, TransportError

log = logging.getLogger(__name__)

NEEDED = sorted(set(PACKAGES.values()) - OF_WORKCELLS)
"""The message packages that every daemon with `ros2` needs."""

NO_CYCLONEDDS = (
    "transport dds needs the Python package cyclonedds 11.0.1, and {}. On x86-64 `pip install"
    " cyclonedds==11.0.1` installs it. For arm64 pip has no such package: put zenoh-bridge-ros2dds"
    " beside RMF and write `transport: zenoh` with `keys: ros2dds`, or install ROS 2 and write"
    " `transport: ros2`"
)
NO_ROS = (
    "transport ros2 needs ROS 2 with RMF's messages, and {}. On Ubuntu 24.04 `sudo apt install"
    " ros-jazzy-rclpy {}` installs them. The virtual environment needs --system-site-packages and"
    " ROS's own Python. The shell must source ROS's setup file (`. /opt/ros/jazzy/setup.bash`; for"
    " a service: `ros_setup:` below `rmf:`). `transport: dds` reaches the same nodes without ROS"
)


def open_transport(
    rmf: Rmf, node_name: str, *, localhost: bool = False, ros_args: Sequence[str] = ()
) -> Transport:
    """Join the RMF graph as `node_name`. Raises TransportError, whose text has a remedy.

    `localhost`: keep all traffic on this machine, even if the YAML or the environment says otherwise.
    `ros_args`: `--ros-args` and the arguments after it on the command line.
    """
    domain = domain_id(rmf, os.environ)
    speaks, reason = _choice(rmf)
    peers = peers_of(speaks, os.environ)
    loopback = localhost or stays_on_loopback(rmf, os.environ, peers)
    network = "localhost" if loopback else "subnet"
    release = RELEASES.get(rmf.release)
    log.info(pairs("transport", speaks=speaks, domain_id=domain, network=network, reason=reason))
    node_name = re.sub(r"\W", "_", node_name, flags=re.ASCII)  # a ROS name has no other characters
    if speaks == "ros2":
        return _open_ros2(node_name, domain, loopback=loopback, ros_args=ros_args)
    if set(ros_args) - {"--ros-args", "--"}:
        raise TransportError(
            f"{' '.join(ros_args)}: only transport ros2 understands this. Write `transport: ros2`, or"
            " rename topics with `topics:` in the YAML"
        )
    if speaks == "dds":
        return _open_dds(node_name, domain, loopback=loopback, release=release)
    from bridges.transports.zenoh.transport import ZenohTransport

    return ZenohTransport(node_name, domain, loopback=loopback, settings=rmf.zenoh, release=release)


def domain_id(rmf: Rmf, environ: Mapping[str, str]) -> int:
    """Return the ROS domain from the YAML, or else from ROS_DOMAIN_ID, or else 0. Raises
    TransportError."""
    if rmf.domain_id is not None:
        return rmf.domain_id
    text = environ.get("ROS_DOMAIN_ID", "") or "0"
    if not text.isascii() or not text.isdigit() or int(text) > 232:
        raise TransportError(f"ROS_DOMAIN_ID is {text!r}: give a whole number from 0 to 232")
    return int(text)


def peers_of(speaks: str, environ: Mapping[str, str]) -> list[str]:
    """Return the hosts in ROS_STATIC_PEERS, which a node with this transport looks for. A node on zenoh
    looks for none of them."""
    return [] if speaks == "zenoh" else static_peers(environ)


def stays_on_loopback(rmf: Rmf, environ: Mapping[str, str], peers: Sequence[str]) -> bool:
    """Return whether the node must stay on loopback. The YAML, ROS_LOCALHOST_ONLY or
    ROS_AUTOMATIC_DISCOVERY_RANGE may demand this.

    As in ROS 2 Jazzy, the older ROS_LOCALHOST_ONLY=1 takes precedence over the newer variable. With
    LOCALHOST the node may still reach static `peers`. Raises TransportError.
    """
    if rmf.network == "localhost" or environ.get("ROS_LOCALHOST_ONLY") == "1":
        return True
    text = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "") or "SUBNET"
    if text not in ("SUBNET", "SYSTEM_DEFAULT", "LOCALHOST"):
        raise TransportError(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is {text!r}: use SUBNET or LOCALHOST. With OFF"
            " this node would find no other node, and other values are unknown"
        )
    return text == "LOCALHOST" and not peers


def _choice(rmf: Rmf) -> tuple[str, str]:
    """Return the transport, and the reason for this choice."""
    if rmf.transport in ("dds", "zenoh"):
        return rmf.transport, "configured"
    missing = missing_of_ros()
    if rmf.transport == "auto":
        return (
            _best_without(missing)
            if missing
            else ("ros2", "rclpy and RMF's messages are installed")
        )
    if missing:
        packages = " ".join(map(_apt_name, NEEDED))
        raise TransportError(NO_ROS.format(missing, packages))
    return "ros2", "configured"


def _best_without(ros: str) -> tuple[str, str]:
    """Return the transport that `auto` chooses on a machine without ROS, and the reason. `ros`: a text
    that says which part of ROS is missing."""
    missing = missing_of_dds()
    return ("zenoh", f"{ros}; {missing}") if missing else ("dds", ros)


def missing_of_dds() -> str:
    """Return the reason why this machine cannot use the transport `dds`. Return "" if it can."""
    try:
        importlib.import_module("cyclonedds.core")
    except ImportError as error:
        return f"cyclonedds does not import: {error}"
    return ""


def missing_of_ros() -> str:
    """Return the reason why this machine cannot use the transport `ros2`. Return "" if it can."""
    try:
        importlib.import_module("rclpy")
    except ImportError as error:
        return f"rclpy does not import: {error}"
    for package in NEEDED:
        if importlib.util.find_spec(package) is None:
            return f"the ROS package {package} is not installed"
    return ""


def _apt_name(package: str) -> str:
    return f"ros-jazzy-{package.replace('_', '-')}"


def _open_ros2(
    node_name: str, domain: int, *, loopback: bool, ros_args: Sequence[str]
) -> Transport:
    from bridges.transports.ros2.transport import Ros2Transport

    return Ros2Transport(node_name, domain, loopback=loopback, ros_args=ros_args)


def _open_dds(node_name: str, domain: int, *, loopback: bool, release: Release | None) -> Transport:
    if missing := missing_of_dds():
        raise TransportError(NO_CYCLONEDDS.format(missing))
    from bridges.transports.dds.transport import DdsTransport

    return DdsTransport(node_name, domain, loopback=loopback, release=release)

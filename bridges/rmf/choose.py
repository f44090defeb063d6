"""Which transport a daemon speaks, in which DDS domain, on which network.

The YAML says it; ROS's own environment variables fill in what the YAML leaves open, as they do for
any ROS node. A file beside this one for each transport: `dds.py`; `ros2.py` (rclpy) and `zenoh.py`
are not in this version.
"""

import importlib.util
import logging
import os
from collections.abc import Mapping

from bridges.fields import Rmf
from bridges.log import pairs
from bridges.rmf.transport import Transport, TransportError

log = logging.getLogger(__name__)

NO_CYCLONEDDS = (
    "transport dds needs the Python package cyclonedds 11.0.1, which is not installed here ({}). On"
    " x86-64 `pip install cyclonedds==11.0.1` fetches it. For arm64 there is none to fetch: build"
    " the C library Cyclone DDS 11.0.1 (cmake -DBUILD_IDLC=OFF; make an empty bin/ in its prefix),"
    " then `CYCLONEDDS_HOME=<prefix> pip install --no-binary cyclonedds cyclonedds==11.0.1`"
)


def open_transport(rmf: Rmf, node_name: str, *, localhost: bool = False) -> Transport:
    """Join the RMF graph as `node_name`. Raises TransportError with what to do about it.

    `localhost` keeps all traffic on this machine, whatever the YAML and the environment say.
    """
    if rmf.transport == "ros2":
        raise TransportError(
            "transport ros2 (rclpy) is not in this version: write `transport: dds`, which needs no"
            " ROS and speaks to the same nodes"
        )
    domain = domain_id(rmf, os.environ)
    loopback = localhost or stays_on_loopback(rmf, os.environ)
    network = "localhost" if loopback else "subnet"
    log.info(
        pairs("transport", speaks="dds", domain_id=domain, network=network, reason=_reason(rmf))
    )
    return _open_dds(node_name, domain, loopback=loopback)


def domain_id(rmf: Rmf, environ: Mapping[str, str]) -> int:
    """The DDS domain: the YAML's, else ROS_DOMAIN_ID, else 0."""
    if rmf.domain_id is not None:
        return rmf.domain_id
    text = environ.get("ROS_DOMAIN_ID", "") or "0"
    if not text.isascii() or not text.isdigit() or int(text) > 232:
        raise TransportError(f"ROS_DOMAIN_ID is {text!r}: give a whole number from 0 to 232")
    return int(text)


def stays_on_loopback(rmf: Rmf, environ: Mapping[str, str]) -> bool:
    """Whether the YAML, ROS_LOCALHOST_ONLY or ROS_AUTOMATIC_DISCOVERY_RANGE asks for it.

    As in ROS 2 Jazzy, the older ROS_LOCALHOST_ONLY=1 wins over the newer variable.
    """
    if rmf.network == "localhost" or environ.get("ROS_LOCALHOST_ONLY") == "1":
        return True
    text = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "") or "SUBNET"
    if text not in ("SUBNET", "SYSTEM_DEFAULT", "LOCALHOST"):
        raise TransportError(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is {text!r}: with it this node would find nobody, or it"
            " is not known. Use SUBNET or LOCALHOST"
        )
    return text == "LOCALHOST"


def _reason(rmf: Rmf) -> str:
    if rmf.transport == "dds":
        return "configured"
    if importlib.util.find_spec("rclpy") is None:
        return "rclpy is not installed"
    return "rclpy is installed, but this version has no ros2 transport"


def _open_dds(node_name: str, domain: int, *, loopback: bool) -> Transport:
    if importlib.util.find_spec("cyclonedds") is None:
        raise TransportError(NO_CYCLONEDDS.format(os.uname().machine))
    from bridges.rmf.dds import DdsTransport

    return DdsTransport(node_name, domain, loopback=loopback)

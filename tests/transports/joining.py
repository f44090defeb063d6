"""Functions that open nodes on loopback. The caller names the transport."""

import importlib
from collections.abc import Callable

from bridges.kinds.shared.rmf_section import Zenoh
from bridges.messages.releases import NEWEST, Release
from bridges.transports.choose import missing_of_ros
from bridges.transports.ros2.types import installed
from bridges.transports.transport import Transport
from bridges.transports.zenoh.transport import ZenohTransport

RELEASE = NEWEST if missing_of_ros() else installed()
"""The release of RMF whose messages the tests send. It is the release of the installed ROS, or without
ROS the newest release."""

Join = Callable[[str], Transport]
"""A function that opens a node on one graph. The argument is the node's name."""


def on_fast_dds() -> bool:
    """Return whether ROS uses Fast DDS. Raise ImportError if ROS is missing."""
    utilities = importlib.import_module(
        "rclpy.utilities"
    )  # imported here, because ROS may be missing
    return bool(utilities.get_rmw_implementation_identifier() == "rmw_fastrtps_cpp")


ZENOH = {"zenoh": Zenoh(), "zenoh_ros2dds": Zenoh(keys="ros2dds")}
"""The settings for each of the two key formats on zenoh."""


def joining(
    transport: str, domain: int, release: Release | None = RELEASE, *, loopback: bool = True
) -> Join:
    """Return a function that opens nodes on this transport and domain. Nodes stay on loopback by
    default."""

    def join(name: str) -> Transport:
        if transport.startswith("zenoh"):
            ways = ZENOH[transport]
            return ZenohTransport(name, domain, loopback=loopback, settings=ways, release=release)
        # Imported here, because ROS may be missing.
        module = importlib.import_module(f"bridges.transports.{transport}.transport")
        kind = {"dds": "DdsTransport", "ros2": "Ros2Transport"}[transport]
        wanted = (
            {} if transport == "ros2" else {"release": release}
        )  # ros2 uses the installed release
        node: Transport = getattr(module, kind)(name, domain, loopback=loopback, **wanted)
        return node

    return join

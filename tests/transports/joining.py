"""Opens nodes on loopback, by the name of a transport."""

import importlib
from collections.abc import Callable

from bridges.kinds.shared.rmf_section import Zenoh
from bridges.messages.releases import NEWEST, Release
from bridges.transports.choose import missing_of_ros
from bridges.transports.ros2.types import installed
from bridges.transports.transport import Transport
from bridges.transports.zenoh.transport import ZenohTransport

RELEASE = NEWEST if missing_of_ros() else installed()
"""What the tests speak: where ROS is installed, its release on every wire."""

Join = Callable[[str], Transport]
"""Open a node of this name on one graph."""


def on_fast_dds() -> bool:
    """Is `ros2` on Fast DDS here? It announces no history, and warns of no type hash."""
    utilities = importlib.import_module("rclpy.utilities")  # there may be no ROS
    return bool(utilities.get_rmw_implementation_identifier() == "rmw_fastrtps_cpp")


ZENOH = {"zenoh": Zenoh(), "zenoh_ros2dds": Zenoh(keys="ros2dds")}
"""The two ways to name things on zenoh."""


def joining(
    transport: str, domain: int, release: Release | None = RELEASE, *, loopback: bool = True
) -> Join:
    """What opens nodes of this transport in this domain, on loopback unless the test says how else."""

    def join(name: str) -> Transport:
        if transport.startswith("zenoh"):
            ways = ZENOH[transport]
            return ZenohTransport(name, domain, loopback=loopback, settings=ways, release=release)
        # Imported here: there may be no ROS.
        module = importlib.import_module(f"bridges.transports.{transport}.transport")
        kind = {"dds": "DdsTransport", "ros2": "Ros2Transport"}[transport]
        wanted = {} if transport == "ros2" else {"release": release}  # that takes what is installed
        node: Transport = getattr(module, kind)(name, domain, loopback=loopback, **wanted)
        return node

    return join

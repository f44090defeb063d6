"""Opens nodes on loopback, by the name of a transport."""

import importlib
from collections.abc import Callable

from bridges.rmf.settings import Zenoh
from bridges.rmf.transport import Transport
from bridges.rmf.zenoh import ZenohTransport

Join = Callable[[str], Transport]
"""Open a node of this name on one graph."""

ZENOH = {"zenoh": Zenoh(), "zenoh_ros2dds": Zenoh(keys="ros2dds")}
"""The two ways to name things on zenoh."""


def joining(transport: str, domain: int) -> Join:
    """What opens nodes of this transport in this domain, on loopback."""

    def join(name: str) -> Transport:
        if transport.startswith("zenoh"):
            return ZenohTransport(name, domain, loopback=True, settings=ZENOH[transport])
        # Imported here: there may be no ROS.
        module = importlib.import_module(f"bridges.rmf.{transport}")
        kind = {"dds": "DdsTransport", "ros2": "Ros2Transport"}[transport]
        node: Transport = getattr(module, kind)(name, domain, loopback=True)
        return node

    return join

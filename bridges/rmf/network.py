"""The network under the `dds` transport: what ROS's variables ask for, and whether it has changed.

Cyclone looks for an interface once, when a node joins. With only `lo` up it stays there for ever; of an
address that comes, goes or changes later it learns nothing. So we look, and join again.
"""

import fcntl
import socket
import struct
from collections.abc import Mapping
from typing import Final
from xml.sax.saxutils import quoteattr

Addresses = frozenset[tuple[int, str]]
"""An interface's number and its IPv4 address, for each that could reach another machine."""

GET_FLAGS, GET_ADDRESS = 0x8913, 0x8915
UP, LOOPBACK, RUNNING = 0x1, 0x8, 0x40
MOST_PROCESSES: Final = 32


def configuration(environ: Mapping[str, str]) -> str:
    """Cyclone's configuration for a node that leaves its machine: ours, then CYCLONEDDS_URI's.

    As rmw_cyclonedds makes it (ROS 2 Jazzy, rmw_node.cpp): peers by unicast beside multicast, and
    participant indices that such a peer can guess. SYSTEM_DEFAULT leaves everything to Cyclone.
    """
    own = environ.get("CYCLONEDDS_URI", "")
    if environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "SYSTEM_DEFAULT":
        return own
    peers = [peer.strip() for peer in environ.get("ROS_STATIC_PEERS", "").split(";")]
    named = "".join(f"<Peer address={quoteattr(peer)}/>" for peer in peers if peer)
    ours = (
        "<CycloneDDS><Domain><Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{MOST_PROCESSES}</MaxAutoParticipantIndex>"
        + (f"<Peers>{named}</Peers>" if named else "")
        + "</Discovery></Domain></CycloneDDS>"
    )
    return f"{ours},{own}" if own else ours


def addresses() -> Addresses:
    """What is up now, with a link."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        found = ((index, _address(asking, name)) for index, name in socket.if_nameindex())
        return frozenset((index, address) for index, address in found if address)


def _address(asking: socket.socket, name: str) -> str:
    """The IPv4 address of an interface that is up and not loopback, else ""."""
    request = struct.pack("256s", name.encode()[:15])
    try:
        flags = struct.unpack_from("H", fcntl.ioctl(asking, GET_FLAGS, request), 16)[0]
        if flags & (UP | RUNNING | LOOPBACK) != UP | RUNNING:
            return ""
        return socket.inet_ntoa(fcntl.ioctl(asking, GET_ADDRESS, request)[20:24])
    except OSError:  # it has no address, or has gone meanwhile
        return ""

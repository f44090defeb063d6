"""The network under the `dds` transport: what ROS's variables ask for, and whether it has changed.

Cyclone looks for an interface once, when a node joins. With only `lo` up it stays there for ever; of an
address that comes, goes or changes later it learns nothing. So we look, and join again.
"""

from collections.abc import Mapping
from typing import Final
from xml.sax.saxutils import quoteattr

from bridges.rmf.addresses import Addresses, addresses

__all__ = ["Addresses", "addresses", "configuration", "static_peers"]

MOST_PROCESSES: Final = 32


def configuration(environ: Mapping[str, str]) -> str:
    """Cyclone's configuration for a node that leaves its machine: ours, then CYCLONEDDS_URI's.

    As rmw_cyclonedds makes it (ROS 2 Jazzy, rmw_node.cpp:1115-1220): peers by unicast beside multicast,
    and participant indices that such a peer can guess. LOCALHOST is without multicast: this machine
    and the peers. SYSTEM_DEFAULT leaves everything to Cyclone.
    """
    own = environ.get("CYCLONEDDS_URI", "")
    wanted = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE")
    if wanted == "SYSTEM_DEFAULT":
        return own
    here = ["localhost"] if wanted == "LOCALHOST" else []
    named = "".join(
        f"<Peer address={quoteattr(peer)}/>" for peer in [*here, *static_peers(environ)]
    )
    silent = "<General><AllowMulticast>false</AllowMulticast></General>" if here else ""
    ours = (
        f"<CycloneDDS><Domain>{silent}<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{MOST_PROCESSES}</MaxAutoParticipantIndex>"
        + (f"<Peers>{named}</Peers>" if named else "")
        + "</Discovery></Domain></CycloneDDS>"
    )
    return f"{ours},{own}" if own else ours


def static_peers(environ: Mapping[str, str]) -> list[str]:
    """The hosts in ROS_STATIC_PEERS."""
    peers = (peer.strip() for peer in environ.get("ROS_STATIC_PEERS", "").split(";"))
    return [peer for peer in peers if peer]

"""Configurations of Cyclone DDS, for `dds` and for ROS on Cyclone: on the network, or only on this
machine."""

from collections.abc import Mapping
from typing import Final
from xml.sax.saxutils import quoteattr

LOOPBACK: Final = (
    "<CycloneDDS><Domain><General>"
    '<Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
"""Keeps a node on this machine: unicast on `lo`, for up to 31 processes."""

MOST_PROCESSES: Final = 32
LEAVING: Final = (
    "<Internal><MultipleReceiveThreads>false</MultipleReceiveThreads>"
    "<WriterLingerDuration>100 ms</WriterLingerDuration></Internal>"
)
"""A node leaves at once, also when its address has gone. Else Cyclone 0.10 ends its receive threads by
a datagram to that address and waits for it, for minutes (q_receive.c, trigger_recv_threads), and every
writer waits 1 s for acknowledgements that do not come. rclpy holds Python's lock meanwhile: the whole
daemon stands still."""


def configuration(environ: Mapping[str, str]) -> str:
    """The configuration of a node on the network: ours, then CYCLONEDDS_URI's.

    As rmw_cyclonedds makes it (ROS 2 Jazzy, rmw_node.cpp): static peers by unicast beside multicast,
    and participant indices that peers can guess. LOCALHOST is without multicast: this machine and the
    peers. SYSTEM_DEFAULT leaves everything to Cyclone.
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
        f"<CycloneDDS><Domain>{silent}{LEAVING}<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{MOST_PROCESSES}</MaxAutoParticipantIndex>"
        + (f"<Peers>{named}</Peers>" if named else "")
        + "</Discovery></Domain></CycloneDDS>"
    )
    return f"{ours},{own}" if own else ours


def for_ros(environ: Mapping[str, str]) -> str:
    """CYCLONEDDS_URI for a ROS node on the network: how it leaves, then what is there already."""
    ours, own = (
        f"<CycloneDDS><Domain>{LEAVING}</Domain></CycloneDDS>",
        environ.get("CYCLONEDDS_URI", ""),
    )
    return f"{ours},{own}" if own else ours


def static_peers(environ: Mapping[str, str]) -> list[str]:
    """The hosts in ROS_STATIC_PEERS."""
    peers = (peer.strip() for peer in environ.get("ROS_STATIC_PEERS", "").split(";"))
    return [peer for peer in peers if peer]

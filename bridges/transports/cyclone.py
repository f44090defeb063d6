"""Configurations of Cyclone DDS, for the transport `dds` and for ROS nodes that use Cyclone. One
configuration is for nodes on the network. The other configuration keeps a node on this machine."""

from collections.abc import Mapping
from typing import Final

from bridges.messages.cdr import LONGEST

ESCAPED: Final = str.maketrans({"&": "&amp;", "<": "&lt;", '"': "&quot;"})
"""The characters that an attribute in XML must not contain. `html.escape` would load 0.5 MB."""
MOST_PROCESSES: Final = 32
INTERNAL: Final = (
    "<Internal><MultipleReceiveThreads>false</MultipleReceiveThreads>"
    "<WriterLingerDuration>100 ms</WriterLingerDuration>"
    f"<MaxSampleSize>{LONGEST} B</MaxSampleSize>"
    "<DefragReliableMaxSamples>1</DefragReliableMaxSamples>"
    "<PrimaryReorderMaxSamples>1</PrimaryReorderMaxSamples>"
    "<SecondaryReorderMaxSamples>1</SecondaryReorderMaxSamples></Internal>"
)
"""Settings with which a node can leave DDS without delay, even if the machine has lost its network
address.

By default Cyclone 0.10 ends its receive threads by sending a datagram to the machine's own address. If
the machine has lost this address, Cyclone waits minutes for the datagram (q_receive.c,
trigger_recv_threads). Every writer also waits 1 s for acknowledgements that do not come. During these
waits rclpy holds Python's global lock, and the whole daemon stops.

A sample longer than LONGEST is dropped at its first fragment. For each writer, memory holds at most one
incomplete sample and one sample that came too early. Cyclone's defaults are 16 incomplete samples and
128 early samples. After a loss the node asks the writer to send again.
"""
FOUND_AGAIN: Final = "<SPDPInterval>2 s</SPDPInterval>"
"""The interval between two announcements of a node. If the network fails for longer than a lease (10
s), other nodes may forget the node. With a short interval they soon find it again.

The default in Cyclone 0.10 is 8 s. In Cyclone 11 the default is 30 s if the other node was lost.
"""
NEVER_FORGOTTEN: Final = (
    "<InitialLocatorPruneDelay>inf</InitialLocatorPruneDelay>"
    "<DiscoveredLocatorPruneDelay>inf</DiscoveredLocatorPruneDelay>"
)
"""Settings with which Cyclone 11 never gives up a peer. By default Cyclone 11 gives up a peer 30 s
after a search without success, and 60 s after losing the peer. Cyclone 0.10 never gives up a peer,
and refuses these settings."""
LOOPBACK: Final = (
    "<CycloneDDS><Domain><General>"
    '<Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    f"<AllowMulticast>false</AllowMulticast></General>{INTERNAL}"
    f"<Discovery>{FOUND_AGAIN}<ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
"""A configuration that keeps a node on this machine. It uses unicast on `lo`, and allows up to 31
processes."""


def configuration(environ: Mapping[str, str]) -> str:
    """Return the configuration of a node on the network. If a setting is also in CYCLONEDDS_URI, the
    value in CYCLONEDDS_URI wins, because it comes later.

    The rules are those of rmw_cyclonedds (ROS 2 Jazzy, rmw_node.cpp):

    - The node uses multicast, and reaches static peers by unicast. Its participant index is small, so
      that peers can guess it.
    - With LOCALHOST the node reaches this machine and the static peers, without multicast.
    - With SYSTEM_DEFAULT Cyclone decides on discovery.
    """
    own = environ.get("CYCLONEDDS_URI", "")
    wanted = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE")
    if wanted == "SYSTEM_DEFAULT":
        return for_ros(environ)
    here = ["localhost"] if wanted == "LOCALHOST" else []
    peers = [peer.translate(ESCAPED) for peer in [*here, *static_peers(environ)]]
    named = "".join(f'<Peer address="{peer}"/>' for peer in peers)
    silent = "<General><AllowMulticast>false</AllowMulticast></General>" if here else ""
    ours = (
        f"<CycloneDDS><Domain>{silent}{INTERNAL}<Discovery>{FOUND_AGAIN}{NEVER_FORGOTTEN}"
        "<ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{MOST_PROCESSES}</MaxAutoParticipantIndex>"
        + (f"<Peers>{named}</Peers>" if named else "")
        + "</Discovery></Domain></CycloneDDS>"
    )
    return f"{ours},{own}" if own else ours


def for_ros(environ: Mapping[str, str]) -> str:
    """Return a CYCLONEDDS_URI for a ROS node on the network. Our settings come before the settings in
    the present CYCLONEDDS_URI."""
    ours, own = (
        f"<CycloneDDS><Domain>{INTERNAL}<Discovery>{FOUND_AGAIN}</Discovery></Domain></CycloneDDS>",
        environ.get("CYCLONEDDS_URI", ""),
    )
    return f"{ours},{own}" if own else ours


def static_peers(environ: Mapping[str, str]) -> list[str]:
    """Return the hosts in ROS_STATIC_PEERS."""
    peers = (peer.strip() for peer in environ.get("ROS_STATIC_PEERS", "").split(";"))
    return [peer for peer in peers if peer]

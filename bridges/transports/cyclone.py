"""Configurations of Cyclone DDS, for `dds` and for ROS on Cyclone: on the network, or only on this
machine."""

from collections.abc import Mapping
from typing import Final
from xml.sax.saxutils import quoteattr

from bridges.messages.cdr import LONGEST

MOST_PROCESSES: Final = 32
INTERNAL: Final = (
    "<Internal><MultipleReceiveThreads>false</MultipleReceiveThreads>"
    "<WriterLingerDuration>100 ms</WriterLingerDuration>"
    f"<MaxSampleSize>{LONGEST} B</MaxSampleSize>"
    "<DefragReliableMaxSamples>1</DefragReliableMaxSamples>"
    "<PrimaryReorderMaxSamples>1</PrimaryReorderMaxSamples>"
    "<SecondaryReorderMaxSamples>1</SecondaryReorderMaxSamples></Internal>"
)
"""A node leaves at once, also when its address has gone. Else Cyclone 0.10 ends its receive threads by
a datagram to that address and waits for it, for minutes (q_receive.c, trigger_recv_threads), and every
writer waits 1 s for acknowledgements that do not come. rclpy holds Python's lock meanwhile: the whole
daemon stands still.

A longer sample is dropped at its first fragment. Of each writer in the network at most one sample in
parts and one that came too early wait in memory (by default 16 and 128): after a loss the writer is
asked again."""
FOUND_AGAIN: Final = "<SPDPInterval>2 s</SPDPInterval>"
"""How often a node announces itself, so that it is found soon after the network was away for longer
than a lease (10 s). By default 0.10 does so each 8 s, 11 to a peer that it has lost each 30 s."""
NEVER_FORGOTTEN: Final = (
    "<InitialLocatorPruneDelay>inf</InitialLocatorPruneDelay>"
    "<DiscoveredLocatorPruneDelay>inf</DiscoveredLocatorPruneDelay>"
)
"""Else 11 gives up a peer that it has not found for 30 s, or has lost for 60 s. 0.10 never does, and
refuses these names."""
LOOPBACK: Final = (
    "<CycloneDDS><Domain><General>"
    '<Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    f"<AllowMulticast>false</AllowMulticast></General>{INTERNAL}"
    f"<Discovery>{FOUND_AGAIN}<ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
"""Keeps a node on this machine: unicast on `lo`, for up to 31 processes."""


def configuration(environ: Mapping[str, str]) -> str:
    """The configuration of a node on the network: ours, then CYCLONEDDS_URI's.

    As rmw_cyclonedds makes it (ROS 2 Jazzy, rmw_node.cpp): static peers by unicast beside multicast,
    and participant indices that peers can guess. LOCALHOST is without multicast: this machine and the
    peers. SYSTEM_DEFAULT leaves to Cyclone who is found.
    """
    own = environ.get("CYCLONEDDS_URI", "")
    wanted = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE")
    if wanted == "SYSTEM_DEFAULT":
        return for_ros(environ)
    here = ["localhost"] if wanted == "LOCALHOST" else []
    named = "".join(
        f"<Peer address={quoteattr(peer)}/>" for peer in [*here, *static_peers(environ)]
    )
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
    """CYCLONEDDS_URI for a ROS node on the network: what all of ours have, then what is there."""
    ours, own = (
        f"<CycloneDDS><Domain>{INTERNAL}<Discovery>{FOUND_AGAIN}</Discovery></Domain></CycloneDDS>",
        environ.get("CYCLONEDDS_URI", ""),
    )
    return f"{ours},{own}" if own else ours


def static_peers(environ: Mapping[str, str]) -> list[str]:
    """The hosts in ROS_STATIC_PEERS."""
    peers = (peer.strip() for peer in environ.get("ROS_STATIC_PEERS", "").split(";"))
    return [peer for peer in peers if peer]

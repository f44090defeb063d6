"""A ROS domain that nobody on this machine uses, on DDS or zenoh, for the demo and the tests."""

import atexit
import random
import socket
from typing import Final

from bridges.rmf.zenoh_config import LOOPBACK_PORT

DOMAINS: Final = range(10, 100)
"""Above 101 a domain's ports reach into those that Linux hands out to clients."""
CLAIM: Final = "\0rmf-bridges-test-domain-{}"


def free_domain() -> int:
    """One in which no participant of this machine is, claimed until this process ends.

    Raises OSError when there is none. Of a domain d the ports are 7400 + 250 d: multicast discovery
    there, the first participant's unicast ports 10 and 11 above it (DDSI-RTPS 2.5, 9.6.2.3).
    """
    for domain in random.sample(DOMAINS, len(DOMAINS)):
        base = 7400 + 250 * domain
        dds = all(_is_free(base + offset) for offset in (0, 10, 11))
        if dds and _is_free(LOOPBACK_PORT + domain, socket.SOCK_STREAM) and _claimed(domain):
            return domain
    raise OSError(f"every DDS domain from {DOMAINS[0]} to {DOMAINS[-1]} is in use on this machine")


def _is_free(port: int, kind: socket.SocketKind = socket.SOCK_DGRAM) -> bool:
    with socket.socket(socket.AF_INET, kind) as probe:
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True


def _claimed(domain: int) -> bool:
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        claim.bind(CLAIM.format(domain))
    except OSError:
        claim.close()
        return False
    atexit.register(claim.close)
    return True

"""Finds an unused ROS domain on this machine, on DDS or zenoh, for the demo and the tests."""

import atexit
import random
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from bridges.transports.zenoh.config import LOOPBACK_PORT

DOMAINS: Final = range(10, 70)
"""The domains that the demo and the tests use. `bench/` uses domains from 70 on. Above 101 the ports
overlap Linux's ephemeral ports."""
CLAIM: Final = "\0rmf-bridges-test-domain-{}"


def free_domain() -> int:
    """Return a domain without participants on this machine, and claim it until this process ends.

    Raises OSError if no domain is free.
    """
    domain, claim = _claimed()
    atexit.register(claim.close)
    return domain


@contextmanager
def domain_for_a_while() -> Iterator[int]:
    """Yield a free domain, and claim it until the end of the block."""
    domain, claim = _claimed()
    with claim:
        yield domain


def _claimed() -> tuple[int, socket.socket]:
    """Return a free domain and a socket. The domain is claimed until the socket is closed.

    Raises OSError if no domain is free. The ports of domain d begin at 7400 + 250 d. The first port is
    for multicast discovery. Participant i has two unicast ports, 10 + 2 i and 11 + 2 i above the first
    port (DDSI-RTPS 2.5, 9.6.2.3). The check covers the ports of many participants, because the first
    may have left while others remain.
    """
    for domain in random.sample(DOMAINS, len(DOMAINS)):
        base = 7400 + 250 * domain
        dds = all(_is_free(base + offset) for offset in (0, *range(10, 72)))
        zenoh = _is_free(LOOPBACK_PORT + domain, socket.SOCK_STREAM)
        if dds and zenoh and (claim := _claim(domain)):
            return domain, claim
    raise OSError(f"every DDS domain from {DOMAINS[0]} to {DOMAINS[-1]} is in use on this machine")


def _is_free(port: int, kind: socket.SocketKind = socket.SOCK_DGRAM) -> bool:
    with socket.socket(socket.AF_INET, kind) as probe:
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True


def _claim(domain: int) -> socket.socket | None:
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        claim.bind(CLAIM.format(domain))
    except OSError:
        claim.close()
        return None
    return claim

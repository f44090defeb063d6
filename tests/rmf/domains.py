"""DDS domains of their own, so that test runs side by side on one machine never meet."""

import os
import socket
from functools import cache

FIRST, LAST = 10, 99
"""The UDP ports of domain 99 still lie below those that Linux hands out."""

_claims: list[socket.socket] = []


def claim_domain() -> int:
    """A domain id that no other test run on this machine uses until this process ends."""
    count = LAST - FIRST + 1
    for offset in range(count):
        domain = FIRST + (os.getpid() + offset) % count
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            claim.bind(f"\0rmf-bridges-test-domain-{domain}")
        except OSError:
            claim.close()
            continue
        _claims.append(claim)
        return domain
    raise RuntimeError("every DDS domain for tests is in use on this machine")


@cache
def domain_of_this_run() -> int:
    """The domain that tests of this process share, where one of their own is not needed."""
    return claim_domain()

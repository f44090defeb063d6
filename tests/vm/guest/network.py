"""A network that comes up late, and that changes."""

import time
from typing import Final

from tests.vm.guest.system import Wrong, disable, enable, far_side, pid, sh

SITE: Final = ("ip", "-n", "site")
"""The first words of each `ip` command for the other machine. A network namespace at the end of a cable
simulates the other machine."""
MOVES: Final = (("10.7.0", "open"), ("10.8.0", "close"))
"""Each new network, with the request that is sent over it."""


def late() -> str:
    """Start the service without a network. Then let two networks come, one after the other. Check that
    the service fulfils a request on each network."""
    sh("ip", "netns", "add", "site")
    sh("ip", "link", "add", "eth0", "type", "veth", "peer", "name", "eth1", "netns", "site")
    sh(*SITE, "link", "set", "lo", "up")
    far_side("far")
    service = enable("far")
    old = pid(service)
    took = [_moved(addresses, word) for addresses, word in MOVES]
    if pid(service) != old:
        raise Wrong("systemd has restarted the service")
    disable("far")
    sh("systemctl", "stop", "far-far.service")
    sh("ip", "netns", "del", "site")
    return f"no restart; fulfilled {took[0]:.1f} and {took[1]:.1f} s after each address"


def _moved(addresses: str, word: str) -> float:
    """Give both ends of the cable addresses of this network. Return the time (s) from a request on it
    until the door moved."""
    for ip, name, last in ((("ip",), "eth0", 2), (SITE, "eth1", 3)):
        sh(*ip, "link", "set", name, "down")
        sh(*ip, "addr", "flush", "dev", name)
        sh(*ip, "addr", "add", f"{addresses}.{last}/24", "dev", name)
        sh(*ip, "link", "set", name, "up")
    began = time.monotonic()
    words = ("door", "far_door", word, "--direct", "--domain-id", "8")
    sh("ip", "netns", "exec", "site", "rmf-bridge", "send", *words)
    return time.monotonic() - began

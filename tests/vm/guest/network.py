"""A network that comes late, and changes."""

import time

from tests.vm.guest.system import disable, enable, far_side, sh

SITE = ("ip", "-n", "site")
"""The other machine: a network namespace at the other end of a cable."""


def late() -> str:
    """The service starts without a network. One comes, later with another address: it is reached."""
    sh("ip", "netns", "add", "site")
    sh("ip", "link", "add", "eth0", "type", "veth", "peer", "name", "eth1", "netns", "site")
    sh(*SITE, "link", "set", "lo", "up")
    far_side("far")
    enable("far")
    took = [_reached("10.7.0"), _reached("10.8.0")]
    disable("far")
    sh("ip", "netns", "del", "site")
    return f"a request from there is fulfilled {took[0]:.1f} and {took[1]:.1f} s after each address"


def _reached(addresses: str) -> float:
    """Give both ends these addresses; how long it then takes to open the door from the other one."""
    for ip, name, last in ((("ip",), "eth0", 2), (SITE, "eth1", 3)):
        sh(*ip, "addr", "flush", "dev", name)
        sh(*ip, "link", "set", name, "down")
        sh(*ip, "addr", "add", f"{addresses}.{last}/24", "dev", name)
        sh(*ip, "link", "set", name, "up")
    began = time.monotonic()
    words = ("door", "far_door", "open", "--direct", "--domain-id", "8")
    sh("ip", "netns", "exec", "site", "rmf-bridge", "send", *words)
    return time.monotonic() - began

"""The addresses at which other machines can reach this machine. Transports watch these addresses for
changes."""

import fcntl
import socket
import struct

Addresses = frozenset[tuple[int, str]]
"""Pairs of an interface's index and its IPv4 address, for the interfaces that can reach other
machines."""

GET_FLAGS, GET_ADDRESS = 0x8913, 0x8915
UP, LOOPBACK, RUNNING = 0x1, 0x8, 0x40


def addresses() -> Addresses:
    """Return the addresses of all interfaces that are up and have a link. Leave out loopback."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        found = ((index, _address(asking, name)) for index, name in socket.if_nameindex())
        return frozenset((index, address) for index, address in found if address)


def _address(asking: socket.socket, name: str) -> str:
    """Return an interface's IPv4 address. Return "" for loopback, and for an interface without an
    address or a link."""
    request = struct.pack("256s", name.encode()[:15])
    try:
        flags = struct.unpack_from("H", fcntl.ioctl(asking, GET_FLAGS, request), 16)[0]
        if flags & (UP | RUNNING | LOOPBACK) != UP | RUNNING:
            return ""
        return socket.inet_ntoa(fcntl.ioctl(asking, GET_ADDRESS, request)[20:24])
    except OSError:  # the interface has no address, or has disappeared
        return ""

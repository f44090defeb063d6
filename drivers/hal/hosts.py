"""Checks the text of a host's name or address, for Modbus TCP and HTTP."""

import ipaddress
import re


def misspelt_address(host: str) -> str:
    """Return the error for dotted numbers that are no IPv4 address; "" for an address or a name."""
    if not re.fullmatch(r"[0-9]+(\.[0-9]+)+", host):
        return ""
    try:
        ipaddress.IPv4Address(host)
    except ValueError:
        return f"{host} is not an address: write four numbers from 0 to 255 with dots between them"
    return ""


def is_loopback(host: str) -> bool:
    """Does this host name or address stay on this machine?"""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"

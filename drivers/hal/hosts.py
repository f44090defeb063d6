"""Checks of a host's name or address, and its one spelling, for Modbus TCP, HTTP and MQTT."""

import ipaddress
import re


def misspelt_address(host: str) -> str:
    """Return an error for dotted numbers that are not an IPv4 address. Return "" for an address or a
    name."""
    if not re.fullmatch(r"[0-9]+(\.[0-9]+)+", host):
        return ""
    try:
        ipaddress.IPv4Address(host)
    except ValueError:
        return f"{host} is not an address: write four numbers from 0 to 255 with dots between them"
    return ""


def is_loopback(host: str) -> bool:
    """Is this host name or address the machine itself (loopback)?"""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def one_spelling(host: str) -> str:
    """Return a host's name or address as it is compared with others: a name in lower case without a
    final dot, 127.0.0.1 for `localhost`, and an address in its shortest form."""
    name = host.lower().rstrip(".")
    if name == "localhost":
        return "127.0.0.1"
    try:
        return str(ipaddress.ip_address(name))
    except ValueError:
        return name


def misspelt_host(host: str) -> str:
    """Return an error for a text that is neither an address nor a host's name. Return "" for a valid
    text."""
    if re.fullmatch(r"[^:]*:[0-9]+", host):
        name, _, port = host.partition(":")
        return f"{host!r} contains a port: write host: {name}, port: {port}"
    if not re.fullmatch(r"[A-Za-z0-9_.:-]+", host):
        return f"{host!r} is not a host: write its address, such as 192.168.1.50"
    return misspelt_address(host)

"""What can be said of a host from its text alone, on Modbus TCP and on HTTP."""

import ipaddress
import re


def misspelt_address(host: str) -> str:
    """Why numbers with dots between them are no IPv4 address; "" for an address, and for a name."""
    if not re.fullmatch(r"[0-9]+(\.[0-9]+)+", host):
        return ""
    try:
        ipaddress.IPv4Address(host)
    except ValueError:
        return f"{host} is not an address: write four numbers from 0 to 255 with dots between them"
    return ""

"""The wire of the demos and the tests: `dds` where available, else `zenoh`."""

import os
from typing import Literal

from bridges.kinds.shared.rmf_section import Rmf
from bridges.transports.choose import missing_of_dds, open_transport
from bridges.transports.transport import Transport, TransportError

Wire = Literal["dds", "zenoh"]


def wire() -> Wire:
    """Return the environment's TRANSPORT, else a wire that runs here."""
    named = os.environ.get("TRANSPORT") or runs_here()
    if named not in ("dds", "zenoh"):
        raise TransportError(f"TRANSPORT is {named!r}: dds or zenoh")
    return "zenoh" if named == "zenoh" else "dds"


def runs_here() -> Wire:
    """Return dds if cyclonedds imports, else zenoh, as `auto` does on a machine without ROS."""
    return "zenoh" if missing_of_dds() else "dds"


def join(name: str, domain_id: int) -> Transport:
    """Join as a node of RMF's newest release on this wire, on this machine alone."""
    rmf = Rmf(transport=wire(), domain_id=domain_id, release="kilted")
    return open_transport(rmf, name, localhost=True)

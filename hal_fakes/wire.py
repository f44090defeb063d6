"""The wire (transport) of the demos and the tests. It is `dds` if available, otherwise `zenoh`."""

import os
from typing import Literal

from bridges.kinds.shared.rmf_section import Rmf
from bridges.transports.choose import missing_of_dds, open_transport
from bridges.transports.transport import Transport, TransportError

Wire = Literal["dds", "zenoh"]


def wire() -> Wire:
    """Return the wire in the environment variable TRANSPORT. If it is not set, return a wire that runs
    on this machine."""
    named = os.environ.get("TRANSPORT") or runs_here()
    if named not in ("dds", "zenoh"):
        raise TransportError(f"TRANSPORT is {named!r}: dds or zenoh")
    return "zenoh" if named == "zenoh" else "dds"


def runs_here() -> Wire:
    """Return `dds` if cyclonedds can be imported, otherwise `zenoh`. The setting `auto` does the same
    on a machine without ROS."""
    return "zenoh" if missing_of_dds() else "dds"


def join(name: str, domain_id: int) -> Transport:
    """Join the graph on this wire, only on this machine, as a node of RMF's newest release."""
    rmf = Rmf(transport=wire(), domain_id=domain_id, release="kilted")
    return open_transport(rmf, name, localhost=True)

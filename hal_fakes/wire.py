"""The wire that the demos and the tests run on: `dds` where it can be, `zenoh` elsewhere."""

import os
from typing import Literal

from bridges.rmf.choose import missing_of_dds, open_transport
from bridges.rmf.settings import Rmf
from bridges.rmf.transport import Transport, TransportError

Wire = Literal["dds", "zenoh"]


def wire() -> Wire:
    """TRANSPORT in the environment, else dds where cyclonedds imports, else zenoh."""
    named = os.environ.get("TRANSPORT", "")
    if named not in ("", "dds", "zenoh"):
        raise TransportError(f"TRANSPORT is {named!r}: dds or zenoh")
    if named == "zenoh" or (not named and missing_of_dds()):
        return "zenoh"
    return "dds"


def join(name: str, domain_id: int) -> Transport:
    """A node of RMF's newest release on this wire, on this machine alone."""
    rmf = Rmf(transport=wire(), domain_id=domain_id, release="kilted")
    return open_transport(rmf, name, localhost=True)

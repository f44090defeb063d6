"""A charger on HTTP, on CANopen, or on contacts."""

from collections.abc import Iterator

from workbench.commissioning.init.answers import Answers
from workbench.commissioning.init.points import Points

HTTP = """\
    # What the maker's state numbers mean: ask the maker. An unlisted number is an error.
    codes:
      idle: [0]
      handshake: [1, 2, 3, 4]
      charging: [5]
      stopping: [6]                  # current still flows
      released: [7]
      error: [8, 255]"""
CANOPEN = """\
    node: 10                         # the receiver's node id
    heartbeat_timeout_s: 0.5         # it comes each 0.1 s
    on_death: stop                   # what the daemon's end means for a charge: stop, or keep"""


def section(answers: Answers, points: Points) -> Iterator[str]:
    """The lines below the charger's name."""
    if answers.wiring in ("http", "can"):
        yield from (HTTP if answers.wiring == "http" else CANOPEN).splitlines()
        return
    yield "    inputs:"
    yield f"      charging: {{{points.contact()}}}   # on while current flows"
    yield f"      ready: {{{points.contact()}}}   # on while it could charge"
    yield f"      fault: {{{points.loop()}}}   # opens at a fault, as a cut wire does"
    yield "    outputs:"
    yield f"      enable: {{{points.relay()}}}   # lets it charge while it is on"

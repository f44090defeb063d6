"""A door on contacts, or on a relay that answers HTTP."""

from collections.abc import Iterator

from workbench.commissioning.init.answers import Answers
from workbench.commissioning.init.points import Points

SHELLY = """\
    # A Shelly of the second generation. Its own timer (toggle_after) releases the door when the
    # network is gone, and the daemon renews it in each scan.
    limits: {stale_after_s: 4}
    state_path: /rpc/Shelly.GetStatus
    inputs:                          # names with dots between them
      opened: {field: "input:0.state"}
      closed: {field: "input:1.state"}
    held: {field: "switch:0.output"}
    hold: {path: "/rpc/Switch.Set?id=0&on=true&toggle_after=10", method: GET}
    release: {path: "/rpc/Switch.Set?id=0&on=false", method: GET}
    switches_off_after_s: 10         # the same number as toggle_after"""


def section(answers: Answers, points: Points) -> Iterator[str]:
    """The lines below the door's name."""
    if answers.wiring == "http":
        yield from SHELLY.splitlines()
        return
    yield "    inputs:"
    yield f"      opened: {{{points.contact()}}}   # on while the door is fully open"
    yield f"      closed: {{{points.contact()}}}   # on while it is fully closed"
    yield "    outputs:"
    yield f"      hold_open: {{{points.relay()}}}   # holds the door open while it is on"

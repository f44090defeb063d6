"""Requests of RMF's from outside of the services."""

from tests.vm.guest import header
from tests.vm.guest.system import sh, until

ROOM = ("--domain-id", "7", "--localhost")
LIFT = dict.fromkeys((18, 16, 22, 23, 24), True)
"""The outputs of lift.yaml: each is on at high."""


def send(*words: str) -> str:
    """A request of RMF's, and its effect."""
    return sh("rmf-bridge", "send", *words, *ROOM)


def energise() -> dict[int, bool]:
    """A session of the lift holds two relays; returns their lines, each with its level for on."""
    began = header.now()
    send("lift", "Lift1", "L1", "--session", "vm/robot", "--direct")
    until(lambda: len(header.on(LIFT, began)) == 2, "two relays are on")
    return {line: LIFT[line] for line in header.on(LIFT, began)}

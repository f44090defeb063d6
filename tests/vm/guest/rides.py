"""Requests of RMF's from outside of the services."""

from collections.abc import Iterator
from contextlib import contextmanager

from tests.vm.guest import header
from tests.vm.guest.system import Wrong, beside, sh, until

ROOM = ("--domain-id", "7", "--localhost")
LIFT = dict.fromkeys((18, 16, 22, 23, 24), True)
"""The outputs of lift.yaml: each is on at high."""
HELD = [16, 18]
"""Of these outputs: the door and the mode, which a session holds."""


def send(*words: str, fails: bool = False) -> str:
    """A request of RMF's, and its effect; with `fails`, it has none in time."""
    return sh("rmf-bridge", "send", *words, *ROOM, fails=fails)


@contextmanager
def asking(*words: str) -> Iterator[None]:
    """A request of RMF's goes out each second meanwhile, also to a service that comes back; its effect
    is the end."""
    with beside("rmf-bridge", "send", *words, *ROOM, "--direct", "--timeout", "150"):
        yield


def energise() -> dict[int, bool]:
    """A session of the lift holds two relays; returns their lines, each with its level for on."""
    began = header.now()
    send("lift", "Lift1", "L1", "--session", "vm/robot", "--direct")
    until(lambda: sorted(header.on(LIFT, began)) == HELD, "two relays are on")
    return {line: LIFT[line] for line in HELD}


def end() -> None:
    """The session ends, and every output goes off."""
    send("lift", "Lift1", "--end", "--session", "vm/robot", "--direct")
    until(lambda: not header.on(LIFT), "every output is off after the session")


def ride() -> str:
    """A robot rides from L1 to L3: requests from outside of the service, lines of the header."""
    began = header.now()
    send("lift", "Lift1", "L1", "--session", "vm/robot", "--direct")
    send("lift", "Lift1", "L3", "--session", "vm/robot", "--direct")
    held = sorted(header.on(LIFT))
    end()
    called = [each.line for each in header.writes(began) if each.level and each.line in (22, 24)]
    if held != HELD or called[-1:] != [24]:
        raise Wrong(f"held at L3: {held}, calls: {called}")
    return f"at L3 after {header.now() - began:.1f} s, doors held there, all off after the end"

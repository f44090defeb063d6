"""RMF's requests, sent by a process outside the services."""

from collections.abc import Iterator
from contextlib import contextmanager

from tests.vm.guest import header
from tests.vm.guest.system import Wrong, beside, sh, until

ROOM = ("--domain-id", "7", "--localhost")
LIFT = dict.fromkeys((18, 16, 22, 23, 24), True)
"""The outputs of lift.yaml, each with the level that switches it on. The level is high for all of
them."""
HELD = [16, 18]
"""The outputs that a session holds on: the door's hold and AGV mode."""


def send(*words: str, fails: bool = False) -> str:
    """Send one of RMF's requests, and wait for its effect. With `fails`, the effect must not come in
    time; raise Wrong if it does."""
    return sh("rmf-bridge", "send", *words, *ROOM, fails=fails)


@contextmanager
def asking(*words: str) -> Iterator[None]:
    """Send a request each second in the block, even if the service restarts. At the end wait for the
    effect."""
    with beside("rmf-bridge", "send", *words, *ROOM, "--direct", "--timeout", "150"):
        yield


def energise() -> dict[int, bool]:
    """Let a session of the lift hold two relays on. Return the lines of the relays, with the level for
    "on"."""
    began = header.now()
    send("lift", "Lift1", "L1", "--session", "vm/robot", "--direct")
    until(lambda: sorted(header.on(LIFT, began)) == HELD, "two relays are on")
    return {line: LIFT[line] for line in HELD}


def end() -> None:
    """End the session, and wait until every output is off."""
    send("lift", "Lift1", "--end", "--session", "vm/robot", "--direct")
    until(lambda: not header.on(LIFT), "every output is off after the session")


def ride() -> str:
    """Let a robot ride from L1 to L3. A process outside the service sends the robot's requests. Check
    the outputs that the service writes during the ride."""
    began = header.now()
    send("lift", "Lift1", "L1", "--session", "vm/robot", "--direct")
    send("lift", "Lift1", "L3", "--session", "vm/robot", "--direct")
    held = sorted(header.on(LIFT))
    end()
    called = [each.line for each in header.writes(began) if each.level and each.line in (22, 24)]
    if held != HELD or called[-1:] != [24]:
        raise Wrong(f"held at L3: {held}, calls: {called}")
    return f"at L3 after {header.now() - began:.1f} s, doors held there, all off after the end"

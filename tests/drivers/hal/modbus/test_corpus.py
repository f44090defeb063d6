"""Replies of modules, recorded or written by hand. For each reply the corpus says whether the driver
must accept it."""

from itertools import chain, repeat
from pathlib import Path
from typing import NamedTuple

import pytest

from bridges.kinds.door.signals import DoorSample
from drivers import DriverError
from drivers.door.dry_contact import create
from tests.drivers.hal.modbus.line import SerialModule
from tests.drivers.hal.modbus.module import Module, Time, bus_to, door
from tests.drivers.hal.modbus.test_fuzz import DOOR
from tests.waiting import wait_until

OUTCOMES = {
    "closed": DoorSample(opened=False, closed=True),
    "open": DoorSample(opened=True, closed=False),
    "between": DoorSample(opened=False, closed=False),
    "both": DoorSample(opened=True, closed=True),
    "lost": None,
}


class Recorded(NamedTuple):
    """One line of the corpus. `replies` has one reply for each request, in hexadecimal digits."""

    outcome: str
    replies: tuple[str, ...]
    what: str


def recorded(framing: str) -> list[Recorded]:
    """Return the corpus of one framing (`tcp` or `rtu`). The corpus is in the file with that name."""
    text = (Path(__file__).parent / "corpus" / f"{framing}.txt").read_text("utf-8")
    lines = [line.split("|") for line in text.splitlines() if not line.startswith("#")]
    return [
        Recorded(outcome.strip(), tuple(filter(None, replies.split("  "))), what.strip())
        for outcome, replies, what in lines
    ]


def _bytes(reply: str, request: bytes = b"") -> bytes:
    return bytes.fromhex(reply.replace("tttt", request[:2].hex()).replace("-", ""))


def _check(module: Module, case: Recorded) -> None:
    """Check the driver's reading of the recorded replies. Then check that the driver reads a healthy
    module."""
    clock = Time()
    bus = bus_to(module.port, clock, timeout_s=0.05 if case.outcome == "lost" else 2.0, retries=0)
    driver = create("door", DOOR, bus)

    def read() -> DoorSample | None:
        while bus._wire.owes(1):
            bus._wire.begin(1)
        clock.now += 60.0
        try:
            return driver.read()
        except DriverError:
            return None

    assert read() == OUTCOMES[case.outcome]
    module.reply = module.answer
    if isinstance(module, SerialModule):
        module.on_wire = None
    wait_until(lambda: read() == OUTCOMES["closed"], "the healthy module is believed again")


@pytest.mark.parametrize("case", recorded("tcp"), ids=lambda case: case.what)
def test_on_tcp_only_a_right_reply_of_a_module_is_believed(module: Module, case: Recorded) -> None:
    door(module)
    replies = chain(case.replies, repeat("-"))
    module.reply = lambda request: _bytes(next(replies), request)
    _check(module, case)


@pytest.mark.parametrize("case", recorded("rtu"), ids=lambda case: case.what)
def test_on_a_serial_line_only_a_right_reply_of_a_unit_is_believed(
    line: SerialModule, case: Recorded
) -> None:
    door(line)
    replies = chain(case.replies, repeat("-"))
    line.on_wire = lambda frame: _bytes(next(replies))
    _check(line, case)

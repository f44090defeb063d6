"""Give each signal of a draft a free pin of the header, or a free address of the module."""

import re
from collections.abc import Iterator
from itertools import count
from typing import Final, Protocol

from workbench.commissioning.init.answers import DraftAnswers, Impossible, Level

REST_LOW: Final = (11, 13, 15, 16, 18, 22, 32, 33, 35, 36, 37, 38, 40, 12)
REST_HIGH: Final = (7, 29, 31, 26, 24)
"""Positions on J8 with a level that the Pi sets from power-on until the daemon starts. The Pi pulls the
positions of REST_HIGH high, and the positions of REST_LOW low.

A relay belongs on a pin whose level keeps the relay off. Source: BCM2835 ARM Peripherals, table 6-31
(BCM0 to 8 high).
"""


class FreePoints(Protocol):
    """The next free points. `contact`, `loop` and `relay` return the text inside a YAML mapping."""

    def contact(self) -> str:
        """Take a point for a contact that is closed while its signal is on. With a cut wire, the signal
        reads off."""

    def loop(self) -> str:
        """Take a point for a contact that is open while its signal is on, such as an alarm loop. With a
        cut wire, the signal reads on."""

    def relay(self) -> str:
        """Take a point for a relay whose energised state is on."""

    def listed(self) -> Iterator[str]:
        """Yield the lines of the bus that define the points taken. Only the points of an MQTT broker
        need such lines."""


class PinHeader:
    """The Pi's 40-pin header. The methods raise Impossible if no pin is left."""

    def __init__(self, contacts: Level, relays: Level) -> None:
        self._closed, self._relays = contacts, relays
        self._pull = "down" if contacts == "high" else "up"
        high = relays == "high"
        self._outputs = list(REST_LOW if high else REST_HIGH)
        self._inputs = list(REST_HIGH if high else REST_LOW)

    def contact(self) -> str:
        """Take the next input pin. The pin's pull resistor sets the level of an open contact."""
        return f'point: "J8:{self._input()}", active: {self._closed}, pull: {self._pull}'

    def loop(self) -> str:
        """Take the next input pin. The signal is on if the contact is open."""
        opened = "low" if self._closed == "high" else "high"
        return f'point: "J8:{self._input()}", active: {opened}, pull: {self._pull}'

    def relay(self) -> str:
        """Take the next pin that keeps its relay off from power-on."""
        return f'point: "J8:{_first(self._outputs)}", active: {self._relays}'

    def listed(self) -> Iterator[str]:
        """Yield nothing, because a pin needs no definition."""
        yield from ()

    def _input(self) -> int:
        return _first(self._inputs or self._outputs)


def _first(pins: list[int]) -> int:
    if not pins:
        raise Impossible(
            "the header has too few free pins that suit: leave signals out, or choose the"
            " encoding binary, relays that are on at high, or a Modbus I/O module"
        )
    return pins.pop(0)


class Module:
    """A Modbus I/O module. Its contacts are discrete inputs, and its relays are coils."""

    def __init__(self, unit: int) -> None:
        self._unit = unit
        self._inputs: Iterator[int] = count()
        self._coils: Iterator[int] = count()

    def contact(self) -> str:
        """Take the next discrete input. An open contact reads 0."""
        return f'point: "unit {self._unit} discrete input {next(self._inputs)}", active: high'

    def loop(self) -> str:
        """Take the next discrete input. The signal is on if the input reads 0."""
        return f'point: "unit {self._unit} discrete input {next(self._inputs)}", active: low'

    def relay(self) -> str:
        """Take the next coil."""
        return f'point: "unit {self._unit} coil {next(self._coils)}", active: high'

    def listed(self) -> Iterator[str]:
        """Yield nothing, because a coil or discrete input needs no definition."""
        yield from ()


class Broker:
    """Points behind an MQTT broker: each is a topic below the device's name. Payload 1 is a closed
    contact or an energised relay."""

    def __init__(self, name: str) -> None:
        self._topic = re.sub(r"[^A-Za-z0-9_-]+", "_", name)
        self._inputs = self._relays = 0

    def contact(self) -> str:
        """Take the next contact; an open contact publishes 0."""
        self._inputs += 1
        return f"point: input {self._inputs}, active: high"

    def loop(self) -> str:
        """Take the next contact. The signal is on while the contact publishes 0."""
        self._inputs += 1
        return f"point: input {self._inputs}, active: low"

    def relay(self) -> str:
        """Take the next relay."""
        self._relays += 1
        return f"point: relay {self._relays}, active: high"

    def listed(self) -> Iterator[str]:
        """Yield the definition of each point. A relay's device switches the relay off if the daemon
        stops repeating the command."""
        words = "when: [1], when_not: [0], stale_after_s: 5"
        yield "    points:                  # write the topics and payloads of your device"
        for number in range(1, self._inputs + 1):
            yield f"      input {number}: {{topic: {self._topic}/input/{number}, {words}}}"
        for number in range(1, self._relays + 1):
            topic = f"{self._topic}/relay/{number}"
            yield f"      relay {number}:"
            yield f"        {{topic: {topic}, {words}, switches_off_after_s: 10,"
            yield f"         command: {{topic: {topic}/set, payload_on: '1', payload_off: '0'}}}}"


def points_for(answers: DraftAnswers) -> FreePoints:
    """Return the points of this wiring. All points are free."""
    if answers.wiring == "gpio":
        return PinHeader(answers.contacts, answers.relays)
    return Broker(answers.name) if answers.wiring == "mqtt" else Module(answers.unit)

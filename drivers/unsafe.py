"""Wiring that works but is unsafe: a cut wire that reads as safe, a relay that energises at boot.

The daemon does not start with an unsafe choice unless `accept_unsafe: {signal: reason}` accepts it.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from bridges.kinds.shared.remarks import Remarks
from drivers.hal import gpio
from drivers.hal.points import Wire

ALARM_WITHIN_S: Final = 1.0
"""`check` warns of an alarm whose debounce is longer than this (s)."""

Unsafe = tuple[str, tuple[str, ...], str]
"""A signal, its path in the YAML, and its danger as a text."""


def cut_must_read(wire: Wire, asserted: bool, meaning: str) -> Iterator[Unsafe]:
    """Yield the wire unless a cut reads as `asserted`. `meaning`: the false reading, as a text."""
    reads = wire.broken_reads()
    if reads is None:
        yield wire.signal, wire.path, f"a cut wire floats (pull: none), and {meaning}"
    elif reads != asserted:
        yield wire.signal, wire.path, f"with its wire cut, {meaning}"


def energised_at_boot(wires: Iterable[Wire]) -> Iterator[Unsafe]:
    """Yield outputs with a relay that is energised from power-on until the daemon's claim."""
    for wire in wires:
        if wire.direction == "in":
            continue
        try:
            level = gpio.boot_level(wire.point)
        except ValueError:
            continue  # not a pin of the header
        if wire.asserted(level):
            pulled, use = ("high", "BCM9 to 27") if level else ("low", "BCM4 to 8")
            yield (
                wire.signal,
                wire.path,
                f"{gpio.describe(wire.point)} is pulled {pulled} from power-on through boot, and"
                f" its relay is on at {pulled}: use {use}, or the other active level",
            )


def unsafe_wires(wires: list[Wire], must_read: Mapping[str, tuple[bool, str]]) -> Iterator[Unsafe]:
    """Yield wires whose cut reads as safe, and outputs energised at boot. `must_read`: signal ->
    `cut_must_read`'s `asserted` and `meaning`.
    """
    for wire in wires:
        if wire.signal in must_read:
            yield from cut_must_read(wire, *must_read[wire.signal])
    yield from energised_at_boot(wires)


def slow_alarms(wires: Iterable[Wire]) -> Remarks:
    """Yield alarms with a long debounce, as (path, text)."""
    for wire in wires:
        if wire.debounce_s is not None and wire.debounce_s > ALARM_WITHIN_S:
            text = f"{wire.signal} is believed only after {wire.debounce_s:g} s"
            yield (*wire.path, "debounce_s"), f"{text}: contacts bounce for 0.05 s"


def needlessly_accepted(found: Iterable[Unsafe], accepted: Mapping[str, str]) -> Remarks:
    """Yield the safe signals that `accept_unsafe` names, as (path, text)."""
    for signal in accepted.keys() - {signal for signal, _, _ in found}:
        yield ("accept_unsafe", signal), f"nothing is unsafe about {signal}: delete this entry"


def unaccepted(found: Iterable[Unsafe], accepted: Mapping[str, str]) -> Remarks:
    """Yield the unsafe choices that `accept_unsafe` does not name, each with its two fixes."""
    for signal, path, text in found:
        if signal not in accepted:
            yield path, f"unsafe: {text}; or accept_unsafe: {{{signal}: <why it is safe here>}}"

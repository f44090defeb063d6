"""Finds wiring that works but is unsafe. Examples are a cut wire that reads as safe, and a relay that
energises at boot.

The daemon refuses to start with an unsafe choice. `accept_unsafe: {signal: reason}` in the YAML accepts
the choice.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from bridges.kinds.shared.remarks import Remarks
from drivers.hal import gpio
from drivers.hal.points import Wire

ALARM_WITHIN_S: Final = 1.0
"""The longest debounce (s) of an alarm for which `check` gives no warning."""

Unsafe = tuple[str, tuple[str, ...], str]
"""A signal, its path in the YAML, and its danger as a text."""


def cut_must_read(wire: Wire, asserted: bool, meaning: str) -> Iterator[Unsafe]:
    """Yield the wire if it does not read as `asserted` when cut. `meaning` describes the danger of the
    false reading."""
    reads = wire.broken_reads()
    if reads is None:
        yield wire.signal, wire.path, f"a cut wire floats (pull: none), and {meaning}"
    elif reads != asserted:
        yield wire.signal, wire.path, f"with its wire cut, {meaning}"


def energised_at_boot(wires: Iterable[Wire]) -> Iterator[Unsafe]:
    """Yield each output whose relay is energised from power-on until the daemon claims it."""
    for wire in wires:
        if wire.direction == "in":
            continue
        try:
            level = gpio.boot_level(wire.point)
        except ValueError:
            continue  # this point is not a pin of the header
        if wire.asserted(level):
            pulled, use = ("high", "BCM9 to 27") if level else ("low", "BCM4 to 8")
            yield (
                wire.signal,
                wire.path,
                f"{gpio.describe(wire.point)} is pulled {pulled} from power-on through boot, and"
                f" {pulled} switches its relay on: use {use}, or the opposite active level",
            )


def unsafe_wires(wires: list[Wire], must_read: Mapping[str, tuple[bool, str]]) -> Iterator[Unsafe]:
    """Yield each wire whose cut reads as safe, and each output that is energised at boot. `must_read`
    gives `asserted` and `meaning` of `cut_must_read` for each signal."""
    for wire in wires:
        if wire.signal in must_read:
            yield from cut_must_read(wire, *must_read[wire.signal])
    yield from energised_at_boot(wires)


def slow_alarms(wires: Iterable[Wire]) -> Remarks:
    """Yield a warning, with its path in the YAML, for each alarm with a long debounce."""
    for wire in wires:
        if wire.debounce_s is not None and wire.debounce_s > ALARM_WITHIN_S:
            text = f"{wire.signal} is noticed only after {wire.debounce_s:g} s"
            yield (*wire.path, "debounce_s"), f"{text}, but contacts bounce for only 0.05 s"


def needlessly_accepted(found: Iterable[Unsafe], accepted: Mapping[str, str]) -> Remarks:
    """Yield a problem, with its path in the YAML, for each signal that `accept_unsafe` names although
    it is safe."""
    for signal in accepted.keys() - {signal for signal, _, _ in found}:
        yield ("accept_unsafe", signal), f"nothing is unsafe about {signal}: delete this entry"


def unaccepted(found: Iterable[Unsafe], accepted: Mapping[str, str]) -> Remarks:
    """Yield a problem for each unsafe choice that `accept_unsafe` does not name. The problem's text
    describes the danger, and shows how the YAML can accept it."""
    for signal, path, text in found:
        if signal not in accepted:
            yield path, f"unsafe: {text}; or accept_unsafe: {{{signal}: <why it is safe here>}}"

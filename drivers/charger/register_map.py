"""Where a charger on registers has what, and what its numbers mean: a YAML's or profile's map."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Final, Literal

import msgspec

from bridges.core.fields import Name
from drivers.charger import rules as by_rules
from drivers.charger.rules import Errors, Rule
from drivers.charger.state_codes import Codes
from drivers.hal.modbus.registers import REGISTERS, TABLES, WRITABLE, Place, Word, misplaced, place
from drivers.profiles import Profile

Problems = Iterator[tuple[tuple[str, ...], str]]
Bit = Annotated[int, msgspec.Meta(ge=0, le=31)]
MEASURED: Final = ("volts", "amps", "battery_percent", "time_to_full_s")
KNOWN: Final = ("state", "receiver", "in_range", *MEASURED)
"""The values that have a use by their name."""


class Number(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One value of the station.

    `at`: `input register N`, `holding register N`, `discrete input N` or `coil N`.
    `words`: in how many registers it is: 2 for 32 bits.
    `low_first`: of two, the register with the low word is the first.
    `signed`: it may be negative (two's complement).
    `bit`: only this bit of it; 0 is the least.
    `scale`: what one of the maker's units is in ours (0.1 for tenths of an ampere).
    """

    at: Place
    words: Literal[1, 2] = 1
    low_first: bool = False
    signed: bool = False
    bit: Bit | None = None
    scale: float = 1.0

    def problems(self) -> Problems:
        """A place that is none, or what it cannot be."""
        if reason := misplaced(self.at, tuple(TABLES)):
            yield ("at",), reason
            return
        if misplaced(self.at, REGISTERS) and (self.words, self.signed, self.bit) != (
            1,
            False,
            None,
        ):
            yield ("at",), "is one bit: leave words, signed and bit out"
        if self.bit is not None and self.bit >= 16 * self.words:
            yield ("bit",), f"{self.words} registers have bits 0 to {16 * self.words - 1}"
        if self.low_first and self.words == 1:
            yield ("low_first",), "is for two registers: words: 2"

    def places(self) -> list[str]:
        """Its registers, the one with the high word first."""
        table, address = place(self.at)
        found = [f"{table} {address + n}" for n in range(self.words)]
        return found[::-1] if self.low_first else found

    def value(self, words: list[int]) -> float:
        """What these words mean, in the order of `places`."""
        raw, bits = 0, 16 * self.words
        for word in words:
            raw = raw << 16 | word
        if self.bit is not None:
            return raw >> self.bit & 1
        if self.signed and raw >> (bits - 1):
            raw -= 1 << bits
        return raw if self.scale == 1.0 else round(raw * self.scale, 6)

    def encoded(self, value: float) -> list[int]:
        """The words that mean this value, for who answers."""
        raw = int(value) << self.bit if self.bit is not None else round(value / self.scale)
        raw &= (1 << 16 * self.words) - 1
        return [raw >> 16 * n & 0xFFFF for n in reversed(range(self.words))]


class Power(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the station is told whether it may charge.

    `at`: `coil N` or `holding register N`.
    `on`: the value with which it may charge.
    `off`: the value with which it must not.
    `read_back`: false where it can only be written; then it is written in every scan.
    """

    at: Place
    on: Word
    off: Word
    read_back: bool = True

    def problems(self) -> Problems:
        """A place that cannot be written; values that it cannot take."""
        if reason := misplaced(self.at, WRITABLE):
            yield ("at",), reason
        elif misplaced(self.at, ("coil",)) is None and max(self.on, self.off) > 1:
            yield ("on",), "a coil is 0 or 1"
        if self.on == self.off:
            yield ("off",), "is the value of on"


class Order(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is written once.

    `at`: `coil N` or `holding register N`.
    `write`: the value.
    """

    at: Place
    write: Word = 1

    def problems(self) -> Problems:
        """A place that cannot be written."""
        if reason := misplaced(self.at, WRITABLE):
            yield ("at",), reason


class ChargerMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where a station has what. Addresses begin at 0.

    `values`: name -> where it is. `state` is what `codes` speaks of; `volts`, `amps`,
    `battery_percent`, `time_to_full_s` are shown; `receiver` is whose receiver it sees, 0 nobody's;
    `in_range` is not 0 while a robot stands where it can be charged; rules and errors take any name.
    `codes`: what the numbers of `state` mean; not needed with `rules`.
    `rules`: the state by other values, before `codes`; their places are names of `values`.
    `errors`: what is an error whatever the state says; its places are names of `values`.
    `power`: how it is told whether it may charge; without it the station is only observed.
    `clear_error`: what clears its error.
    `range_check`: what has it look where the robot stands, where it does not by itself.
    """

    values: Annotated[dict[Name, Number], msgspec.Meta(min_length=1)]
    codes: Codes | None = None
    rules: list[Rule] = msgspec.field(default_factory=list)
    errors: Errors = Errors()
    power: Power | None = None
    clear_error: Order | None = None
    range_check: Order | None = None

    def problems(self) -> Problems:
        """Names that are no value's; a state that nothing says."""
        yield from by_rules.problems(self.rules, self.codes is not None)
        if self.codes and "state" not in self.values:
            yield ("values",), "needs 'state', of which codes speaks"
        looked_at = [(("rules", *path), at) for path, at in by_rules.places(self.rules)]
        looked_at += [(("errors", *path), at) for path, at in self.errors.places()]
        for path, name in looked_at:
            if name not in self.values:
                yield path, f"'{name}' is no value of this map: {', '.join(self.values)}"
        if self.range_check and "in_range" not in self.values:
            yield ("range_check",), "needs the value in_range: where is its result?"

    def orders(self) -> Mapping[str, str]:
        """Each place that is written, by what it does."""
        names = ("power", "clear_error", "range_check")
        return {name: part.at for name in names if (part := getattr(self, name)) is not None}


PROFILE: Final = Profile("charger_register", "map", ChargerMap)

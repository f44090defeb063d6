"""A charger's register map, from a YAML or a profile. For each value of the station the map gives its
place (the Modbus table and address) and the meanings of its numbers."""

from collections.abc import Mapping
from typing import Annotated, Final, Literal

import msgspec

from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.yaml.spelling import unknown
from drivers.charger import rules as by_rules
from drivers.charger.rules import Rule, StationErrors
from drivers.charger.state_codes import Codes
from drivers.hal.modbus.map_parts import Placed, WrittenLevels, WrittenPlace
from drivers.hal.modbus.points import Point
from drivers.hal.modbus.registers import REGISTERS, Word, at, misplaced, place
from drivers.numbers import BITS, LongBit
from drivers.profiles import Profile

MEASURED: Final = ("volts", "amps", "battery_percent", "time_to_full_s")
KNOWN: Final = ("state", "receiver", "in_range", "range_ok", "at_height", *MEASURED)
"""The names in `values` that have a fixed meaning."""


class RegisterNumber(Placed, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One value of the station: its place (Modbus table and address) and its encoding."""

    words: Annotated[Literal[1, 2], tells("the number of registers: 2 for 32 bits.")] = 1
    low_first: Annotated[bool, tells("the first of the two registers holds the low word.")] = False
    signed: Annotated[bool, tells("the number is signed (two's complement).")] = False
    bit: Annotated[
        LongBit | None, tells("only this bit of the number; 0 is the least significant.")
    ] = None
    scale: Annotated[
        float,
        tells("""the factor that turns the maker's unit into this value's unit (0.1 for tenths of an
        ampere)."""),
    ] = 1.0

    def problems(self) -> Remarks:
        """Yield a problem for an invalid place. Yield a problem for each option that does not fit the
        table of the place, or the number of registers."""
        yield from super().problems()
        of_registers = (self.words, self.signed, self.bit) != (1, False, None)
        if of_registers and self.is_in("coil", "discrete input"):
            yield ("at",), "is one bit: delete words, signed and bit"
        if self.bit is not None and self.bit >= BITS * self.words:
            have = "two registers have" if self.words == 2 else "a register has"
            yield ("bit",), f"{have} bits 0 to {BITS * self.words - 1}"
        if self.low_first and self.words == 1:
            yield ("low_first",), "is for two registers: write words: 2"
        if misplaced(self.at, REGISTERS) is None and place(self.at)[1] + self.words > 65536:
            yield ("words",), "there is no register after 65535"

    def points(self, unit: int) -> list[Point]:
        """Return the unit's registers that hold this number, the high word first."""
        found = [at(unit, self.at, n) for n in range(self.words)]
        return found[::-1] if self.low_first else found

    def value(self, words: list[int]) -> float:
        """Return the value that these registers hold. `words` has the registers' contents, the high
        word first."""
        raw, bits = 0, BITS * self.words
        for word in words:
            raw = raw << BITS | word
        if self.bit is not None:
            return raw >> self.bit & 1
        if self.signed and raw >> (bits - 1):
            raw -= 1 << bits
        return raw if self.scale == 1.0 else round(raw * self.scale, 6)

    def encoded(self, value: float) -> list[int]:
        """Encode a value as words, for a simulated station."""
        raw = int(value) << self.bit if self.bit is not None else round(value / self.scale)
        raw &= (1 << BITS * self.words) - 1
        return [raw >> BITS * n & 0xFFFF for n in reversed(range(self.words))]


class Power(WrittenLevels, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The command that lets the station charge."""

    ON = "start"
    OFF = "stop"

    start: Annotated[Word, tells("the value that lets the station charge.")]
    stop: Annotated[Word, tells("the value that forbids the station to charge.")]
    read_back: Annotated[
        bool,
        tells("false if the command cannot be read back. In this case every scan writes it."),
    ] = True


class Order(WrittenPlace, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A command that the driver writes once each time the daemon requests it."""

    write: Annotated[Word, tells("the value that the driver writes.")] = 1


class ChargerMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A station's register map. Addresses begin at 0."""

    values: Annotated[
        dict[Name, RegisterNumber],
        msgspec.Meta(min_length=1),
        tells("""name of a value -> its place. These names have a fixed meaning. `state` is the number
        that `codes` lists. `volts`, `amps`, `battery_percent` and `time_to_full_s` are shown.
        `receiver` is the id of the receiver on the pad, 0 for none. `in_range` is not 0 while a robot
        is within the station's range. A station that reports the range without a range check has
        `range_ok` in place of `in_range`. `at_height` is not 0 while the station's moving pad is in
        its charging position. While `range_ok` or `at_height` is 0 the daemon keeps the power off.
        Rules and errors may use other names too."""),
    ]
    codes: Annotated[
        Codes | None, tells("the meanings of `state`'s numbers; not needed with `rules`.")
    ] = None
    rules: Annotated[
        list[Rule],
        tells(
            "rules that give the state from other `values`. The driver tries them before `codes`."
        ),
    ] = []
    temperatures: Annotated[
        dict[Name, Name],
        tells("name -> the value that is this temperature (°C), shown in status and diagnostics."),
    ] = {}
    errors: Annotated[StationErrors, tells("the `values` that mean an error in any state.")] = (
        StationErrors()
    )
    power: Annotated[
        Power | None,
        tells(
            "lets the station charge. Without this command the daemon only observes the station."
        ),
    ] = None
    clear_error: Annotated[Order | None, tells("the command that clears an error.")] = None
    range_check: Annotated[
        Order | None,
        tells("orders a check of the robot's position, if the station needs an order."),
    ] = None

    def problems(self) -> Remarks:
        """Yield a problem for each name that rules, errors or temperatures use but `values` lacks.
        Yield a problem for each name in `values` that nothing uses, and for a map without a state."""
        yield from by_rules.problems(self.rules, self.codes is not None)
        if self.codes and "state" not in self.values:
            yield ("values",), "needs 'state', because the map has codes"
        looked_at = [(("rules", *path), at) for path, at in by_rules.places(self.rules)]
        looked_at += [(("errors", *path), at) for path, at in self.errors.places()]
        looked_at += [(("temperatures", name), at) for name, at in self.temperatures.items()]
        for path, name in looked_at:
            if name not in self.values:
                yield path, unknown("value", name, list(self.values))
        used = {name for _, name in looked_at}
        for name in self.values:
            if name not in KNOWN and name not in used:
                text = unknown("value", name, KNOWN)
                yield ("values", name), f"{text}; no rule, error or temperature uses this name"
        if self.range_check and "in_range" not in self.values:
            needs = "needs the value `in_range`, which tells the result of the range check"
            yield ("range_check",), needs

    def orders(self) -> Mapping[str, str]:
        """Return the register or coil of each command that the map gives."""
        names = ("power", "clear_error", "range_check")
        return {name: part.at for name in names if (part := getattr(self, name)) is not None}


PROFILE: Final = Profile("charger_register", "map", ChargerMap)

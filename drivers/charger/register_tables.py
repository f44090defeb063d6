"""The table of a station's values for `check`. For a sample value of each name, the table shows what
the registers then hold."""

from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

from bridges.kinds.shared.table import Table
from drivers.charger.register_map import ChargerMap, RegisterNumber
from drivers.hal.modbus.points import Point


class ShownValue(NamedTuple):
    """A sample value, with its unit. The table row for this sample reveals the scale and the word
    order."""

    value: float
    unit: str


SAMPLES: Final = {
    "volts": ShownValue(25.8, "V"),
    "amps": ShownValue(12.9, "A"),
    "battery_percent": ShownValue(50.0, "%"),
    "time_to_full_s": ShownValue(600.0, "s"),
}


def samples(found: ChargerMap, cells: Mapping[str, list[Point]]) -> Table:
    """Tabulate each value of the map. `cells` gives the registers, coil or discrete input of each
    value."""
    rows = (
        (name, " and ".join(map(str, points)), _held(found.values[name], points, value), means)
        for name, points in cells.items()
        for value, means in _meanings(found, name, _is_bit(found.values[name], points))
    )
    return Table("values, by samples", ("value", "place", "holds", "reads as"), tuple(rows))


def _meanings(found: ChargerMap, name: str, is_bit: bool) -> Iterator[tuple[float, str]]:
    """Yield sample values for this name, with the meaning of each sample."""
    if name == "state" and found.codes:
        for code, (activity, side) in found.codes.meanings().items():
            means = f"{side}'s error" if side else str(activity)
            yield float(code), f"{code}: {means}"
    elif is_bit:
        yield from ((0.0, "0"), (1.0, "1"))
    else:
        value, unit = SAMPLES.get(name, ShownValue(1.0, ""))
        shown = found.values[name].value(found.values[name].encoded(value))
        yield value, f"{shown:g} {unit}".rstrip()


def _held(number: RegisterNumber, points: list[Point], value: float) -> str:
    words = number.encoded(value)
    if _is_single(points):
        return str(words[0])
    others = "" if number.bit is None else ", other bits 0"
    return " and ".join(f"0x{word:04X}" for word in words) + others


def _is_bit(number: RegisterNumber, points: list[Point]) -> bool:
    return number.bit is not None or _is_single(points)


def _is_single(points: list[Point]) -> bool:
    return points[0].table in ("coil", "discrete input")

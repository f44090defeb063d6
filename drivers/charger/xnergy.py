"""Xnergy's receiver (RCU): its numbers, wherever they are read, CANopen objects or Modbus registers.

Facts: the maker's published ROS driver (`xnergy-charger-rcu`): state codes, error bits, addresses,
scales, and the range check before a start. Not tried on the hardware. That driver decodes the high
error word only when it is zero, never compares an SDO reply with its question, and shows an RCU that
does not answer as state 250, which the RCU itself never sends.

Errors have a side: what the transmitter (TPU, on the wall) reports, or lies on the pad, is the
station's; everything else is the robot's, its receiver and where it stands.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from bridges.charger.signals import Activity, ChargerOutputs, ChargerSample, FaultSide, Measured

Words = Mapping[str, int]
"""Raw unsigned words by the names of `READS`; one that the wire does not have is absent."""

TICKS_PER_UNIT: Final = 128
"""Volts and amps come in 1/128."""

IDLE: Final = 0
CODES: Final[Mapping[int, tuple[Activity, str]]] = {
    IDLE: (Activity.IDLE, "idle"),
    1: (Activity.HANDSHAKE, "handshake 0"),
    2: (Activity.HANDSHAKE, "handshake 1"),
    3: (Activity.HANDSHAKE, "handshake 2"),
    4: (Activity.HANDSHAKE, "handshake 3"),
    5: (Activity.CHARGING, "charging"),
    6: (Activity.STOPPING, "stop"),
    7: (Activity.RELEASED, "restart delay"),
    8: (Activity.ERROR, "waits for its bootloader"),
    9: (Activity.HANDSHAKE, "pre-ready"),
    10: (Activity.HANDSHAKE, "waits for the run command"),
    11: (Activity.STOPPING, "ramp-down"),
    12: (Activity.ERROR, "manual charge: operated by hand"),
    238: (Activity.ERROR, "error"),
    240: (Activity.ERROR, "debug: ready"),
    241: (Activity.ERROR, "debug: unpaired"),
    242: (Activity.ERROR, "debug: paired"),
    243: (Activity.ERROR, "debug: enables the transmitter"),
    250: (Activity.ERROR, "not connected"),
    255: (Activity.ERROR, "debug: error"),
}
"""What is published; every other code is UNKNOWN (`activity`)."""

ERROR_BITS: Final[Mapping[int, tuple[FaultSide, str]]] = {
    0x0000_0001: ("robot", "the receiver's flash memory is not set"),
    0x0000_0002: ("robot", "pairing timeout"),
    0x0000_0004: ("robot", "communication lost after pairing"),
    0x0000_0008: ("robot", "authentication timeout"),
    0x0000_0010: ("robot", "handshake timeout"),
    0x0000_0020: ("robot", "communication lost while the coupling was estimated"),
    0x0000_0040: ("robot", "the gap to the pad is too wide"),
    0x0000_0080: ("robot", "the gap to the pad is too narrow"),
    0x0000_0100: ("robot", "communication lost while charging"),
    0x0000_0200: ("station", "the transmitter had an error while charging"),
    0x0000_4000: ("robot", "the receiver is too hot"),
    0x0000_8000: ("robot", "a fan of the receiver is stuck"),
    0x0001_0000: ("station", "the transmitter reports an error"),
    0x0002_0000: ("station", "foreign object on the pad"),
    0x0010_0000: ("robot", "a temperature sensor of the receiver has failed"),
}
"""The error as one number of 32 bits, its high word above its low word."""

IN_RANGE: Final = 1
RANGES: Final[Mapping[int, str]] = {
    0: "range check under way",
    IN_RANGE: "in range",
    2: "out of range",
    240: "range check failed",
}
"""Results of a range check; only IN_RANGE is a yes."""


@dataclass(frozen=True, slots=True)
class Object:
    """A CANopen object, by SDO: `octets` is its width, unsigned and little-endian."""

    index: int
    subindex: int
    octets: int = 2

    def __str__(self) -> str:
        return f"0x{self.index:04X}:{self.subindex:02X}"


@dataclass(frozen=True, slots=True)
class Where:
    """One number of the RCU: its CANopen object, its Modbus place; None where none is published."""

    sdo: Object | None
    modbus: str | None


CAN_BITRATE: Final = 250_000
CAN_NODE: Final = 10
HEARTBEAT_S: Final = 0.1
"""The node's heartbeat says `operational` (5) each 100 ms; old firmware has none."""
MODBUS_UNIT: Final = 16
MODBUS_BAUD: Final = 9600

ENABLE: Final = Where(Object(0x2000, 1, 1), "coil 0")
CHECK_RANGE: Final = Where(Object(0x2000, 2, 1), "coil 2")
READS: Final[Mapping[str, Where]] = {
    "state": Where(Object(0x2002, 0x0A), "input register 51"),
    "error_low": Where(Object(0x2002, 0x03), "input register 52"),
    "error_high": Where(Object(0x2002, 0x04), "input register 53"),
    "latched_low": Where(Object(0x2002, 0x01), "input register 0"),
    "latched_high": Where(Object(0x2002, 0x02), "input register 1"),
    "volts": Where(Object(0x2002, 0x06), "input register 32"),
    "amps": Where(Object(0x2002, 0x07), "input register 31"),
    "range": Where(Object(0x2002, 0x0D), "input register 100"),
    "device_c": Where(None, "input register 36"),
    "coil_c": Where(None, "input register 37"),
}
"""What a scan reads. `latched`: the maker's shadow error, which stays after the error has gone.
Modbus gives it all in input registers 0 to 100; at most 50 were ever asked for at once."""


def activity(code: int) -> Activity:
    """What a state code means: total, an unpublished one is UNKNOWN."""
    return CODES.get(code, (Activity.UNKNOWN, ""))[0]


def state_rows() -> list[tuple[str, str]]:
    """What `check` says of the state codes: (meaning, its numbers)."""
    rows = [
        (
            f"state {meaning}",
            ", ".join(str(code) for code in range(256) if activity(code) is meaning),
        )
        for meaning in Activity
        if meaning is not Activity.UNKNOWN
    ]
    return [*rows, ("any other state", "error, with its number")]


def sample(words: Words, settled: bool = True) -> ChargerSample:
    """One reading. `words` has at least state, error_low and error_high; never raises.

    `settled`: the range check's result is that of the last check (`settled` below).
    """
    found = errors(error_number(words))
    return ChargerSample(
        activity(words["state"]),
        words["state"],
        _text(words, found),
        Measured(
            in_range=settled and words.get("range") == IN_RANGE,
            volts=_units(words.get("volts")),
            amps=_units(words.get("amps")),
        ),
        side=found[0][0] if found else "",
    )


def celsius(word: int) -> int:
    """A temperature register: whole °C, below zero as a two's complement."""
    return word - 0x1_0000 if word & 0x8000 else word


def errors(number: int) -> list[tuple[FaultSide, str]]:
    """Side and text of each bit that is set: the station's first, the robot's last.

    An unpublished bit is nobody's.
    """
    found = [
        ERROR_BITS.get(1 << bit, ("", f"unknown error bit {bit}"))
        for bit in range(32)
        if number >> bit & 1
    ]
    return sorted(found, key=lambda error: ("station", "", "robot").index(error[0]))


def error_number(words: Words) -> int:
    """The error now; in an error state that shows none now, the one that is latched."""
    now = words["error_high"] << 16 | words["error_low"]
    if now or activity(words["state"]) is not Activity.ERROR:
        return now
    return words.get("latched_high", 0) << 16 | words.get("latched_low", 0)


def _text(words: Words, found: list[tuple[FaultSide, str]]) -> str:
    """The first error's side says it all for its own; another side's has its name before it."""
    if found:
        main = found[0][0]
        return "; ".join(
            text if side == main else f"{side or 'unknown side'}: {text}" for side, text in found
        )
    code = words["state"]
    if code in CODES and CODES[code][0] is Activity.ERROR:
        return f"{CODES[code][1]} (receiver state {code})"
    return ""


def _units(word: int | None) -> float | None:
    return None if word is None else word / TICKS_PER_UNIT


# ---- starting and stopping

RANGE_SETTLE_S: Final = 1.0
"""A check's result is believed so long after it was asked for: till then the one before is there."""


@dataclass(frozen=True, slots=True)
class Told:
    """What the receiver was told last. `enabled`: None while that is not known.

    `range_checks`: how many were asked for; `asked_at`: when the last was (monotonic s), inf while one
    has yet to be.
    """

    enabled: bool | None = None
    range_checks: int = 0
    asked_at: float = float("-inf")


@dataclass(frozen=True, slots=True)
class Orders:
    """What to write in this scan: `enable` (None: nothing), and whether to ask for a range check."""

    enable: bool | None = None
    check_range: bool = False


def settled(told: Told, now: float) -> bool:
    """Is the range check's result that of the last check?"""
    return now - told.asked_at >= RANGE_SETTLE_S


def steer(told: Told, outputs: ChargerOutputs, code: int, now: float) -> tuple[Told, Orders]:
    """What to write now that the state is `code`, and what the receiver has been told after that.

    A start and a range check are written in state idle only, each once; a stop once, and again while
    the receiver still charges. `power` None writes neither start nor stop.
    """
    ask = outputs.range_checks != told.range_checks
    if ask and code == IDLE:
        told = replace(told, range_checks=outputs.range_checks, asked_at=now)
    elif ask:
        told = replace(told, asked_at=float("inf"))
    enable = None
    if outputs.power and code == IDLE and not ask and not told.enabled:
        enable = True
    elif outputs.power is False and (told.enabled is not False or _charges(code)):
        enable = False
    if enable is not None:
        told = replace(told, enabled=enable)
    return told, Orders(enable, check_range=ask and code == IDLE)


def _charges(code: int) -> bool:
    return activity(code) is Activity.CHARGING

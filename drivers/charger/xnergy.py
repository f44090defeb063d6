"""Xnergy's receiver (RCU): what its numbers mean and how it is driven, whatever wire it is on.

Where its numbers are is in `canopen.py` and `modbus.py`. No place for clearing an error is published:
an error ends by itself, or with the receiver's power.

Facts: the maker's published ROS driver (`xnergy-charger-rcu`): state codes, error bits, addresses,
scales, and the range check before a start. Not tried on the hardware. That driver decodes the high
error word only when it is zero, never compares an SDO reply with its question, and shows an RCU that
does not answer as state 250, which the RCU itself never sends.

Errors have a side: what the transmitter (TPU, on the wall) reports, or lies on the pad, is the
station's; everything else is the robot's, its receiver and where it stands.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final, Protocol

from bridges.charger.settings import ChargerSettings
from bridges.charger.signals import Activity, ChargerOutputs, ChargerSample, FaultSide, Measured
from drivers import DriverError

ALWAYS: Final = ("state", "error_low", "error_high", "volts", "amps", "range")
IN_ERROR: Final = ("latched_low", "latched_high")
"""What a scan reads, and in an error also the maker's shadow error, which stays after it has gone."""
ENABLE: Final = "enable"
CHECK_RANGE: Final = "check_range"
"""What is written: 1 or 0, and 1."""

Words = Mapping[str, int]
"""Raw unsigned words by the names of ALWAYS and IN_ERROR."""

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
"""The result of a range check that is a yes. Others: 0 under way, 2 out of range, 240 failed."""


def activity(code: int) -> Activity:
    """What a state code means: total, an unpublished one is UNKNOWN."""
    return CODES.get(code, (Activity.UNKNOWN, ""))[0]


def sample(words: Words, settled: bool = True) -> ChargerSample:
    """One reading. `words` has at least state, error_low and error_high; never raises.

    An error is one whatever the state says.
    `settled`: the range check's result is that of the last check (`settled` below).
    """
    found, does = errors(error_number(words)), activity(words["state"])
    return ChargerSample(
        Activity.ERROR if found else does,
        words["state"],
        _text(words, found),
        Measured(
            in_range=settled and words.get("range") == IN_RANGE,
            volts=_units(words.get("volts")),
            amps=_units(words.get("amps")),
        ),
        side=found[0][0] if found else "",
        charges=bool(found) and does is Activity.CHARGING,
    )


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


# ---- on a wire


class Wire(Protocol):
    """Where the receiver's numbers are."""

    def alive(self) -> bool:
        """Raises DriverError where it does not live; True when it has started anew meanwhile."""

    def read(self, names: Iterable[str]) -> dict[str, int]:
        """The words of these names, read now. Raises DriverError."""

    def write(self, name: str, value: int, safe: bool = False) -> None:
        """ENABLE or CHECK_RANGE. `safe`: it takes power away. Raises DriverError."""

    def insist(self) -> None:
        """Try at once what comes next."""

    def now(self) -> float:
        """Monotonic seconds."""


class Receiver:
    """`drivers.Driver` of one receiver."""

    def __init__(self, settings: ChargerSettings, wire: Wire) -> None:
        self._settings = settings
        self._wire = wire
        self._told = Told()
        self._code = -1
        self._touched = False

    def open(self) -> None:
        """Nothing is claimed and nothing sent: a charge under way is not ours to stop."""

    def read(self) -> ChargerSample:
        """The receiver now. Raises DriverError."""
        if self._wire.alive():
            self._told = replace(self._told, enabled=None)
        words = self._wire.read(ALWAYS)
        if activity(words["state"]) is Activity.ERROR:
            words |= self._wire.read(IN_ERROR)
        self._code = words["state"]
        return sample(words, settled(self._told, self._wire.now()))

    def write(self, outputs: ChargerOutputs) -> None:
        """Start, stop or check the range, where that is due. Raises DriverError."""
        told, orders = steer(self._told, outputs, self._code, self._wire.now())
        if orders.enable is not None:
            self._enable(orders.enable)
        if orders.check_range:
            self._told = replace(self._told, range_checks=told.range_checks, asked_at=told.asked_at)
            self._wire.write(CHECK_RANGE, 1)
        self._told = told

    def make_safe(self) -> None:
        """What the settings say of the daemon's end: stopped, and acknowledged, or left alone."""
        if self._settings.on_death == "stop":
            self._enable(False)

    def close(self) -> None:
        """Stopped, if it may be on and may not stay so; and let go."""
        if self._touched and self._told.enabled is not False:
            self._wire.insist()
            try:
                self.make_safe()
            except DriverError:
                return  # it was tried; make_safe has said so before

    def _enable(self, on: bool) -> None:
        self._touched = True
        self._told = replace(self._told, enabled=None)
        self._wire.write(ENABLE, int(on), safe=not on)
        self._told = replace(self._told, enabled=on)


def rows(settings: ChargerSettings, where: Mapping[str, str]) -> list[tuple[str, str]]:
    """For `check`: (what, meaning), by where each name is."""
    return [
        *((name, f"read {where[name]}") for name in ALWAYS),
        *((name, f"the same in an error: {where[name]}") for name in IN_ERROR),
        ("power", f"write {where[ENABLE]}: 1 starts from idle, 0 stops"),
        ("range check", f"write {where[CHECK_RANGE]} before each start"),
        ("clear error", "no place for it is published: cycle the receiver's power"),
        ("end of the daemon", "0 is written" if settings.on_death == "stop" else "nothing"),
        *_state_rows(),
    ]


def _state_rows() -> Iterator[tuple[str, str]]:
    for meaning in Activity:
        if meaning is not Activity.UNKNOWN:
            codes = (str(code) for code in range(256) if activity(code) is meaning)
            yield f"state {meaning}", ", ".join(codes)
    yield "any other state", "error, with its number"


def warnings(settings: ChargerSettings, wire: str) -> Iterator[tuple[tuple[str, ...], str]]:
    """What is legal but worth a look: (path, text). `wire`: what the plug is of."""
    text = (
        "the maker's published numbers are not tried on hardware: watch the first charge, and pull"
    )
    yield (), f"{text} the {wire} plug during one"
    name = "an RCU rides on a robot and is no station"
    yield (), f"{name}: the device is named after the waypoint where that robot charges"
    if settings.receivers:
        yield ("receivers",), "this controller tells no receiver's id: it will charge nobody"

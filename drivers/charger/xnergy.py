"""Xnergy's receiver (RCU), on any bus. This file has the meanings of the receiver's numbers, and the
commands to the receiver.

`canopen.py` and `modbus.py` have the addresses of the numbers. The maker publishes no address for
clearing an error. An error ends by itself, or when somebody cycles the receiver's power.

The source is the maker's published ROS driver (`xnergy-charger-rcu`): state codes, error bits,
addresses, scales, and the range check before a start. Nobody has tried these facts on the hardware. The
maker's driver has three defects, which this code avoids:
- The maker's driver decodes the high error word only when this word is zero.
- The maker's driver never compares an SDO reply with its request.
- The maker's driver shows an RCU that does not answer as state 250. The RCU itself never sends 250.

For each error this file says which side is at fault. The transmitter (TPU, on the wall) and objects on
the pad are on the station's side. All other errors concern the receiver or its position, so they are on
the robot's side.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final, Protocol

from msgspec import Struct
from msgspec.structs import replace

from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import (
    Activity,
    ChargerOutputs,
    ChargerSample,
    FaultSide,
    Measured,
)
from bridges.kinds.shared.remarks import Remarks
from drivers import DriverError

ALWAYS: Final = ("state", "error_low", "error_high", "volts", "amps", "range")
IN_ERROR: Final = ("latched_low", "latched_high")
TEMPERATURES: Final[Mapping[str, str]] = {"device_c": "device", "coil_c": "coil"}
"""The names of the numbers that the driver reads. Every scan reads ALWAYS. In an error state the scan
also reads IN_ERROR, the error that the receiver has latched. Every scan reads TEMPERATURES (°C) too,
if the receiver gives them on this bus."""
ENABLE: Final = "enable"
CHECK_RANGE: Final = "check_range"
"""The names of the numbers that the driver writes. The driver writes 1 or 0 to ENABLE, and 1 to
CHECK_RANGE."""

Words = Mapping[str, int]
"""Raw unsigned words, by their names in ALWAYS and IN_ERROR."""

TICKS_PER_UNIT: Final = 128
"""The scale of voltage and current. The receiver counts in steps of 1/128 V and 1/128 A."""

IDLE: Final = 0
UNREAD: Final = -1
"""The driver's own code of a receiver that has not been read, or that was idle before a failed
reading."""
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
"""The state codes that the maker has published. The function `activity` maps every other code to
UNKNOWN."""

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
"""The bits of the 32-bit error number. Its upper half is the receiver's high error word."""

IN_RANGE: Final = 1
"""The range check's result for a robot in range. The other results are 0 (the check still runs), 2 (out
of range) and 240 (the check failed)."""


def activity(code: int) -> Activity:
    """Return the activity of a state code. Return UNKNOWN for a code that the maker has not
    published."""
    return CODES.get(code, (Activity.UNKNOWN, ""))[0]


def sample(words: Words, settled: bool = True) -> ChargerSample:
    """Decode one reading. Never raises. `words` has at least `state`, `error_low` and `error_high`.

    If an error bit is set, the activity is ERROR, whatever the state code says. `settled` is True if
    the range result belongs to the last range check (see the function `settled`).
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
            temperatures=tuple(
                (name, _signed(words[word])) for word, name in TEMPERATURES.items() if word in words
            ),
        ),
        side=found[0][0] if found else "",
        charges=bool(found) and does is Activity.CHARGING,
    )


def errors(number: int) -> list[tuple[FaultSide, str]]:
    """Return the side and the text of each set bit. The station's errors come first, and the robot's
    last.

    A bit that the maker has not published has no side.
    """
    found = [
        ERROR_BITS.get(1 << bit, ("", f"unknown error bit {bit}"))
        for bit in range(32)
        if number >> bit & 1
    ]
    return sorted(found, key=lambda error: ("station", "", "robot").index(error[0]))


def error_number(words: Words) -> int:
    """Return the current error. In an error state without a current error, return the latched error."""
    now = words["error_high"] << 16 | words["error_low"]
    if now or activity(words["state"]) is not Activity.ERROR:
        return now
    return words.get("latched_high", 0) << 16 | words.get("latched_low", 0)


def _text(words: Words, found: list[tuple[FaultSide, str]]) -> str:
    """Return the errors' texts in one line. Write the side before each error whose side differs from
    the first error's side."""
    if found:
        main = found[0][0]
        return "; ".join(
            text if side == main else f"{side or 'unknown side'}: {text}" for side, text in found
        )
    code = words["state"]
    if code in CODES and CODES[code][0] is Activity.ERROR:
        return f"{CODES[code][1]} (receiver state {code})"
    return ""


def _signed(word: int) -> int:
    return word - 0x1_0000 if word & 0x8000 else word


def _units(word: int | None) -> float | None:
    return None if word is None else word / TICKS_PER_UNIT


# ---- starting and stopping

RANGE_SETTLE_S: Final = 1.0
"""The time (s) from a range check until its result is valid. Until then the receiver shows the previous
result."""


class Written(Struct, frozen=True):
    """The last commands that the driver wrote to the receiver. `enabled` is the last ENABLE, or None
    while it is unknown.

    `range_checks` is the number of range checks that were requested. `asked_at` is the time of the last
    check (monotonic seconds). It is -inf before the first check, and inf while a requested check has
    not been sent yet. It is also inf after a check whose write has failed, until the next check.
    """

    enabled: bool | None = None
    range_checks: int = 0
    asked_at: float = float("-inf")


class Orders(Struct, frozen=True):
    """The commands of this scan. `enable` is None if the scan neither starts nor stops the receiver. A
    true `check_range` starts a range check."""

    enable: bool | None = None
    check_range: bool = False


def settled(written: Written, now: float) -> bool:
    """Return whether the range result belongs to the last range check."""
    return now - written.asked_at >= RANGE_SETTLE_S


def steer(
    written: Written, outputs: ChargerOutputs, code: int, now: float
) -> tuple[Written, Orders]:
    """Return the commands for state `code`, and the new `Written`. The new `Written` becomes valid when
    the driver has written the commands.

    The receiver gets a start or a range check only in state idle, and only once for each request. It
    gets a stop repeatedly while it still charges. If `power` is None, the receiver gets neither start
    nor stop.
    """
    ask = outputs.range_checks != written.range_checks
    if ask and code == IDLE:
        written = replace(written, range_checks=outputs.range_checks, asked_at=now)
    elif ask:
        written = replace(written, asked_at=float("inf"))
    enable = None
    if outputs.power and code == IDLE and not ask and not written.enabled:
        enable = True
    elif outputs.power is False and (written.enabled is not False or _charges(code)):
        enable = False
    if enable is not None:
        written = replace(written, enabled=enable)
    return written, Orders(enable, check_range=ask and code == IDLE)


def _charges(code: int) -> bool:
    return activity(code) is Activity.CHARGING


# ---- the driver, and its access to the receiver


class ReceiverAccess(Protocol):
    """Access to the receiver's numbers on one type of bus."""

    @property
    def reads(self) -> tuple[str, ...]:
        """The names of the numbers that every scan reads."""

    def alive(self) -> bool:
        """Return True if the receiver has restarted since the last call of `alive`. Raises DriverError
        if the receiver does not answer."""

    def read(self, names: Iterable[str]) -> dict[str, int]:
        """Read the words of these names now. Raises DriverError."""

    def write(self, name: str, value: int, safe: bool = False) -> None:
        """Write ENABLE or CHECK_RANGE. `safe` means that the write switches the power off. Raises
        DriverError."""

    def insist(self) -> None:
        """Let the next request skip the backoff (the pause after a failure)."""

    def now(self) -> float:
        """Return monotonic seconds."""


class Receiver:
    """The driver of one receiver (`drivers.Driver`)."""

    def __init__(self, settings: ChargerSettings, wire: ReceiverAccess) -> None:
        self._settings = settings
        self._wire = wire
        self._written = Written()
        self._code = UNREAD
        self._touched = False

    def open(self) -> None:
        """Do nothing, because a restart must not end a charge."""

    def read(self) -> ChargerSample:
        """Read and decode the receiver's numbers. Raises DriverError."""
        if self._code == IDLE:
            self._code = UNREAD  # after a failed reading the receiver gets no start
        if self._wire.alive():
            self._written = replace(self._written, enabled=None)
        words = self._wire.read(self._wire.reads)
        if activity(words["state"]) is Activity.ERROR:
            words |= self._wire.read(IN_ERROR)
        self._code = words["state"]
        return sample(words, settled(self._written, self._wire.now()))

    def write(self, outputs: ChargerOutputs) -> None:
        """Start, stop or check the range, as `steer` decides. Raises DriverError.

        A check whose write fails is not repeated. The robot then counts as out of range until the next
        check, because the receiver may still show the result of an earlier one.
        """
        written, orders = steer(self._written, outputs, self._code, self._wire.now())
        if orders.enable is not None:
            self._enable(orders.enable)
        if orders.check_range:
            self._written = replace(
                self._written, range_checks=written.range_checks, asked_at=float("inf")
            )
            self._wire.write(CHECK_RANGE, 1)
        self._written = written

    def make_safe(self) -> None:
        """Stop the receiver. Raises DriverError if the receiver does not acknowledge the stop. With
        `on_death: keep` do nothing."""
        if self._settings.on_death == "stop":
            self._enable(False)

    def close(self) -> None:
        """Stop the receiver if the driver ever commanded it, and it may be on. Does not raise."""
        if self._touched and self._written.enabled is not False:
            self._wire.insist()
            try:
                self.make_safe()
            except DriverError:
                return  # do not raise, because `make_safe` has already reported the failure

    def _enable(self, on: bool) -> None:
        self._touched = True
        self._written = replace(self._written, enabled=None)
        self._wire.write(ENABLE, int(on), safe=not on)
        self._written = replace(self._written, enabled=on)


def rows(settings: ChargerSettings, where: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return rows (subject, meaning) for `check`. `where` gives the address of each name as text."""
    return [
        *((name, f"read {where[name]}") for name in (*ALWAYS, *TEMPERATURES) if name in where),
        *((name, f"the same in an error: {where[name]}") for name in IN_ERROR),
        ("power", f"write {where[ENABLE]}: 1 starts from idle, 0 stops"),
        ("range check", f"write {where[CHECK_RANGE]} before each start"),
        ("clear error", "the maker publishes no address for it: cycle the receiver's power"),
        ("end of the daemon", "0 is written" if settings.on_death == "stop" else "nothing"),
        *_state_rows(),
    ]


def _state_rows() -> Iterator[tuple[str, str]]:
    for meaning in Activity:
        if meaning is not Activity.UNKNOWN:
            codes = (str(code) for code in range(256) if activity(code) is meaning)
            yield f"state {meaning}", ", ".join(codes)
    yield "any other state", "error, with its number"


def warnings(settings: ChargerSettings, wire: str) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake. `wire`
    names the plug that one of the warnings asks people to pull."""
    text = (
        "nobody has tried the maker's published numbers on hardware: watch the first"
        " charge, and pull"
    )
    yield (), f"{text} the {wire} plug during a charge"
    name = "an RCU rides on a robot and is not a station"
    yield (), f"{name}: give the device the name of the waypoint where that robot charges"
    if settings.receivers:
        yield (
            ("receivers",),
            "this controller gives no receiver's id, so no robot will be charged",
        )

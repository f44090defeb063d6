"""The map of a charger's CAN frames. A DBC file defines the frames' signals. The map gives each signal
a purpose.

The map is under `map:` in a device YAML, or in a file of `drivers/profiles/`.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Final

import msgspec

from bridges.kinds.shared.fields import Name, Period, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from bridges.yaml.spelling import unknown
from drivers.charger import dbc
from drivers.charger import rules as by_rules
from drivers.charger.rules import Rule, StationErrors
from drivers.charger.state_codes import Codes
from drivers.hal.can import named
from drivers.profiles import Profile

STATE_IS_NEEDED: Final = (
    "is missing: give a signal and the meanings of its numbers here, or give rules"
)
Signal = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,63}\.[A-Za-z_][A-Za-z0-9_]{0,63}$",
        extra={"pattern": "Frame.Signal, by their names in the DBC file"},
    ),
]
Mask = Annotated[int, msgspec.Meta(ge=1, le=0x1FFF_FFFF)]
Fresh = Annotated[float, msgspec.Meta(ge=0.05, le=60, extra={"unit": "s"})]
WakeEvery = Annotated[float, msgspec.Meta(ge=0.2, le=60, extra={"unit": "s"})]
NMT: Final = 0x000
"""The id of CANopen's NMT frame, which starts nodes (CiA 301). The frame's payload names the node."""


Frames = dbc.Dbc


class State(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The charger's state as one number."""

    at: Annotated[Signal, tells("the state's signal.")]
    codes: Annotated[Codes, tells("the meanings of the signal's numbers.")]


class Sent(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A frame that the driver sends periodically. The map gives `on`, `off` or both."""

    frame: Annotated[Name, tells("the frame's name in the DBC file.")]
    every_s: Annotated[Period, tells("how often the frame is sent.")]
    on: Annotated[
        dict[Name, float] | None,
        tells(
            """signal -> value while charging is allowed. Without `on` the frame is sent only while
        charging is forbidden."""
        ),
    ] = None
    setpoints: Annotated[
        dict[Name, Name],
        tells("signal -> the setpoint whose value this signal carries while charging is allowed."),
    ] = {}
    off: Annotated[
        dict[Name, float] | None,
        tells(
            """signal -> value while charging is forbidden. Without `off` the frame is sent only
        while charging is allowed."""
        ),
    ] = None

    def problems(self) -> Remarks:
        """Yield a problem for a frame that is never sent."""
        if self.on is None and self.off is None:
            yield (), "is never sent: give on, or off, or both"

    def values(self, on: bool, setpoints: Mapping[str, float]) -> dict[str, float] | None:
        """Return the value of each signal, with the power on (`on`) or off. Return None if the driver
        sends no such frame in this case."""
        if not on:
            return self.off
        if self.on is None:
            return None
        return {**self.on, **{signal: setpoints[name] for signal, name in self.setpoints.items()}}


class Wake(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A frame that wakes a silent charger. It must not start a charge."""

    frame: Annotated[
        Name, tells("the frame's name in the DBC file. It must not be a frame of `send`.")
    ]
    every_s: Annotated[WakeEvery, tells("how often the frame is sent while the charger is silent.")]
    says: Annotated[dict[Name, float], tells("signal -> value.")]


class FrameMap(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The map of the CAN frames of one make of charger."""

    dbc: Annotated[
        Name, tells("the DBC file: the name of a file in drivers/profiles/, or an absolute path.")
    ]
    masks: Annotated[
        dict[Name, Mask],
        tells("frame -> the bits of its id that identify it, if the id contains a node id too."),
    ] = {}
    state: Annotated[State | None, tells("the state as a number; not needed with `rules`.")] = None
    state_timeout_s: Annotated[
        Fresh,
        tells("the state is stale after this time without the frame of `state` or of a rule."),
    ]
    others_timeout_s: Annotated[
        Fresh, tells("any other value is stale after this time without its frame.")
    ] = 5.0
    volts: Annotated[Signal | None, tells("the voltage at the battery.")] = None
    amps: Annotated[Signal | None, tells("the current into the battery.")] = None
    receiver: Annotated[
        Signal | None,
        tells("""the receiver's id, or 0 for no receiver. If this signal's frame is missing, reading
        the charger fails."""),
    ] = None
    out_of_range: Annotated[
        Signal | None,
        tells("""not 0 while the robot is out of the charger's range. If `errors` has this signal
        too, the signal counts as an error only in an error state. In other states it only means
        that the robot has not arrived yet."""),
    ] = None
    range_ok: Annotated[
        Signal | None,
        tells("""not 0 while the robot is within the charger's range. Give this signal if the charger
        reports it at all times. While the signal is 0 the daemon keeps the power off. If the
        signal's frame is missing, reading the charger fails."""),
    ] = None
    at_height: Annotated[
        Signal | None,
        tells("""not 0 while the charger's moving pad is in its charging position. While the signal
        is 0 the daemon keeps the power off. If the signal's frame is missing, reading the charger
        fails."""),
    ] = None
    temperatures: Annotated[
        dict[Name, Signal],
        tells("name -> a temperature's signal (°C), for status and diagnostics."),
    ] = {}
    rules: Annotated[
        list[Rule],
        tells("""rules that give the state from other signals. The driver tries the rules before the
        codes of `state`."""),
    ] = []
    errors: Annotated[StationErrors, tells("signals that mean an error in any state.")] = (
        StationErrors()
    )
    send: Annotated[list[Sent], msgspec.Meta(min_length=1), tells("the frames to send.")]
    wake: Annotated[
        list[Wake],
        msgspec.Meta(max_length=8),
        tells("the frames that wake a silent charger, such as CANopen's NMT start."),
    ] = []

    def problems(self) -> Remarks:
        """Yield a problem for an unreadable DBC file. Yield a problem for each frame or signal that the
        file lacks."""
        try:
            found = dbc.load(self.dbc)
        except ValueError as error:
            yield ("dbc",), str(error)
            return
        for path, signal in self.signals():
            frame, _, name = signal.partition(".")
            lacks = list(_lacks(found, path, frame, name or "?"))
            yield from lacks
            if not lacks and found.is_paged(frame, name):
                text = "is multiplexed: an error would vanish with the next frame; write a driver"
                yield path, f"{signal} {text}"
        for path, text in by_rules.problems(self.rules, self.state is not None):
            yield (path, text) if path != ("codes",) else (("state",), STATE_IS_NEEDED)
        for name in self.masks:
            yield from _lacks(found, ("masks", name), name)
        for n, sent in enumerate(self.send):
            yield from _lacks(found, ("send", str(n), "frame"), sent.frame)
            for key, signals in (("on", sent.on), ("setpoints", sent.setpoints), ("off", sent.off)):
                for signal in signals or () if sent.frame in found.frames() else ():
                    yield from _lacks(found, ("send", str(n), key, signal), sent.frame, signal)
        for n, wake in enumerate(self.wake):
            yield from self._wake_problems(found, ("wake", str(n)), wake)

    def _wake_problems(self, found: Frames, path: tuple[str, ...], wake: Wake) -> Remarks:
        """Yield a problem for a wake frame that is also in `send`. Yield a problem for a wake frame
        that the DBC file cannot encode."""
        if wake.frame in (sent.frame for sent in self.send):
            yield (
                (*path, "frame"),
                f"{wake.frame} is a frame of send too, so it could start a charge; name another",
            )
        lacks = list(_lacks(found, (*path, "frame"), wake.frame))
        for signal in wake.says if not lacks else ():
            lacks += _lacks(found, (*path, "says", signal), wake.frame, signal)
        yield from lacks
        if not lacks:
            try:
                found.encode(wake.frame, wake.says)
            except ValueError as error:
                yield (*path, "says"), str(error)

    def signals(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """Yield each signal that the driver reads, written as `Frame.Signal`, with its path in the
        map."""
        if self.state:
            yield ("state", "at"), self.state.at
        for key in ("volts", "amps", "receiver", "out_of_range", "range_ok", "at_height"):
            if signal := getattr(self, key):
                yield (key,), signal
        for name, signal in self.temperatures.items():
            yield ("temperatures", name), signal
        for path, signal in self.errors.places():
            yield ("errors", *path), signal
        for path, signal in by_rules.places(self.rules):
            yield ("rules", *path), signal

    def error_frames(self) -> set[str]:
        """Return the frames that carry errors."""
        return {signal.split(".")[0] for _, signal in self.errors.places()}

    def state_frames(self) -> list[str]:
        """Return the frames that give the state. These are the frame with the state's number, and the
        frames whose signals the rules test."""
        signals = [self.state.at] if self.state else []
        signals += [signal for _, signal in by_rules.places(self.rules)]
        return list(dict.fromkeys(signal.split(".")[0] for signal in signals))

    def frames(self) -> list[str]:
        """Return the frames that the driver reads."""
        return list(dict.fromkeys(signal.split(".")[0] for _, signal in self.signals()))

    def wanted_setpoints(self) -> set[str]:
        """Return the names that a device's `setpoints` must give."""
        return {name for sent in self.send for name in sent.setpoints.values()}


PROFILE: Final = Profile("charger_can_frames", "map", FrameMap)


def _lacks(found: dbc.Dbc, path: tuple[str, ...], frame: str, signal: str = "") -> Remarks:
    if frame not in found.frames():
        yield path, unknown("frame", frame, found.frames())
    elif signal and signal not in found.signals(frame):
        yield path, unknown(f"signal of {frame}", signal, found.signals(frame))


def rows(found: FrameMap) -> Iterator[tuple[str, str]]:
    """Yield rows for `check` about the signals that the driver reads. Each row is a pair of a subject
    and its meaning."""
    frames = dbc.load(found.dbc)
    yield "frames", str(dbc.path(found.dbc))
    for path, signal in found.signals():
        at = named(frames.id(signal.split(".")[0]))
        if path[0] not in ("errors", "rules"):
            what = f"temperature {path[1]}" if path[0] == "temperatures" else path[0]
            yield what, f"{signal} ({at})"
        elif path[1] in ("station", "robot"):
            text = getattr(found.errors, path[1])[signal]
            yield f"{path[1]}'s error", f"{signal} ({at}): {text}"
    yield from by_rules.rows(
        found.rules, StationErrors(codes=found.errors.codes, bits=found.errors.bits)
    )


def tables(found: FrameMap, setpoints: Mapping[str, float]) -> Iterator[Table]:
    """Yield tables of the frames as bytes, for comparison with `candump`. The tables show the frames
    that the driver sends, and samples of the frames that the driver reads."""
    frames = dbc.load(found.dbc)
    sent = [_sent(frames, sent, on, setpoints) for sent in found.send for on in (True, False)]
    woken = [_row(frames, w.frame, "charger silent", w.every_s, w.says) for w in found.wake]
    yield Table(
        "frames that are sent",
        ("frame", "id", "while", "every", "bytes", "says"),
        (*sent, *woken),
    )
    yield Table(
        "frames that the driver reads, for sample values (all other signals 0)",
        ("frame", "id", "bytes", "reads as"),
        tuple(_samples(found, frames)),
    )


def _sent(frames: dbc.Dbc, sent: Sent, on: bool, setpoints: Mapping[str, float]) -> tuple[str, ...]:
    values, level = sent.values(on, setpoints), f"power {'on' if on else 'off'}"
    if values is None:
        return (sent.frame, named(frames.id(sent.frame)), level, "-", "-", "is not sent")
    return _row(frames, sent.frame, level, sent.every_s, values)


def _row(
    frames: dbc.Dbc, frame: str, during: str, every_s: float, values: Mapping[str, float]
) -> tuple[str, ...]:
    says = ", ".join(f"{name} {_physical(frames, frame, name, v)}" for name, v in values.items())
    payload = frames.encode(frame, values).hex(" ").upper()
    return frame, named(frames.id(frame)), during, f"{every_s:g} s", payload, says


def _samples(found: FrameMap, frames: dbc.Dbc) -> Iterator[tuple[str, ...]]:
    """Yield sample values of each signal that the driver reads. A sample shows the signal's scale, byte
    order and meaning."""
    shown = set()
    for path, at in found.signals():
        if path[0] == "rules" and at in shown:
            continue
        shown.add(at)
        frame, signal = at.split(".")
        for value, means in _values(found, path):
            payload = frames.sample(frame, signal, value)
            if payload is not None:
                said = f"{signal} {_physical(frames, frame, signal, value)}{means}"
                yield frame, named(frames.id(frame)), payload.hex(" ").upper(), said


def _values(found: FrameMap, path: tuple[str, ...]) -> Iterator[tuple[float, str]]:
    """Yield a signal's sample values with their meanings."""
    if path[0] == "state" and found.state:
        for code, (activity, side) in found.state.codes.meanings().items():
            yield float(code), f": {side or 'station'}'s error" if side else f": {activity}"
    elif path[0] == "errors" and path[1] in ("station", "robot"):
        yield 1.0, f": {path[1]}'s error"
    elif path[0] == "errors":
        number = getattr(found.errors, path[1])[int(path[2])]
        for side in ("station", "robot"):
            for value, text in getattr(number, side).items():
                yield float(1 << value if path[1] == "bits" else value), f": {side}'s error, {text}"
    else:
        yield _SAMPLES.get(path[0], 1.0), ""


_SAMPLES: Final = {"volts": 25.8, "amps": 12.9, "receiver": 4711.0, "temperatures": 20.0}


def _physical(frames: dbc.Dbc, frame: str, signal: str, value: float) -> str:
    return f"{value:g} {frames.unit(frame, signal)}".rstrip()

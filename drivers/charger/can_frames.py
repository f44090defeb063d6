"""A wireless charger on CAN that speaks frames of its maker's: read as they come, fed from the scan.

A map says what the frames mean (`can_map.py`). The charger charges while it is sent
what the map says, at the pace that the map says, and stops by itself when that stays away. So every
frame is sent by a scan of ours, never by a cyclic sender: a daemon that hangs stops feeding. A charger
that is not seen is not fed either; only the frames that take its power away are sent to it.
"""

from collections.abc import Callable, Iterator
from typing import Annotated, Final

import msgspec

from bridges.charger.settings import ChargerSettings
from bridges.charger.signals import Activity, ChargerOutputs, ChargerSample, FaultSide, Measured
from bridges.core.fields import Name
from bridges.settings.nodes import unknown
from drivers import DriverError
from drivers.charger import dbc
from drivers.charger.can_map import PROFILE, FrameMap, Problems, Sent, rows
from drivers.driver_type import DriverType
from drivers.hal import can
from drivers.profiles import profile_problems

Volume = Annotated[float, msgspec.Meta(ge=-100_000, le=100_000)]
UNKNOWN: Final[tuple[Activity, FaultSide]] = (Activity.UNKNOWN, "")


class Settings(ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One charger.

    `profile`: a file of drivers/profiles/ that has the map.
    `map`: the map, written here.
    `setpoints`: what the map leaves to the site: voltages and currents of its batteries.
    """

    profile: Name | None = None
    map: FrameMap | None = None
    setpoints: dict[Name, Volume] = msgspec.field(default_factory=dict)

    def problems(self) -> Problems:
        """What the fields cannot say one by one."""
        yield from super().problems()
        if self.on_death == "keep":
            yield ("on_death",), "it stops when it is not fed any more: leave this out"
        before = list(profile_problems(PROFILE, self.profile, self.map))
        yield from before
        if not before and not any(self.map.problems() if self.map else ()):
            yield from _setpoint_problems(self)

    def can_stop(self) -> bool:
        """By what it is sent, and by silence."""
        return True


def frame_map(settings: Settings) -> FrameMap:
    """The map, from wherever it is."""
    found: FrameMap = settings.map or PROFILE.load(settings.profile or "")
    return found


def _setpoint_problems(settings: Settings) -> Problems:
    found = frame_map(settings)
    wanted, given = found.wanted_setpoints(), set(settings.setpoints)
    for name in sorted(wanted - given):
        yield ("setpoints",), f"needs '{name}', which the charger is told while it charges"
    for name in sorted(given - wanted):
        yield ("setpoints", name), unknown("setpoint", name, sorted(wanted))
    if wanted == given:
        for sent in found.send:
            for on in (True, False):
                yield from _encoding_problems(settings, sent, on)


def _encoding_problems(settings: Settings, sent: Sent, on: bool) -> Problems:
    values = sent.values(on, settings.setpoints)
    if values is not None:
        try:
            dbc.load(frame_map(settings).dbc).encode(sent.frame, values)
        except ValueError as error:
            yield ("setpoints",) if on and sent.setpoints else ("map",), str(error)


def claims(settings: Settings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """The frames, which no other device of the bus may use: (place, path); nothing while not right."""
    if any(profile_problems(PROFILE, settings.profile, settings.map)):
        return
    found = frame_map(settings)
    if any(found.problems()):
        return
    frames = dbc.load(found.dbc)
    for name in (found.frames()[0], *(sent.frame for sent in found.send)):
        yield f"frame {can.named(frames.id(name))}", ("map",) if settings.map else ("profile",)


def describe(settings: Settings, bus_settings: can.Settings) -> list[tuple[str, str]]:
    """What `check` prints in place of a wiring table: (what, meaning)."""
    found = frame_map(settings)
    stops_s = settings.limits.peer_internal_timeout_s
    after = "a time that the maker knows" if stops_s is None else f"{stops_s:g} s"
    return [
        ("bus", can.describe(bus_settings)),
        *rows(found, settings.setpoints),
        ("end of the daemon", f"power off is sent; unfed it stops after {after}"),
        *found.state.codes.rows(),
    ]


def warnings(settings: Settings) -> Problems:
    """What is legal but worth a look: (path, text)."""
    if settings.profile and PROFILE.untried(settings.profile):
        text = (
            f"nobody has tried the profile {settings.profile} on hardware: watch the first charge"
        )
        yield ("profile",), text
    found = frame_map(settings)
    if found.receiver is None and settings.receivers:
        yield ("receivers",), "the map has no receiver: it will charge nobody"
    if settings.limits.peer_internal_timeout_s is None:
        text = "ask the maker after how long without frames it stops, and pull the plug to see it"
        yield (), f"{text}; write it down as limits: {{peer_internal_timeout_s: …}}"


def create(name: str, settings: Settings, bus: can.CanBus) -> "FrameDriver":
    """The charger on its bus; nothing is sent before the first reading."""
    return FrameDriver(settings, bus)


class FrameDriver:
    """`drivers.Driver` of one charger."""

    def __init__(self, settings: Settings, bus: can.CanBus) -> None:
        self._settings = settings
        self._map = frame_map(settings)
        self._dbc = dbc.load(self._map.dbc)
        self._bus = bus
        self._meanings = self._map.state.codes.meanings()
        self._pause = bus.backoff()
        self._needed = _needed(self._map)
        self._heard: dict[str, tuple[bytes, float]] = {}
        self._odd: dict[str, str] = {}
        self._in_error = False
        self._power: bool | None = None
        self._seen = False
        self._sent_at: dict[str, float] = {}
        self._touched = False
        for frame in self._map.frames():
            mask = self._map.masks.get(frame, 0x1FFF_FFFF) | can.EXTENDED
            bus.listen([can.Wanted(self._dbc.id(frame), mask)], self._hearer(frame))

    def open(self) -> None:
        """See that the scan can keep the pace; nothing is sent. Raises DriverError."""
        scan_s = self._bus.settings.scan_s
        for sent in self._map.send:
            if sent.every_s < scan_s:
                raise DriverError(
                    f"{sent.frame} must be sent every {sent.every_s:g} s, and a scan is"
                    f" every {scan_s:g} s: set the bus's scan_s to {sent.every_s:g} or less"
                )

    def read(self) -> ChargerSample:
        """The charger now. Raises DriverError."""
        self._seen = False
        self._bus.take()
        self._see()
        values = self._values()
        code = int(values.get(self._map.state.at, -1))
        activity, side = self._meanings.get(code, UNKNOWN)
        if self._undiagnosed(activity, values):
            values = self._values()
        found = self._errors(values)
        self._seen = True
        return ChargerSample(
            activity,
            code,
            "; ".join(text for _, text in found),
            self._measured(values),
            side=found[0][0] if found else side,
        )

    def write(self, outputs: ChargerOutputs) -> None:
        """Feed it, or keep it off: each frame that is due. Raises DriverError."""
        if outputs.power is not None:
            if outputs.power != self._power:
                self._sent_at.clear()
            self._power = outputs.power
        if self._power is not None and (self._seen or not self._power):
            self._feed(self._power)

    def make_safe(self) -> None:
        """What takes its power away, now. Silence does the rest. Raises DriverError."""
        self._power = False
        self._sent_at.clear()
        self._feed(on=False)
        self._touched = False

    def close(self) -> None:
        """Off, if it was ever fed; and let go."""
        if self._touched:
            try:
                self.make_safe()
            except DriverError:
                return  # it is not fed any more, and stops by itself

    def _feed(self, on: bool) -> None:
        now = self._bus.now()
        for sent in self._map.send:
            values = sent.values(on, self._settings.setpoints)
            slack_s = self._bus.settings.scan_s / 2
            due_at = self._sent_at.get(sent.frame, float("-inf")) + sent.every_s - slack_s
            if values is None or now < due_at:
                continue
            self._touched = self._touched or on
            payload = self._dbc.encode(sent.frame, values)
            self._bus.send(can.Frame(self._dbc.id(sent.frame), payload))
            self._sent_at[sent.frame] = now

    def _hearer(self, frame: str) -> Callable[[can.Frame, float], None]:
        length = self._dbc.length(frame)

        def hear(heard: can.Frame, at: float) -> None:
            if len(heard.payload) == length:
                self._heard[frame] = (heard.payload, at)
            else:
                size = f"{len(heard.payload)} bytes, where the map has {length}"
                self._odd[frame] = f"one ({can.named(heard.id)}) of {size}"

        return hear

    def _see(self) -> None:
        """Have what is needed, and fresh; wait for it where it may come in time. Raises HalError."""
        if self._fresh():
            self._pause.mended()
            self._odd.clear()
            return
        self._pause.check()
        if not self._bus.wait(self._fresh, self._bus.settings.timeout_s):
            raise self._pause.failed(self._silent())
        self._pause.mended()

    def _missing(self) -> str:
        """The first frame that is needed and not fresh; "" when all are."""
        now = self._bus.now()
        old = (b"", float("-inf"))
        return next(
            (
                f
                for f, limit_s in self._needed.items()
                if now - self._heard.get(f, old)[1] >= limit_s
            ),
            "",
        )

    def _undiagnosed(self, activity: Activity, values: dict[str, float]) -> bool:
        """An error's signals may come a moment after its state: wait for them, once for an error.

        An error of no side counts as the station's, and takes it out of service. True when waited.
        """
        before, self._in_error = self._in_error, activity is Activity.ERROR
        if before or not self._in_error or self._errors(values):
            return False
        since = self._heard[self._map.frames()[0]][1]
        texts = (*self._map.errors.station, *self._map.errors.robot)
        frames = {signal.split(".")[0] for signal in texts}

        def told() -> bool:
            return all(self._heard.get(frame, (b"", since))[1] > since for frame in frames)

        self._bus.wait(told, self._bus.settings.timeout_s)
        return True

    def _fresh(self) -> bool:
        return not self._missing()

    def _silent(self) -> str:
        frame = self._missing()
        place = can.named(self._dbc.id(frame))
        text = f"no {frame} ({place}) at {self._bus.where} within {self._needed[frame]:g} s"
        odd = self._odd.pop(frame, "")
        return (
            f"{text}, but {odd}: is it another make?" if odd else f"{text}: {self._bus.silence()}"
        )

    def _values(self) -> dict[str, float]:
        """Every signal of frames that are fresh, by Frame.Signal. Raises DriverError."""
        values: dict[str, float] = {}
        for frame, (payload, at) in self._heard.items():
            if self._bus.now() - at < self._needed.get(frame, self._map.others_timeout_s):
                found = self._dbc.decode(frame, payload)
                values |= {f"{frame}.{signal}": value for signal, value in found.items()}
        return values

    def _errors(self, values: dict[str, float]) -> list[tuple[FaultSide, str]]:
        sides: tuple[tuple[FaultSide, dict[str, str]], ...] = (
            ("station", self._map.errors.station),
            ("robot", self._map.errors.robot),
        )
        return [
            (side, text)
            for side, texts in sides
            for signal, text in texts.items()
            if values.get(signal, 0)
        ]

    def _measured(self, values: dict[str, float]) -> Measured:
        found = self._map
        receiver = values.get(found.receiver or "")
        out = values.get(found.out_of_range or "")
        return Measured(
            receiver_id=_receiver(receiver),
            in_range=None if out is None else not out,
            volts=_rounded(values.get(found.volts or "")),
            amps=_rounded(values.get(found.amps or "")),
        )


def _needed(found: FrameMap) -> dict[str, float]:
    """Frames without which there is no reading, and how old they may be: state, and who is there."""
    needed = {found.frames()[0]: found.state_timeout_s}
    if found.receiver:
        needed.setdefault(found.receiver.split(".")[0], found.others_timeout_s)
    return needed


def _receiver(number: float | None) -> str | None:
    """None where the map has none; 0 is nobody."""
    return None if number is None else str(int(number)) if number else ""


def _rounded(value: float | None) -> float | None:
    """Without what scaling by 0.1 leaves behind."""
    return None if value is None else round(value, 3)


DRIVER = DriverType(
    settings=Settings,
    buses=("can",),
    create=create,
    describe=describe,
    claims=claims,
    warnings=warnings,
    fake="hal_fakes.can.frame_charger",
)

"""A wireless charger on CAN that speaks frames of its maker's: read as they come, fed from the scan.

A map says what the frames mean (`can_map.py`). The charger charges while it is sent
what the map says, at the pace that the map says, and stops by itself when that stays away. So every
frame is sent by a scan of ours, never by a cyclic sender: a daemon that hangs stops feeding. A charger
that is not seen is not fed either; only the frames that take its power away are sent to it.
"""

import functools
from collections.abc import Iterator, Mapping
from typing import Annotated

import msgspec

from bridges.charger.settings import ChargerSettings
from bridges.charger.signals import Activity, ChargerOutputs, ChargerSample, FaultSide, Measured
from bridges.core.fields import Name
from bridges.core.table import Table
from bridges.settings.nodes import unknown
from drivers import DriverError
from drivers.charger import dbc
from drivers.charger.can_map import PROFILE, FrameMap, Problems, Sent, rows, tables
from drivers.charger.rules import MEANINGS, UNKNOWN, judge, places
from drivers.charger.state_codes import first_side
from drivers.driver_type import DriverType
from drivers.hal import can
from drivers.hal.can.broadcasts import Broadcasts, Said
from drivers.profiles import profile_problems

Volume = Annotated[float, msgspec.Meta(ge=-100_000, le=100_000)]


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
            yield (
                ("on_death",),
                "it stops when our frames cease, so it cannot be kept: leave this out",
            )
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
        yield ("setpoints",), f"needs '{name}', which is sent to the charger while it charges"
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
    after = "a time to be asked of the maker" if stops_s is None else f"{stops_s:g} s"
    return [
        ("bus", can.describe(bus_settings)),
        *rows(found),
        ("end of the daemon", f"power off is sent; unfed it stops after {after}"),
        *found.state.codes.rows(),
    ]


def frame_tables(settings: Settings) -> Iterator[Table]:
    """The frames as bytes."""
    return tables(frame_map(settings), settings.setpoints)


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
        self._setpoints = settings.setpoints
        self._map = frame_map(settings)
        self._dbc = dbc.load(self._map.dbc)
        self._meanings = self._map.state.codes.meanings()
        self._frames = Broadcasts(bus, _said(self._map, self._dbc))
        self._in_error = False
        self._power: bool | None = None
        self._seen = False
        self._touched = False

    def open(self) -> None:
        """See that the scan can keep the pace; nothing is sent. Raises DriverError."""
        for sent in self._map.send:
            self._frames.check_pace(sent.frame, sent.every_s)

    def read(self) -> ChargerSample:
        """The charger now. Raises DriverError."""
        self._seen = False
        values = self._values(self._frames.read())
        code = int(values.get(self._map.state.at, -1))
        rule = judge(self._map.rules, lambda at: _heard(values, at))
        activity, side = MEANINGS[rule.means] if rule else self._meanings.get(code, UNKNOWN)
        if self._undiagnosed(activity, values):
            state, *_ = self._map.frames()
            values = self._values(self._frames.read_after(state, self._map.error_frames()))
        found = self._errors(values, activity)
        if rule and rule.text:
            found = [(side, rule.text), *found]
        self._seen = True
        return ChargerSample(
            Activity.ERROR if found else activity,
            code,
            "; ".join(text for _, text in found),
            self._measured(values),
            side=first_side([side, *(whose for whose, _ in found)]),
            charges=bool(found) and activity is Activity.CHARGING,
        )

    def write(self, outputs: ChargerOutputs) -> None:
        """Feed it, or keep it off: each frame that is due. Raises DriverError."""
        if outputs.power is not None:
            if outputs.power != self._power:
                self._frames.feed_at_once()
            self._power = outputs.power
        if self._power is not None and (self._seen or not self._power):
            self._feed(self._power)

    def make_safe(self) -> None:
        """What takes its power away, now. Silence does the rest. Raises DriverError."""
        self._power = False
        self._frames.feed_at_once()
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
        for sent in self._map.send:
            values = sent.values(on, self._setpoints)
            if values is None:
                continue
            payload = functools.partial(self._dbc.encode, sent.frame, values)
            self._touched = self._touched or on
            self._frames.feed(self._dbc.id(sent.frame), sent.every_s, payload)

    def _undiagnosed(self, activity: Activity, values: dict[str, float]) -> bool:
        """An error's signals may come a moment after its state: they are awaited, once for an error.

        An error of no side counts as the station's, and takes it out of service.
        """
        before, self._in_error = self._in_error, activity is Activity.ERROR
        return self._in_error and not before and not self._errors(values, activity)

    def _values(self, frames: Mapping[str, bytes]) -> dict[str, float]:
        """Every signal of these frames, by Frame.Signal. Raises DriverError."""
        return {
            f"{frame}.{signal}": value
            for frame, payload in frames.items()
            for signal, value in self._dbc.decode(frame, payload).items()
        }

    def _errors(self, values: dict[str, float], activity: Activity) -> list[tuple[FaultSide, str]]:
        """What is wrong by the frames that are heard, whatever the state says.

        The signal of `out_of_range` is an error in an error's state only; else it tells where
        the robot is.
        """
        position = "" if activity is Activity.ERROR else self._map.out_of_range
        return self._map.errors.found(lambda at: 0 if at == position else values.get(at))

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


def _said(found: FrameMap, frames: dbc.Dbc) -> dict[str, Said]:
    """What is heard. Without its state, and who is there, there is no reading."""
    state, *_ = found.frames()
    receiver = (found.receiver or "").split(".")[0]
    ruled = {signal.split(".")[0] for _, signal in places(found.rules)}
    return {
        name: Said(
            id=frames.id(name),
            mask=found.masks.get(name, 0x1FFF_FFFF),
            length=frames.length(name),
            fresh_s=found.state_timeout_s if name == state else found.others_timeout_s,
            needed=name in {state, receiver, *ruled},
        )
        for name in found.frames()
    }


def _heard(values: Mapping[str, float], signal: str) -> float:
    if signal not in values:
        raise DriverError(f"{signal} is not heard, and a rule looks at it")
    return values[signal]


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
    tables=frame_tables,
    claims=claims,
    warnings=warnings,
    fake="hal_fakes.can.frame_charger",
)

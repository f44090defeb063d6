"""A wireless charger on CAN that uses its maker's own frames. The charger broadcasts frames, and must
receive periodic frames.

A map gives the frames' meanings (`can_map.py`). The charger charges only while it receives the map's
frames at the map's periods. When these frames cease, the charger stops by itself. Therefore the scan
loop sends each frame itself, and the driver does not let the kernel repeat frames. So if the daemon
hangs, the frames cease.

While the charger's own frames are missing, the driver sends only two sorts of frames: those that switch
the power off, and those that wake the charger. A map may have no wake frames.
"""

import functools
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Annotated

import msgspec

from bridges.kinds.charger.settings import ChargerSettings
from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample, Measured
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from bridges.kinds.shared.table import Table
from bridges.yaml.spelling import unknown
from drivers import DriverError
from drivers.charger import dbc
from drivers.charger.can_map import NMT, PROFILE, FrameMap, Sent, rows, tables
from drivers.charger.rules import Found, Meant, meaning, receiver_text, with_errors
from drivers.driver_type import DriverType
from drivers.hal import HalError, can
from drivers.hal.can.broadcasts import Broadcasts, Said, Sequel, Values

Volume = Annotated[float, msgspec.Meta(ge=-100_000, le=100_000)]


class FrameChargerSettings(ChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One charger."""

    profile: Annotated[
        Name | None, tells("the name of a file in drivers/profiles/ that holds the map.")
    ] = None
    map: Annotated[FrameMap | None, tells("the map, written here instead of a profile.")] = None
    setpoints: Annotated[
        dict[Name, Volume],
        tells("name -> value, for the voltages and currents that the map does not give."),
    ] = msgspec.field(default_factory=dict)

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        if self.on_death == "keep":
            yield (
                ("on_death",),
                (
                    "a charge ends when the daemon's frames cease, so on_death cannot keep it:"
                    " delete on_death"
                ),
            )
        before = list(PROFILE.problems(self.profile, self.map))
        yield from before
        if not before and not any(self.map.problems() if self.map else ()):
            yield from _setpoint_problems(self)

    def can_stop(self) -> bool:
        """Return True. A frame stops the charger, and the charger also stops when the driver's frames
        cease."""
        return True


def frame_map(settings: FrameChargerSettings) -> FrameMap:
    """Return the YAML's map, or the profile's map if the YAML has no map."""
    return PROFILE.chosen(settings.profile, settings.map)


def _setpoint_problems(settings: FrameChargerSettings) -> Remarks:
    found = frame_map(settings)
    wanted, given = found.wanted_setpoints(), set(settings.setpoints)
    for name in sorted(wanted - given):
        yield ("setpoints",), f"needs '{name}', which is sent to the charger while it charges"
    for name in sorted(given - wanted):
        yield ("setpoints", name), unknown("setpoint", name, sorted(wanted))
    yield from _beyond(settings.setpoints)
    if wanted != given:
        return
    impossible = list(_impossible(settings, found))
    yield from impossible
    if not impossible:
        for sent in found.send:
            for on in (True, False):
                yield from _encoding_problems(settings, sent, on)


def _beyond(setpoints: Mapping[str, float]) -> Remarks:
    """Yield a problem for each setpoint above its limit in the same list, such as volts above
    max_volts."""
    for name, value in setpoints.items():
        most = setpoints.get(f"max_{name}", value)
        if value > most:
            yield ("setpoints", name), f"is {value:g}, above max_{name}, which is {most:g}"


def _impossible(settings: FrameChargerSettings, found: FrameMap) -> Remarks:
    """Yield a problem for each setpoint outside the range of its signal in the DBC file."""
    frames = dbc.load(found.dbc)
    for sent in found.send:
        for signal, name in sent.setpoints.items():
            value, (low, high) = settings.setpoints[name], frames.bounds(sent.frame, signal)
            if not low <= value <= high:
                unit = frames.unit(sent.frame, signal)
                allowed = f"{low:g} to {high:g} {unit}".rstrip()
                yield ("setpoints", name), f"is {value:g}: {sent.frame}.{signal} takes {allowed}"


def _encoding_problems(settings: FrameChargerSettings, sent: Sent, on: bool) -> Remarks:
    values = sent.values(on, settings.setpoints)
    if values is not None:
        try:
            dbc.load(frame_map(settings).dbc).encode(sent.frame, values)
        except ValueError as error:
            yield ("setpoints",) if on and sent.setpoints else ("map",), str(error)


def claims(settings: FrameChargerSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each frame that no other device may use, with its path in the YAML. Yield nothing while the
    map has problems.

    CANopen's NMT frame is left out, because all devices share this frame.
    """
    if any(PROFILE.problems(settings.profile, settings.map)):
        return
    found = frame_map(settings)
    if any(found.problems()):
        return
    frames = dbc.load(found.dbc)
    ours = [*found.state_frames(), *(sent.frame for sent in found.send)]
    ours += [wake.frame for wake in found.wake if frames.id(wake.frame) != NMT]
    for name in ours:
        yield f"frame {can.named(frames.id(name))}", ("map",) if settings.map else ("profile",)


def describe(
    settings: FrameChargerSettings, bus_settings: can.CanSettings
) -> list[tuple[str, str]]:
    """Return the rows that `check` prints instead of a wiring table. Each row is a subject and its
    meaning."""
    found = frame_map(settings)
    stops_s = settings.limits.peer_internal_timeout_s
    after = "a time that only the maker knows" if stops_s is None else f"{stops_s:g} s"
    return [
        ("bus", can.describe(bus_settings)),
        *rows(found),
        (
            "end of the daemon",
            f"the driver sends power off; without frames the charger stops after {after}",
        ),
        *(found.state.codes.rows() if found.state else ()),
    ]


def frame_tables(settings: FrameChargerSettings) -> Iterator[Table]:
    """Yield tables of the frames' bytes."""
    return tables(frame_map(settings), settings.setpoints)


def warnings(settings: FrameChargerSettings) -> Remarks:
    """Yield a warning, with its path in the YAML, for each valid setting that may be a mistake."""
    yield from PROFILE.warnings(settings.profile, "watch the first charge")
    found = frame_map(settings)
    if found.receiver is None and settings.receivers:
        yield ("receivers",), "the map has no receiver, so no robot will be charged"
    if settings.limits.peer_internal_timeout_s is None:
        text = (
            "ask the maker how long the charger charges without frames, and pull the plug to check"
        )
        yield (), f"{text}; write that time as limits: {{peer_internal_timeout_s: …}}"


def create(name: str, settings: FrameChargerSettings, bus: can.CanBus) -> "FrameDriver":
    """Make the charger's driver. Before the first reading the driver sends only wake frames."""
    return FrameDriver(settings, bus)


class FrameDriver:
    """The driver of one charger (`drivers.Driver`)."""

    def __init__(self, settings: FrameChargerSettings, bus: can.CanBus) -> None:
        self._setpoints = settings.setpoints
        self._map = frame_map(settings)
        self._dbc = dbc.load(self._map.dbc)
        said, sequel = _said(self._map, self._dbc), _sequel(self._map)
        self._frames = Broadcasts(bus, said, self._dbc.decode, sequel)
        self._power: bool | None = None
        self._sent_on: bool | None = None
        self._seen = False
        self._touched = False

    def open(self) -> None:
        """Check that the scans are frequent enough for each frame's period. Send nothing. Raises
        DriverError."""
        for sent in self._map.send:
            self._frames.check_pace(sent.frame, sent.every_s)
        for wake in self._map.wake:
            self._frames.check_pace(wake.frame, wake.every_s)

    def read(self) -> ChargerSample:
        """Read and decode the charger's fresh frames. Raises DriverError."""
        self._seen = False
        sample = decode(self._map, self._dbc, self._read())
        self._seen = True
        return sample

    def write(self, outputs: ChargerOutputs) -> None:
        """Send each frame that is due: the frames for power on or the frames for power off. Raises
        DriverError.

        While the charger's own frames are missing, send the frames for power off, even if `outputs`
        wants the power on.
        """
        if outputs.power is not None:
            self._power = outputs.power
        if self._power is not None:
            self._feed(self._power and self._seen)

    def make_safe(self) -> None:
        """Send the frames for power off at once, and stop sending all other frames. Raises
        DriverError."""
        self._power, self._sent_on = False, None
        self._feed(on=False)
        self._touched = False

    def close(self) -> None:
        """Switch the power off, if this driver ever switched it on. Does not raise."""
        if self._touched:
            try:
                self.make_safe()
            except DriverError:
                return  # the charger stops by itself, because the driver's frames cease

    def _read(self) -> Values:
        """Return the values of fresh frames. If no frame is fresh, send each wake frame that is due,
        and raise HalError."""
        try:
            return self._frames.read()
        except HalError:
            for wake in self._map.wake:
                payload = functools.partial(self._dbc.encode, wake.frame, wake.says)
                with suppress(HalError):  # the reading's error is raised below, and says more
                    self._frames.feed(self._dbc.id(wake.frame), wake.every_s, payload)
            raise

    def _feed(self, on: bool) -> None:
        if on != self._sent_on:
            self._frames.feed_at_once()
        self._sent_on = on
        for sent in self._map.send:
            values = sent.values(on, self._setpoints)
            if values is None:
                continue
            payload = functools.partial(self._dbc.encode, sent.frame, values)
            self._touched = self._touched or on
            self._frames.feed(self._dbc.id(sent.frame), sent.every_s, payload)


def decode(found: FrameMap, frames: dbc.Dbc, values: Values) -> ChargerSample:
    """Decode the charger's fresh signals. Raises DriverError."""
    meant = _meant(found, values)
    codes = found.state.codes if found.state else None
    shown = with_errors(meant, _errors(found, values, meant.activity), codes)
    return ChargerSample(
        shown.activity,
        shown.code,
        shown.text,
        _measured(found, frames, values),
        side=shown.side,
        charges=shown.charges,
    )


def _meant(found: FrameMap, values: Values) -> Meant:
    state = found.state
    codes, code = (state.codes, int(values.get(state.at, -1))) if state else (None, None)
    return meaning(found.rules, codes, lambda at: _heard(values, at), code)


def _errors(found: FrameMap, values: Values, activity: Activity) -> Found:
    """Return the errors that the received frames report, in any state of the charger.

    The signal `out_of_range` counts as an error only in an error state. In other states the signal
    shows the robot's position.
    """
    position = "" if activity is Activity.ERROR else found.out_of_range
    return found.errors.found(lambda at: 0 if at == position else values.get(at))


def _measured(found: FrameMap, frames: dbc.Dbc, values: Values) -> Measured:
    def is_valid(signal: str) -> bool:
        """Is the value within the signal's minimum and maximum in the DBC file? A value outside this
        range is not a measurement."""
        low, high = frames.bounds(*signal.split("."))
        return low <= values[signal] <= high

    def flag(signal: str | None) -> bool | None:
        """Is the signal valid and not 0? Return None if the map has no such signal."""
        return None if signal is None else bool(values[signal]) and is_valid(signal)

    out = values.get(found.out_of_range or "")
    return Measured(
        receiver_id=receiver_text(values.get(found.receiver or "")),
        in_range=None if out is None else not out,
        range_ok=flag(found.range_ok),
        at_height=flag(found.at_height),
        volts=_rounded(values.get(found.volts or "")),
        amps=_rounded(values.get(found.amps or "")),
        temperatures=tuple(
            (name, round(values[signal], 3))
            for name, signal in found.temperatures.items()
            if signal in values and is_valid(signal)
        ),
    )


def _sequel(found: FrameMap) -> Sequel:
    """Return the error frames for which a reading must wait. The charger may send an error frame after
    the frame of its state.

    Without the error frames, the driver could not know whether the station or the robot has the error.
    It would report an error of the station, and RMF would no longer use the station.
    """
    return Sequel(
        first=found.state_frames()[0],
        others=found.error_frames(),
        begins=lambda values: _meant(found, values).activity is Activity.ERROR,
        is_told=lambda values: bool(_errors(found, values, Activity.ERROR)),
    )


def _said(found: FrameMap, frames: dbc.Dbc) -> dict[str, Said]:
    """Return the frames to receive. A reading fails if a frame with the state, the receiver's id,
    `range_ok` or `at_height` is missing."""
    state = found.state_frames()
    pad = (found.receiver, found.range_ok, found.at_height)
    needed = {*state, *(signal.split(".")[0] for signal in pad if signal)}
    return {
        name: Said(
            id=frames.id(name),
            mask=found.masks.get(name, 0x1FFF_FFFF),
            length=frames.length(name),
            fresh_s=found.state_timeout_s if name in state else found.others_timeout_s,
            needed=name in needed,
        )
        for name in found.frames()
    }


def _heard(values: Values, signal: str) -> float:
    if signal not in values:
        raise DriverError(f"no frame with {signal} has come, but a rule of the map needs its value")
    return values[signal]


def _rounded(value: float | None) -> float | None:
    """Round to 3 decimals, to remove the floating-point error of scaling by 0.1."""
    return None if value is None else round(value, 3)


DRIVER = DriverType(
    settings=FrameChargerSettings,
    buses=("can",),
    create=create,
    describe=describe,
    tables=frame_tables,
    claims=claims,
    warnings=warnings,
    fake="hal_fakes.can.frame_charger",
)

"""A simulated charger that sends and expects its maker's own CAN frames. It uses the frame map of the
driver, and has a plant behind it.

The charger charges while every frame of its map comes on time with the values of `on`. It stops when a
frame has the values of `off`, or is missing for three periods. A busy machine may delay this fake as
well as the daemon. Therefore a long time between two checks of the frames counts only as STATUS_S. If
the map has wake frames, the charger sleeps until a wake frame comes, and sleeps again after it was off.

The part `node` can fail, and the parts of the plant and of the bus can fail as well. In the mode `off`
the charger is silent. In the mode `stuck` it repeats the last status. In the mode `slow` it sends a
status every two seconds. In the mode `garbage` it sends frames of six bytes. In the mode `wrong` it
sends a state that the map does not list.
"""

import time
from collections.abc import Mapping
from typing import Final

import can

from bridges.kinds.charger.signals import Activity, FaultSide
from drivers.charger import dbc
from drivers.charger.can_frames import FrameChargerSettings, frame_map
from drivers.charger.can_map import FrameMap, Sent, State
from drivers.charger.rules import UNKNOWN, StationErrors
from hal_fakes.can.side import Send
from hal_fakes.charger_values import NEAREST, values
from hal_fakes.fake import Fake
from hal_fakes.plants.charger import ChargerPlant, Reading
from hal_fakes.plants.plant import Plant

STATUS_S: Final = 0.1
SLOW_S: Final = 2.0
PERIODS: Final = 3
FLAGS: Final = {
    "authentication": "CommTimeout",
    "contact_lost": "CommTimeout",
    "over_temperature": "OverTemperature",
    "thermometer": "BatteryTemperature",
    "transmitter_fault": "GridError",
    "foreign_object": "StationOverTemperature",
    "too_far": "BadCoilPosition",
    "too_near": "BadCoilPosition",
}
"""The error signal for each fault of the plant. The maker publishes no signal for foreign objects."""
ROBOTS_FAULTS: Final = frozenset(FLAGS) - {"transmitter_fault", "foreign_object"}


class FrameCharger:
    """A charger as a station of a simulated CAN bus (`hal_fakes.can.side.CanStation`)."""

    def __init__(self, plant: Plant, settings: FrameChargerSettings) -> None:
        self.plant = plant
        self._map: FrameMap = frame_map(settings)
        self._dbc = dbc.load(self._map.dbc)
        self._setpoints: Mapping[str, float] = settings.setpoints
        self._wanted = {self._dbc.id(sent.frame): sent for sent in self._map.send}
        self._wakes = {
            self._dbc.id(w.frame): self._dbc.encode(w.frame, w.says) for w in self._map.wake
        }
        self._slept_through = dict(self._wakes)
        self._fed_at: dict[str, float] = {}
        self._looked_at = float("-inf")
        self._watched_s = 0.0
        self._status_at = float("-inf")
        self._status: list[can.Message] = []

    def hear(self, message: can.Message, now: float, send: Send) -> None:
        """Take a frame of the daemon. The frame may wake the charger, keep the charge going, or end the
        charge."""
        self._look(now)
        extended = dbc.EXTENDED if message.is_extended_id else 0
        heard = message.arbitration_id | extended
        if self.plant.failures.get("node") == "off":
            return
        if self._slept_through.get(heard) == bytes(message.data):
            del self._slept_through[heard]
        sent = self._wanted.get(heard)
        if sent is None or self._slept_through:
            return
        if self._says(sent, bytes(message.data), on=True):
            self._fed_at[sent.frame] = self._watched_s
        elif self._says(sent, bytes(message.data), on=False):
            self._fed_at.clear()
        self.plant.drive("power", self._fed(), now)

    def tick(self, now: float, send: Send) -> None:
        """Stop the charge if the daemon's frames are missing. Send the status if it is due."""
        self._look(now)
        mode = self.plant.failures.get("node")
        self.plant.drive("power", self._fed() and mode != "off", now)
        period_s = SLOW_S if mode == "slow" else STATUS_S
        if mode == "off":
            self._slept_through = dict(self._wakes)
        if mode == "off" or self._slept_through or now < self._status_at + period_s:
            return
        self._status_at = now
        if mode != "stuck" or not self._status:
            self._status = [self._message(name, mode == "wrong") for name in self._map.frames()]
        for message in self._status:
            send(_short(message) if mode == "garbage" else message)

    def _look(self, now: float) -> None:
        """Count the time for which this fake has watched the bus. The time since the last check counts,
        but at most STATUS_S of it."""
        self._watched_s += min(now - self._looked_at, STATUS_S)
        self._looked_at = now

    def _fed(self) -> bool:
        needed = (sent for sent in self._map.send if sent.on is not None)
        return all(
            self._watched_s - self._fed_at.get(sent.frame, float("-inf")) < PERIODS * sent.every_s
            for sent in needed
        )

    def _says(self, sent: Sent, payload: bytes, on: bool) -> bool:
        values = sent.values(on, self._setpoints)
        return values is not None and self._dbc.encode(sent.frame, values) == payload

    def _message(self, frame: str, wrong: bool) -> can.Message:
        self.plant.advance(time.monotonic())
        reading = self.plant.reading()
        assert isinstance(reading, Reading)
        values = dict.fromkeys(self._dbc.signals(frame), 0.0) | {
            signal.split(".")[1]: value
            for signal, value in self._values(reading, wrong).items()
            if signal.split(".")[0] == frame
        }
        found = self._dbc.id(frame)
        return can.Message(
            arbitration_id=found & ~dbc.EXTENDED,
            is_extended_id=bool(found & dbc.EXTENDED),
            data=self._dbc.encode(frame, values),
        )

    def _values(self, reading: Reading, wrong: bool) -> dict[str, float]:
        known = self._map
        shown = {FLAGS[fault] for fault in reading.faults}
        said: dict[str, float] = {}
        if known.state:
            state = self._unknown(known.state) if wrong else self._code(known.state, reading)
            said[known.state.at] = float(state)
        for signal, value in (
            (known.volts, reading.volts),
            (known.amps, reading.amps),
            (known.receiver, reading.number),
        ):
            if signal:
                said[signal] = round(value, 1)
        for signal in (*known.errors.station, *known.errors.robot):
            said[signal] = float(signal.split(".")[1] in shown)
        for signal in known.temperatures.values():
            said[signal] = round(reading.celsius)
        for flag, holds in (
            (known.range_ok, reading.range_ok),
            (known.at_height, reading.at_height),
        ):
            if flag:
                said[flag] = float(holds)
        if known.out_of_range:
            said[known.out_of_range] = float(reading.here and not reading.couples)
        return said | self._by_rules(reading, said, wrong)

    def _by_rules(
        self, reading: Reading, natural: Mapping[str, float], wrong: bool
    ) -> dict[str, float]:
        """Return a value for each signal that a rule, an error number or an error bit reads. Leave out
        the signals of the error flags."""
        known = self._map
        flags = (*known.errors.station, *known.errors.robot)
        numbers = StationErrors(codes=known.errors.codes, bits=known.errors.bits)
        in_error = reading.activity is Activity.ERROR
        side: FaultSide = "robot" if in_error and reading.faults & ROBOTS_FAULTS else ""
        wanted = UNKNOWN if wrong else (reading.activity, side)
        found = values(known.rules, numbers, wanted, natural)
        found = values(known.rules, numbers, UNKNOWN, natural) if found is None else found
        return {at: float(value) for at, value in (found or {}).items() if at not in flags}

    def _code(self, state: State, reading: Reading) -> int:
        """Return the first code of the plant's activity. If the map has no such code, return the first
        code of the nearest activity."""
        lists = state.codes.lists()
        codes = lists[reading.activity] or lists[NEAREST.get(reading.activity, Activity.ERROR)]
        return codes[0]

    def _unknown(self, state: State) -> int:
        known = state.codes.meanings()
        return next(code for code in range(15, -1, -1) if code not in known)


def _short(message: can.Message) -> can.Message:
    return can.Message(
        arbitration_id=message.arbitration_id,
        is_extended_id=message.is_extended_id,
        data=bytes(message.data)[:6],
    )


FAKE = Fake[FrameChargerSettings](
    plant=lambda name, settings, wires: ChargerPlant(
        name,
        settings.receivers,
        commanded=True,
        cleared=False,
        links=("node", "bus"),
    ),
    station=lambda plant, settings: FrameCharger(plant, settings),
)

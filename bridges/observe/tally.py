"""Counts of each device's rides, waits, door cycles and charges, and of its time in service.

The exporter's figures and the recorder's daily figures agree, because both count the same news. A wait
or ride does not count if its beginning was not heard, because its duration is unknown.
"""

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final

from bridges.observe.all_devices import AnyDevice, Key, ObservedGraph
from bridges.observe.charger import CHARGING, ObservedCharger
from bridges.observe.door import OPEN, ObservedDoor
from bridges.observe.lift import ObservedLift
from bridges.observe.limits import SLOWEST_S
from bridges.observe.news import News

BOUNDS_S: Final = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0)
"""The upper bounds of the histograms' buckets (s)."""
NO_SERVICE: Final = frozenset(
    {"OFFLINE", "UNKNOWN", "EMERGENCY", "FIRE", "offline", "unknown", "error"}
)
"""The lift modes, door modes and charger states in which a device does not serve RMF's robots."""


@dataclass(slots=True)
class DurationHistogram:
    """Counts of durations by bucket. Each of BOUNDS_S has a bucket, and the last bucket has longer
    durations."""

    counts: list[int] = field(default_factory=lambda: [0] * (len(BOUNDS_S) + 1))
    sum_s: float = 0.0

    def add(self, duration_s: float) -> None:
        """Count a duration (s)."""
        self.counts[bisect_left(BOUNDS_S, duration_s)] += 1
        self.sum_s += duration_s

    def merge(self, other: "DurationHistogram") -> None:
        """Add the durations of another histogram."""
        self.counts = [sum(pair) for pair in zip(self.counts, other.counts, strict=True)]
        self.sum_s += other.sum_s

    @property
    def total(self) -> int:
        """The number of durations."""
        return sum(self.counts)

    def quantile(self, share: float) -> float | None:
        """Return the upper bound (s) of the bucket in which this share of the durations is reached. The
        bound of the last bucket is infinite. Return None without durations."""
        rest = share * self.total
        for bound, count in zip((*BOUNDS_S, float("inf")), self.counts, strict=True):
            rest -= count
            if count and rest <= 0:
                return bound
        return None


@dataclass(slots=True)
class DeviceCounts:
    """The counts of one device.

    - `waits`: the times from a robot's first request until RMF lets the robot board, pass or charge
    - `rides`: the times from a request for the next floor until the robot may leave the lift
    - `cycles`: a door's openings, a charger's charges, or a lift's stops with an open door
    - `energy_j`: the energy (J) of a charger that reports volts and amps
    - `watched_s`: the time (s) in which the device published states
    - `served_s`: the time (s) in which the device was in service
    """

    waits: DurationHistogram = field(default_factory=DurationHistogram)
    rides: DurationHistogram = field(default_factory=DurationHistogram)
    cycles: int = 0
    energy_j: float = 0.0
    watched_s: float = 0.0
    served_s: float = 0.0

    def add(self, other: "DeviceCounts") -> None:
        """Add the counts of another period."""
        self.waits.merge(other.waits)
        self.rides.merge(other.rides)
        self.cycles += other.cycles
        self.energy_j += other.energy_j
        self.watched_s += other.watched_s
        self.served_s += other.served_s


class DeviceTally:
    """The counter of one device. `counts`: the counts since the last call of `SiteTally.take_out`, or
    since the start."""

    def __init__(self) -> None:
        self.counts = DeviceCounts()
        self._at: float | None = None
        self._counted: dict[str, float] = {}

    def take(self, device: AnyDevice, news: Iterable[News], at: float) -> None:
        """Count the news of one message. `at`: the message's time (s)."""
        for one in news:
            if one.what == "met":
                self._met(device, one)
            elif one.what == "over":
                self._counted.pop(one.who, None)
            elif one.what == "changed" and _cycled(device):
                self.counts.cycles += 1
        if device.last_state is not None and device.last_state.at == at and self._at != at:
            self._pass_time(device, at)
        self._charged(device)

    def _met(self, device: AnyDevice, one: News) -> None:
        asked = one.requester
        if asked is None or self._counted.get(asked.who) == asked.since.at:
            return
        self._counted[asked.who] = asked.since.at
        if not asked.since.seen:
            return
        boards = not isinstance(device, ObservedLift) or asked.boarded is one.at
        counts = self.counts
        (counts.waits if boards else counts.rides).add(one.at.at - asked.since.at)

    def _pass_time(self, device: AnyDevice, at: float) -> None:
        if self._at is not None and at - self._at <= SLOWEST_S:
            counts, passed_s = self.counts, at - self._at
            counts.watched_s += passed_s
            counts.served_s += passed_s * in_service(device)
            counts.energy_j += passed_s * _watts(device)
        self._at = at

    def _charged(self, device: AnyDevice) -> None:
        """Count the wait of a charger's request. The charge itself ends this wait, because RMF has no
        phase for it."""
        if not isinstance(device, ObservedCharger) or device.condition.value != CHARGING:
            return
        asked = device.requesters.get(device.request.value)
        if asked is not None and self._counted.get(asked.who) != asked.since.at:
            self._counted = {asked.who: asked.since.at}
            if asked.since.seen:
                self.counts.waits.add(device.condition.since.at - asked.since.at)


class SiteTally:
    """The counts of every device that the `ObservedGraph` knows."""

    def __init__(self) -> None:
        self.devices: dict[Key, DeviceTally] = {}

    def take(
        self, graph: ObservedGraph[Any], found: Iterable[tuple[AnyDevice, list[News]]]
    ) -> None:
        """Count the news of one message, which `ObservedGraph.hear` has returned."""
        for device, news in found:
            key = device.kind, device.id
            if key not in self.devices:
                self.devices = {
                    one: self.devices[one] for one in self.devices if one in graph.known
                }
            self.devices.setdefault(key, DeviceTally()).take(device, news, graph.now.at)

    def take_out(self) -> dict[Key, DeviceCounts]:
        """Return the counts since the last call, and set them to zero."""
        found = {key: one.counts for key, one in self.devices.items()}
        for one in self.devices.values():
            one.counts = DeviceCounts()
        return found


def in_service(device: AnyDevice) -> bool:
    """Return whether the device is in a mode in which it serves robots."""
    shown = device.condition if isinstance(device, ObservedCharger) else device.mode  # type: ignore[attr-defined]
    return shown.value not in NO_SERVICE


def _cycled(device: AnyDevice) -> bool:
    """Return whether a door has opened, a lift's door has opened, or a charge has begun."""
    match device:
        case ObservedDoor():
            return "mode" in device.changed and device.mode.value == OPEN
        case ObservedLift():
            return "door" in device.changed and device.door.value == OPEN
        case ObservedCharger():
            return "condition" in device.changed and device.condition.value == CHARGING
    return False


def _watts(device: AnyDevice) -> float:
    """Return the power (W) that the charger's daemon reports on /diagnostics. Return 0 without such a
    report."""
    if not isinstance(device, ObservedCharger) or device.condition.value != CHARGING:
        return 0.0
    for said in device.diagnoses.values():
        volts, amps = _number(said.value("volts")), _number(said.value("amps"))
        if volts and amps:
            return max(0.0, volts * amps)
    return 0.0


def _number(text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        return 0.0
    return found if abs(found) < 1e6 else 0.0

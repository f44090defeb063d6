"""Metric families about RMF's graph, made from the memory of its devices. All functions are pure,
because `now` is an argument.

Names and labels follow Prometheus' conventions: base units, `_total` for counters, and `_info` for
values that are text. Every label from the network is printable and at most LONGEST characters long.
`ObservedGraph` limits the number of devices, so invented names cannot create an unlimited number of
series.
"""

from collections.abc import Iterable, Iterator
from enum import IntEnum
from typing import Any, Final

from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
    Metric,
)

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.observe.all_devices import AnyDevice, ObservedGraph
from bridges.observe.charger import ObservedCharger
from bridges.observe.door import ObservedDoor
from bridges.observe.lift import NOBODY, ObservedLift
from bridges.observe.requesters import Moment
from bridges.observe.tally import BOUNDS_S, DeviceTally, DurationHistogram, SiteTally
from bridges.observe.workcell import ObservedWorkcell

PREFIX: Final = "rmf_bridge_"
DEVICE: Final = ("kind", "device")
LONGEST: Final = 128
"""Maximum length (characters) of a label from the network."""
MODES: Final[dict[str, type[IntEnum]]] = {
    "lift": d.LiftMode,
    "door": d.DoorModeValue,
    "charger": d.ChargerStateValue,
    "dispenser": d.WorkcellMode,
    "ingestor": d.WorkcellMode,
}


def label(text: str) -> str:
    """Return a name from the network as a printable label of at most LONGEST characters."""
    return words.printable(text[:LONGEST])[:LONGEST]


def of_graph(graph: ObservedGraph[Any], tally: SiteTally, now: Moment) -> Iterator[Metric]:
    """Yield the metric families about our nodes, and about all devices that have published a state."""
    devices = graph.stated()
    yield from _states(graph, devices, now)
    yield from _trouble(graph, devices, now)
    yield from _waits(devices, now)
    yield from _counts(devices, tally)
    yield from _nodes(graph, now)


def _states(
    graph: ObservedGraph[Any], devices: Iterable[AnyDevice], now: Moment
) -> Iterator[Metric]:
    up = _gauge("device_up", "1 while states of the device arrive, 0 while it is silent.", DEVICE)
    age = _gauge(
        "device_reading_age_seconds",
        "Age of the reading in the last state, by this machine's clock; absent before any reading.",
        DEVICE,
    )
    mode = _gauge(
        "device_mode",
        "1 for the last known mode (lift, door) or state (charger).",
        (*DEVICE, "mode"),
    )
    simulated = _gauge("device_simulated", "1 if the device's daemon moves no hardware.", DEVICE)
    for one in devices:
        names = _names(one)
        up.add_metric(names, not one.is_silent(now))
        if one.stamped_at > 0:
            age.add_metric(names, max(0.0, now.wall - one.stamped_at))
        shown = _mode(one)
        for known in MODES[one.kind]:
            mode.add_metric((*names, words.plain(MODES[one.kind], known)), known == shown)
        simulated.add_metric(names, graph.is_simulated(one))
    yield from (up, age, mode, simulated)


def _trouble(
    graph: ObservedGraph[Any], devices: Iterable[AnyDevice], now: Moment
) -> Iterator[Metric]:
    fault = _gauge(
        "device_fault",
        "1 while a daemon reports this fault of itself, or of a device, an alarm panel or a robot.",
        (*DEVICE, "code"),
    )
    for report in graph.nodes.values():
        names = tuple(map(label, report.subject))
        for code in report.faults if report.is_current(now.at) else ():
            fault.add_metric((*names, label(code)), 1)
    publishers = _gauge(
        "device_publishers",
        "Number of nodes that publish states of this device; 0 if unknown.",
        DEVICE,
    )
    refused = CounterMetricFamily(
        f"{PREFIX}device_refusals",
        "Requests that this node has refused, by reason.",
        labels=(*DEVICE, "node", "reason"),
    )
    for one in devices:
        names = _names(one)
        said = [report for report in one.diagnoses.values() if report.is_current(now.at)]
        for code in sorted({code for report in said for code in report.faults}):
            fault.add_metric((*names, label(code)), 1)
        publishers.add_metric(names, len(one.publishers(now)))
        for report in one.diagnoses.values():
            node, counts = label(report.name.partition(": ")[0]), dict[str, int]()
            for reason, (count, _) in report.refused.items():
                counts[label(reason)] = counts.get(label(reason), 0) + count
            for reason, count in counts.items():
                refused.add_metric((*names, node, reason), count)
    yield from (fault, publishers, refused)


def _waits(devices: Iterable[AnyDevice], now: Moment) -> Iterator[Metric]:
    waiting = _gauge(
        "device_waiting_seconds", "Longest present wait of a robot; 0 if nobody waits.", DEVICE
    )
    held = _gauge("device_held", "1 while a robot has the lift, door or charger.", DEVICE)
    still = _gauge(
        "lift_session_still_seconds",
        "Time for which nothing has changed at a lift that a robot has; absent if nobody has it.",
        ("device",),
    )
    for one in devices:
        names = _names(one)
        longest = max((now.at - wait.since.at for wait in one.waits(now)), default=0.0)
        waiting.add_metric(names, longest)
        held.add_metric(names, _held(one))
        if isinstance(one, ObservedLift) and _held(one):
            facts = (one.floor, one.door, one.motion, one.mode, one.session, one.destination)
            still.add_metric(names[1:], now.at - max(fact.since.at for fact in facts))
    yield from (waiting, held, still)


def _counts(devices: Iterable[AnyDevice], tally: SiteTally) -> Iterator[Metric]:
    waits = _histogram(
        "wait_seconds", "Time from a robot's request until RMF lets the robot go on.", DEVICE
    )
    rides = _histogram(
        "lift_ride_seconds",
        "Time from a robot's request in the car until the car is at the requested floor.",
        ("device",),
    )
    cycles = _counter(
        "device_cycles", "Number of door openings (lift, door) or charges (charger).", DEVICE
    )
    energy = _counter(
        "charger_energy_joules",
        "Energy given to robots, computed from the reported V and A.",
        ("device",),
    )
    watched = _counter("device_watched_seconds", "Time in which states arrived.", DEVICE)
    served = _counter(
        "device_in_service_seconds", "Time in which states arrived and robots were served.", DEVICE
    )
    for one in devices:
        names, counted = _names(one), tally.devices.get((one.kind, one.id), DeviceTally()).counts
        _add(waits, names, counted.waits)
        cycles.add_metric(names, counted.cycles)
        watched.add_metric(names, counted.watched_s)
        served.add_metric(names, counted.served_s)
        if isinstance(one, ObservedLift):
            _add(rides, names[1:], counted.rides)
        if counted.energy_j:
            energy.add_metric(names[1:], counted.energy_j)
    yield from (waits, rides, cycles, energy, watched, served)


def _nodes(graph: ObservedGraph[Any], now: Moment) -> Iterator[Metric]:
    info = InfoMetricFamily(f"{PREFIX}node", "Our daemons on the graph.", labels=("node",))
    up = _gauge("node_up", "1 while the daemon reports on /diagnostics.", ("node",))
    for name, report in graph.nodes.items():
        node = label(name.partition(": ")[0])
        if not name.endswith(": daemon"):
            continue
        facts = {key: label(report.value(key)) for key in ("version", "transport", "release")}
        info.add_metric((node,), {"kind": label(report.kind), **facts})
        up.add_metric((node,), report.is_current(now.at))
    left_out = _gauge(
        "devices_left_out",
        "1 if devices of this kind were left out, because too many were heard.",
        ("kind",),
    )
    for kind in words.KINDS:
        left_out.add_metric((kind,), kind in graph.crowded)
    yield from (info, up, left_out)


def _names(device: AnyDevice) -> tuple[str, str]:
    return device.kind, label(device.id)


def _mode(device: AnyDevice) -> int:
    """Return the number of the present mode or state from the device's RMF message."""
    state = device.state
    match state:
        case d.LiftState():
            return state.current_mode
        case d.DoorState():
            return state.current_mode.value
        case d.ChargerState():
            return state.state
        case d.DispenserState() | d.IngestorState():
            return state.mode
    return -1


def _held(device: AnyDevice) -> bool:
    match device:
        case ObservedLift():
            return device.session.value != NOBODY
        case ObservedDoor():
            return bool(device.holders)
        case ObservedCharger():
            return device.robot.value != NOBODY
        case ObservedWorkcell():
            return bool(device.queue.value)
    return False


def _gauge(name: str, text: str, labels: tuple[str, ...]) -> GaugeMetricFamily:
    return GaugeMetricFamily(PREFIX + name, text, labels=labels)


def _counter(name: str, text: str, labels: tuple[str, ...]) -> CounterMetricFamily:
    return CounterMetricFamily(PREFIX + name, text, labels=labels)


def _histogram(name: str, text: str, labels: tuple[str, ...]) -> HistogramMetricFamily:
    return HistogramMetricFamily(PREFIX + name, text, labels=labels)


def _add(family: HistogramMetricFamily, names: tuple[str, ...], counted: DurationHistogram) -> None:
    buckets, total = list[tuple[str, float]](), 0
    for bound, count in zip((*map(str, BOUNDS_S), "+Inf"), counted.counts, strict=True):
        total += count
        buckets.append((bound, total))
    family.add_metric(names, buckets, counted.sum_s)

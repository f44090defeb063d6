"""The soak test's site. Each of its daemons writes a ring, which is a file with its latest messages and
decisions. The replay tests use the recordings of one day."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import yaml

from bridges import __version__
from bridges.blackbox.entries import Head
from bridges.blackbox.ring import Ring
from bridges.kinds.shared.graph_kind import AnyGraphKind
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.runtime.clock import Clock
from bridges.runtime.ring_writer import RingWriter
from tests.site.building import Device
from tests.site.daemons import DeviceDaemon, GraphDaemon
from tests.site.day import Site
from tests.site.timeline import EPOCH, Timeline

BUSES: dict[str, Any] = {
    "gpio": {"type": "gpio"},
    "modbus": {"type": "modbus", "tcp": {"host": "127.0.0.1"}},
    "http": {"type": "http", "api_base": "http://127.0.0.1"},
}


def head(name: str, kind: str, content: dict[str, Any]) -> Head:
    """Return the head of a recording for a daemon with this YAML."""
    text = yaml.safe_dump({"kind": kind, **content}, sort_keys=False).encode()
    return Head(
        name, 1, __version__, kind, f"/etc/{name}.yaml", text, {}, True, {}, RecordingSettings()
    )


def of_device(device: Device) -> Head:
    """Return the head of a recording for a daemon that serves only this device."""
    bus = {0.0: "gpio", 0.05: "modbus", 0.5: "http"}[device.poll_s]
    devices = {device.name: msgspec.to_builtins(device.settings)}
    content = {
        "driver": device.driver_name,
        "buses": {"b": BUSES[bus]},
        device.kind.devices_key: devices,
    }
    return head(device.name, device.kind.name, content)


def of_graph(name: str, kind: AnyGraphKind, settings: Any) -> Head:
    """Return the head of a recording for a supervisor or coordinator."""
    return head(name, kind.name, {kind.devices_key: msgspec.to_builtins(settings)})


def keep(site: Site, folder: Path, size: int) -> dict[str, Path]:
    """Let each daemon of a site write a ring of this size. Return the path of each ring by the daemon's
    name."""
    found = {}
    for daemon in (*site.daemons.values(), *site.nodes):
        if isinstance(daemon, DeviceDaemon):
            told = of_device(daemon.device)
        elif isinstance(daemon, GraphDaemon):
            told = of_graph(daemon.name, daemon.kind, daemon._settings)
        else:
            continue
        place = folder / daemon.name
        place.mkdir()
        make = partial(Ring, place, told, size)
        daemon.writer = writer(site.timeline, make, site)
        found[daemon.name] = place / "ring"
    return found


def writer(timeline: Timeline, make: Callable[[], Ring], site: Site) -> RingWriter:
    """Return a ring writer that runs in virtual time."""
    clock = Clock(lambda: timeline.now, lambda: EPOCH + timeline.now)
    return RingWriter(make, clock, lambda: site.air.release)

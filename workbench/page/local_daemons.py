"""The daemons on this machine that the page's user may see, and the YAML file of each device that they
serve.

The page reads the same files as `rmf-bridge status`. The page asks a simulation for the names of its
signals and parts.

A daemon on this machine may have a device with the same name on another graph, such as a simulation
for practice. So a daemon counts only if its node and process are those that report on the device. If
nobody reports on the device, the daemon's domain decides.
"""

import json
import socket
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from bridges.runtime.daemons import DaemonStatus, daemons
from bridges.runtime.diagnostics import CONTACTS
from bridges.runtime.fleet_alarm import ALARM
from bridges.system.directories import runtimes
from workbench.graph.plants import ask
from workbench.page.actions import Local
from workbench.page.cards import Key
from workbench.page.levels import Levels, Rows
from workbench.page.live_site import Running


@dataclass(frozen=True, slots=True)
class ServedDevice:
    """A device that a daemon on this machine serves, with its YAML, its present inputs and its outputs.

    `contacts` is known signal -> whether the signal is asserted. `device` is the device's name in the
    YAML.
    """

    by: Running
    domain_id: int | None
    local: Local
    device: str
    sensed: Rows
    driven: Rows
    contacts: Mapping[str, bool]


class LocalDaemons:
    """The daemons on this machine, as of the last call of `look`."""

    def __init__(
        self,
        base: Path | None,
        reporters: Callable[[str, str], Collection[Running]],
        domain_id: Callable[[], int | None],
    ) -> None:
        """Begin without daemons.

        - `base`: the folder of runtime directories. None means the folders that `run` and systemd use.
        - `reporters`: return the daemons that report on this device (kind, name) on the page's graph.
        - `domain_id`: return the page's domain, or None before the page has joined the graph.
        """
        self._served: Mapping[Key, list[ServedDevice]] = {}
        self._reporters = reporters
        self._domain_id = domain_id
        self._base = base
        self._levels: dict[Path, Levels] = {}

    def look(self) -> None:
        """Find the daemons that run now. Raises OSError."""
        base = self._base
        folders = sorted(p for p in base.iterdir() if p.is_dir()) if base else list(runtimes())
        found: dict[Key, list[ServedDevice]] = {}
        for folder in folders:
            for daemon in daemons([folder], {}, time.time()):
                if daemon.state != "serving":
                    continue
                levels = self._levels.setdefault(folder, Levels(folder))
                levels.look()
                for key, device in _devices(daemon, folder, levels):
                    found.setdefault(key, []).append(device)
        self._levels = {path: one for path, one in self._levels.items() if path in folders}
        self._served = found

    def serving(self, key: Key) -> ServedDevice | None:
        """Return the device that the page shows under this key, as its daemon on this machine serves
        it. Return None if no daemon here serves it, or if two daemons here may serve it."""
        reporters, domain = self._reporters(*key), self._domain_id()
        found = [
            one
            for one in self._served.get(key, ())
            if (one.by in reporters if reporters else one.domain_id == domain)
        ]
        return found[0] if len(found) == 1 else None


def _devices(
    daemon: DaemonStatus, folder: Path, levels: Levels
) -> Iterator[tuple[Key, ServedDevice]]:
    plant = _plant(folder) if daemon.status.get("simulated") else {}
    by = Running(str(daemon.status.get("node")), str(daemon.status.get("pid")))
    for name, status in daemon.devices.items():
        can = plant.get(name, {})
        local = Local(
            str(daemon.status.get("file", "")),
            tuple(daemon.devices),
            ALARM in daemon.status,
            tuple(can.get("press", ())),
            tuple(can.get("fail", ())),
            str(folder),
        )
        served = ServedDevice(
            by,
            daemon.status.get("domain_id"),
            local,
            name,
            levels.sensed.get(name, {}),
            levels.driven.get(name, {}),
            status.get(CONTACTS, {}),
        )
        kind, fleet = str(daemon.status.get("kind")), daemon.status.get("fleet")
        yield (("robot", f"{fleet}/{name}") if fleet else (kind, name)), served


def _plant(folder: Path) -> Mapping[str, Mapping[str, list[str]]]:
    with suppress(OSError, ValueError, socket.timeout):
        for path in sorted(folder.glob("plant*.sock")):
            found: Mapping[str, Mapping[str, list[str]]] = json.loads(ask(path, ["names"]))
            return found
    return {}

"""The daemons on this machine that the page's user may see, and the YAML file of each device that they
serve.

The page reads the same files as `rmf-bridge status`. The page asks a simulation for the names of its
signals and parts.
"""

import json
import socket
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from bridges.runtime.daemons import DaemonStatus, daemons
from bridges.runtime.diagnostics import CONTACTS
from bridges.system.directories import runtimes
from workbench.graph.plants import ask
from workbench.page.actions import Local
from workbench.page.levels import Levels, Rows


@dataclass(frozen=True, slots=True)
class ServedDevice:
    """A device that a daemon on this machine serves, with its YAML, its present inputs and its outputs.

    `contacts` is known signal -> whether the signal is asserted. `device` is the device's name in the
    YAML.
    """

    local: Local
    device: str
    sensed: Rows
    driven: Rows
    contacts: Mapping[str, bool]


class LocalDaemons:
    """The daemons on this machine, as of the last call of `look`. `served` is (kind, name) -> the
    device."""

    def __init__(self, base: Path | None) -> None:
        """Begin without daemons. `base` is the folder of runtime directories. None means the folders
        that `run` and systemd use."""
        self.served: Mapping[tuple[str, str], ServedDevice] = {}
        self._base = base
        self._levels: dict[Path, Levels] = {}

    def look(self) -> None:
        """Find the daemons that run now. Raises OSError."""
        base = self._base
        folders = sorted(p for p in base.iterdir() if p.is_dir()) if base else list(runtimes())
        found: dict[tuple[str, str], ServedDevice] = {}
        for daemon in daemons(folders, {}, time.time()):
            if daemon.state == "serving":
                folder = next(one for one in folders if one.name == daemon.name)
                levels = self._levels.setdefault(folder, Levels(folder))
                levels.look()
                found |= dict(_devices(daemon, folder, levels))
        self._levels = {path: one for path, one in self._levels.items() if path in folders}
        self.served = found


def _devices(
    daemon: DaemonStatus, folder: Path, levels: Levels
) -> Iterator[tuple[tuple[str, str], ServedDevice]]:
    plant = _plant(folder) if daemon.status.get("simulated") else {}
    for name, status in daemon.devices.items():
        can = plant.get(name, {})
        local = Local(
            str(daemon.status.get("file", "")),
            tuple(can.get("press", ())),
            tuple(can.get("fail", ())),
            str(folder),
        )
        served = ServedDevice(
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

"""Drivers, kinds and bus types that are added as new files only.

`check` and `run` must find the new files by their names, without changes in any other file.
"""

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.runtime.site import ROOT, command, daemon, environment
from tests.waiting import wait_until

ADDED = Path(__file__).parent / "added"
ROOMS = ("bridges", "drivers", "hal_fakes", "workbench")

LATCH = """
kind: door
driver: latch
rmf: {{transport: dds, network: localhost, domain_id: {domain}}}
buses: {{b: {bus}}}
doors:
  ward_door:
    feedback: estimated
    limits: {{open_delay_s: 2}}
    latch: {{point: unit 1 coil 0, active: high}}
    shut: {{point: unit 1 discrete input 0, active: high}}
"""
LINE = """
kind: door
driver: line
rmf: {{transport: dds, network: localhost, domain_id: {domain}}}
buses: {{b: {bus}}}
doors: {{ward_door: {{called: left wing}}}}
"""
HATCH = """
kind: hatch
driver: contact
rmf: {{transport: dds, network: localhost, domain_id: {domain}}}
buses: {{b: {bus}}}
hatches:
  ward_door:
    inputs:
      opened: {{point: unit 1 discrete input 0, active: high}}
      closed: {{point: unit 1 discrete input 1, active: high}}
    outputs: {{hold_open: {{point: unit 1 coil 0, active: high}}}}
"""
ON_MODBUS = {
    "type": "modbus",
    "tcp": {"host": "192.0.2.1", "port": 502},
    "timeout_s": 0.5,
    "without_watchdog": {1: "a bench"},
}
ON_A_LINE = {"type": "line", "host": "192.0.2.1"}


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the project's folders, to which the files in `added/` have been added."""
    made = tmp_path_factory.mktemp("house")
    for room in ROOMS:
        shutil.copytree(ROOT / room, made / room)
        if (ADDED / room).exists():
            shutil.copytree(ADDED / room, made / room, dirs_exist_ok=True)
    return made


class Site:
    """One YAML file in the copied folders. The methods run commands with the file."""

    def __init__(self, here: Path, domain: int, text: str, bus: dict[str, Any]) -> None:
        self.here, self._text = here, text
        self._domain = domain
        self._bus = bus
        self.file = here / "ward.yaml"
        self.point_at({})

    def point_at(self, replace: dict[str, Any]) -> None:
        """Write the YAML file. `replace` overrides settings of the bus, for example its address."""
        bus = json.dumps(self._bus | replace).replace(
            '"1":', "1:"
        )  # JSON cannot have numbers as keys
        self.file.write_text(self._text.format(domain=self._domain, bus=bus))

    def check(self) -> list[str]:
        """Return the door's rows in the output of `check`."""
        env = {**environment(), "COLUMNS": "200"}
        done = subprocess.run(command("check", self.file), env=env, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")
        rows = [" ".join(line.split()) for line in done.stdout.splitlines()]
        return [row for row in rows if row.startswith("ward_door ")]

    @contextmanager
    def far_side(self) -> Iterator[dict[str, Any]]:
        """Run the simulated device of the bus in its own process. Yield the bus settings that reach
        it."""
        socket = ["--socket", str(self.here / "plant.sock")]
        child = [sys.executable, "-m", "hal_fakes", str(self.file), "b", *socket]
        pipe = subprocess.PIPE
        with subprocess.Popen(child, env=environment(), stdin=pipe, stdout=pipe) as running:
            assert running.stdin
            assert running.stdout
            yield json.loads(running.stdout.readline())
            running.stdin.close()

    def served(self, *options: str) -> dict[str, Any]:
        """Run the daemon until its status shows the closed door. Stop the daemon cleanly, and return
        the last status file."""
        status = self.here / "run" / "status.json"
        with daemon(self.file, self.here / "run", *options) as running:
            running.wait_for("ready")
            wait_until(
                lambda: status.exists() and "CLOSED" in status.read_text(),
                "the status shows the door closed",
            )
            told: dict[str, Any] = json.loads(status.read_text())
            assert running.end(signal.SIGTERM) == 0
        return told


CHECKED = {
    "one file": [
        "ward_door closed unit 1 discrete input 0 (10001) in high - 0.05 s - not asserted",
        "ward_door hold_open unit 1 coil 0 (00001) out high - - low not asserted",
    ],
    "a kind": [
        "ward_door opened unit 1 discrete input 0 (10001) in high - 0.05 s - not asserted",
        "ward_door closed unit 1 discrete input 1 (10002) in high - 0.05 s - not asserted",
        "ward_door hold_open unit 1 coil 0 (00001) out high - - low not asserted",
        "ward_door closing not commanded: a released door stays open unless its door operator closes"
        " it by itself",
    ],
    "a bus type too": ["ward_door asks left wing at 192.0.2.1:4000"],
}
SITES: dict[str, tuple[str, dict[str, Any]]] = {
    "one file": (LATCH, ON_MODBUS),
    "a kind": (HATCH, ON_MODBUS),
    "a bus type too": (LINE, ON_A_LINE),
}


@pytest.fixture(params=SITES)
def sort(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def site(
    sort: str, house: Path, domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Site:
    monkeypatch.chdir(house)
    return Site(tmp_path, domain, *SITES[sort])


def test_an_added_file_is_checked(site: Site, sort: str) -> None:
    assert site.check() == CHECKED[sort]


def test_an_added_file_is_simulated(site: Site) -> None:
    told = site.served("--simulate")
    assert (told["simulated"], told["devices"]["ward_door"]["mode"]) == (True, "CLOSED")


def test_an_added_file_is_run(site: Site) -> None:
    with site.far_side() as replace:
        site.point_at(replace)
        told = site.served()
    assert (told["simulated"], told["devices"]["ward_door"]["mode"]) == (False, "CLOSED")

"""Two real daemons, one for a panel and one for a door. Each daemon has its own simulated module.

A subscriber stands in for a fleet adapter.
"""

import signal
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.messages.definitions import Bool
from bridges.messages.topics import FIRE_ALARM_TRIGGER
from hal_fakes.__main__ import served
from hal_fakes.caller import Caller
from hal_fakes.wire import join, wire
from tests.runtime.site import SERVICE, Daemon, command
from tests.waiting import wait_until

HEAD = """
rmf: {{transport: {wire}, network: localhost, domain_id: {domain}}}
buses:
  module: {{type: modbus, tcp: {{host: 127.0.0.1, port: {port}}}, timeout_s: 1.5}}
driver: dry_contact
"""
PANEL = """
kind: alarm
alarms:
  Panel:
    alarm: fire_alarm_trigger
    silent_alarm_after_s: 600
    limits: {{stale_after_s: 30}}
    sources:
      fire: {{point: "unit 1 discrete input 0", active: low}}
"""
DOOR = """
kind: door
doors:
  ward:
    alarm: fire_alarm_trigger
    on_fire: release
    feedback: estimated
    limits: {{stale_after_s: 30, open_delay_s: 1}}
    inputs:
      fire: {{point: "unit 1 discrete input 0", active: low}}
    outputs:
      hold_open: {{point: "unit 1 coil 0", active: high}}
"""


class Place:
    """A daemon's YAML file and its module. The module outlives the daemon."""

    def __init__(self, directory: Path, name: str, text: str, device: str, domain: int) -> None:
        self.file, self.device = directory / f"{name}.yaml", device
        self._directory, self._name = directory, name
        values = {"wire": wire(), "domain": domain}
        self.file.write_text((HEAD + text).format(port=502, **values))
        self.open = ExitStack()
        socket = directory / f"{name}.sock"
        there: Any = self.open.enter_context(served(self.file, "module", socket))
        self._caller = self.open.enter_context(Caller(socket))
        self.file.write_text((HEAD + text).format(port=there["tcp"]["port"], **values))
        self.daemon: Daemon

    def start(self) -> None:
        state = str(self._directory / "state")
        run = self._directory / f"run-{self._name}"
        self.daemon = Daemon(self.file, run, XDG_STATE_HOME=state, **SERVICE)
        self.open.callback(self.daemon.process.wait)
        self.open.callback(self.daemon.process.kill)

    def burns(self, on: bool) -> None:
        self._caller.order(f"press {self.device} fire {'on' if on else 'off'}")

    def state(self) -> str:
        """Return the alarm's state from the status file, or "" if the file is missing."""
        try:
            status = (self._directory / f"run-{self._name}" / "status.json").read_bytes()
            found = msgspec.json.decode(status, type=dict[str, Any])
        except (OSError, msgspec.DecodeError):
            return ""
        return str(found["alarm"]["state"])

    def until(self, state: str) -> None:
        wait_until(lambda: self.state() == state, f"{self._name} is {state}: {self.file}")

    def reset(self) -> None:
        """Run `rmf-bridge reset` again and again, until the alarm is reset. The daemon refuses each
        reset while the alarm's cause lasts."""

        def is_reset() -> bool:
            code, _, said = self.told("reset")
            assert (code, bool(said)) in ((0, False), (4, True)), (code, said)
            return code == 0

        wait_until(is_reset, f"{self._name} is reset")

    def told(self, name: str, *words: str) -> tuple[int, str, str]:
        """Run a command about the daemon. Return its exit code, its output and its errors."""
        run = self._directory / f"run-{self._name}"
        line = command(name, self.file, "--runtime-dir", run, *words)
        done = subprocess.run(line, capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr


@pytest.fixture
def places(tmp_path: Path, domain: int) -> Iterator[tuple[Place, Place]]:
    panel = Place(tmp_path, "panel", PANEL, "Panel", domain)
    door = Place(tmp_path, "door", DOOR, "ward", domain)
    try:
        yield panel, door
    finally:
        panel.open.close()
        door.open.close()


def heard_late(domain: int) -> list[bool]:
    """Start a late fleet adapter, and return the values that it hears until it hears an alarm."""
    found: list[Bool] = []
    late = join("late", domain)
    late.subscribe(FIRE_ALARM_TRIGGER, found.append)
    try:
        wait_until(lambda: found, "a late fleet adapter hears the alarm")
    finally:
        late.close()
    return [message.data for message in found]


def test_an_alarm_outlives_the_deaths_of_its_daemons_and_ends_with_the_last_reset(
    places: tuple[Place, Place], domain: int
) -> None:
    panel, door = places
    adapter = join("adapter", domain)
    heard: list[Bool] = []
    adapter.subscribe(FIRE_ALARM_TRIGGER, heard.append)
    for place in places:
        place.start()
        place.until("quiet")
        place.burns(True)
        place.until("alarm")
    panel.burns(False)
    panel.reset()
    panel.until("reset")
    for place in places:
        assert place.daemon.end(signal.SIGKILL) == -signal.SIGKILL
        place.burns(False)
    before = len(heard)
    for place in places:
        place.start()
    wait_until(lambda: len(heard) > before, "the door's alarm is published again")
    door.until("alarm")
    panel.until("reset")
    assert True in heard_late(domain)
    assert {message.data for message in heard} == {True}
    door.reset()
    for place in places:
        place.until("quiet")
    wait_until(lambda: heard[-1] == Bool(False), "the robots may drive")
    adapter.close()
    assert [place.daemon.end(signal.SIGTERM) for place in places] == [0, 0]


def test_a_drill_is_no_alarm_and_ends_though_its_daemon_is_killed(
    places: tuple[Place, Place], domain: int
) -> None:
    panel, door = places
    adapter = join("adapter", domain)
    heard: list[Bool] = []
    adapter.subscribe(FIRE_ALARM_TRIGGER, heard.append)
    panel.start()
    door.start()
    for place in places:
        place.until("quiet")

    def begins(place: Place, for_s: str) -> None:
        begun = "the drill has begun, and ends by itself in"

        def is_begun() -> bool:  # a daemon accepts no drill in the first seconds after its start
            code, out, said = place.told("drill", "--for", for_s)
            assert (code, said) == (0, "") or "no drill yet" in said, said
            return out.startswith(begun)

        wait_until(is_begun, "a drill")

    begins(panel, "600")
    wait_until(lambda: heard == [Bool(True)], "the robots stand")
    panel.until("drill")
    refused = door.told("drill", "--for", "9")
    assert refused == (4, "", "refused: alarm: no drill during an alarm: rmf_bridge_panel\n")
    assert panel.daemon.end(signal.SIGKILL) == -signal.SIGKILL
    panel.start()
    wait_until(lambda: heard[-1] == Bool(False), "the robots drive again")
    panel.until("quiet")
    begins(panel, "600")
    panel.burns(True)
    panel.until("alarm")
    code, out, said = panel.told("reset")
    assert (code, said) == (4, "refused: alarm: the alarm is not over: fire of Panel\n")
    assert "remains: Panel: ALARM_SOURCE_ACTIVE: fire" in out
    panel.burns(False)
    panel.reset()
    wait_until(lambda: heard[-1] == Bool(False), "the reset ends the alarm, and no drill is left")
    panel.until("quiet")
    begins(door, "1")
    wait_until(lambda: heard[-2:] == [Bool(True), Bool(False)], "a drill of one second ends")
    door.until("quiet")
    adapter.close()
    assert [place.daemon.end(signal.SIGTERM) for place in places] == [0, 0]

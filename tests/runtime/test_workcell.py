"""A dispenser's daemon as a process. SIGKILL ends the daemon in the middle of a delivery, and the PLC
continues."""

import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from bridges import cli
from bridges.messages import definitions as d
from bridges.messages import topics
from hal_fakes.__main__ import served
from hal_fakes.caller import Caller
from hal_fakes.wire import join, wire
from tests.runtime.site import SERVICE, daemon
from tests.waiting import wait_until
from workbench.rmf_model.workcells import WorkcellPhase

YAML = """
kind: dispenser
driver: register
rmf: {{transport: {transport}, network: localhost, domain_id: {domain}}}
buses:
  plc:
    type: modbus
    tcp: {{host: 127.0.0.1, port: {port}}}
    timeout_s: 1.5
    without_watchdog: {{1: a test}}
dispensers:
  store:
    unit: 1
    pulse_s: 1
    limits: {{stale_after_s: 30}}
    items: {{box: {{}}}}
    map:
      status: {{at: input register 0, ready: [1], busy: [2], done: [3], waits: [4]}}
      command: {{at: holding register 0, start: 1, rest: 0}}
"""


class Site:
    """The PLC of the dispenser, and the phase of RMF's task that uses the dispenser."""

    def __init__(self, directory: Path, domain: int, stack: ExitStack) -> None:
        self.directory = directory
        draft = directory / "draft.yaml"
        draft.write_text(YAML.format(transport=wire(), domain=domain, port=502))
        socket = directory / "plant.sock"
        there: Any = stack.enter_context(served(draft, "plc", socket))
        self.file = directory / "store.yaml"
        port = there["tcp"]["port"]
        self.file.write_text(YAML.format(transport=wire(), domain=domain, port=port))
        self.plc = stack.enter_context(Caller(socket))
        self.heard: list[d.Message] = []
        self.transport = join("rmf", domain)
        stack.callback(self.transport.close)
        for topic in (topics.DISPENSER_STATES, topics.DISPENSER_RESULTS):
            self.transport.subscribe(topic, self.heard.append)
        self._requests = self.transport.publisher(topics.DISPENSER_REQUESTS)
        self.phase = WorkcellPhase(_request("first"), 0.0)
        self._taken = 0
        self._now = 0.0

    def ask(self, guid: str) -> None:
        """Let RMF begin a phase, and forget all earlier messages."""
        self.heard.clear()
        self._taken = 0
        self.phase = WorkcellPhase(_request(guid), self._now)

    def look(self) -> None:
        """Let RMF read its messages and repeat its request."""
        for message in self.heard[self._taken :]:
            self._taken += 1
            self.phase.hear(message, self._now)
        self._now += 1.0
        for _, message in self.phase.tick(self._now):
            assert isinstance(message, d.DispenserRequest)
            self._requests.publish(message)

    def until(self, is_so: Callable[[], bool], what: str) -> None:
        """Let RMF read and repeat until the condition holds."""

        def looked() -> bool:
            self.look()
            return is_so()

        wait_until(looked, what)

    def outcome(self) -> str:
        """Return the outcome of RMF's phase, or "" before its end."""
        return self.phase.outcome

    def is_offline(self) -> bool:
        """Return whether the last state is OFFLINE."""
        states = [m for m in self.heard if isinstance(m, d.DispenserState)]
        return bool(states) and states[-1].mode == d.WorkcellMode.OFFLINE

    def mode(self, mode: d.WorkcellMode) -> bool:
        """Return whether any state has shown this mode."""
        return any(isinstance(m, d.DispenserState) and m.mode == mode for m in self.heard)

    def says(self, status: d.WorkcellStatus) -> bool:
        """Return whether any result has had this status."""
        return any(isinstance(m, d.DispenserResult) and m.status == status for m in self.heard)


def _request(guid: str) -> d.DispenserRequest:
    return d.DispenserRequest(d.Time(), guid, "store", "", (d.DispenserRequestItem("box", 1),))


@pytest.fixture
def site(domain: int, tmp_path: Path) -> Iterator[Site]:
    with ExitStack() as stack:
        yield Site(tmp_path, domain, stack)


def decided(site: Site, verdict: str, run: Path, *more: str) -> int:
    return cli.main(["workcell", verdict, str(site.file), "--runtime-dir", str(run), *more])


@pytest.mark.long(20)
def test_a_daemon_that_is_killed_in_mid_cycle_leaves_the_outcome_to_a_person(
    site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, env = tmp_path / "run", {**SERVICE, "STATE_DIRECTORY": str(tmp_path / "state")}
    with daemon(site.file, run, **env) as running:
        running.wait_for("MEMORY_LOST")
        wait_until(lambda: decided(site, "again", run) == 0, "the first start is confirmed")
        site.ask("first")
        site.until(lambda: site.says(d.WorkcellStatus.ACKNOWLEDGED), "it is acknowledged")
        site.until(lambda: site.outcome() == "completed", "RMF goes on")
        site.plc.order("fail store conveyor stuck")
        site.ask("second")
        site.until(lambda: site.mode(d.WorkcellMode.BUSY), "the machine works")
        running.process.send_signal(signal.SIGKILL)
        running.process.wait()
    site.heard.clear()
    with daemon(site.file, run, **env) as running:
        running.wait_for("OUTCOME_UNKNOWN")
        site.until(site.is_offline, "it is offline")
        for _ in range(5):
            site.look()
        assert site.outcome() == ""
        assert not site.says(d.WorkcellStatus.SUCCESS)

        def misspelt() -> bool:
            assert decided(site, "failed", run, "--device", "stor") == 1
            return "has no device 'stor'; it has store" in capsys.readouterr().err

        wait_until(misspelt, "a misspelt device is named")
        wait_until(lambda: decided(site, "failed", run) == 0, "a person decides")
        site.until(lambda: site.outcome() == "failed", "RMF hears the decision")
        wait_until(lambda: decided(site, "done", run) == 1, "nothing is in doubt any more")
        assert running.end(signal.SIGTERM) == 0
    assert "second (1 box): the daemon ended in the middle" in capsys.readouterr().out


def test_a_decision_needs_a_daemon(
    site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert decided(site, "done", tmp_path / "run") == 1
    assert cli.main(["workcell", "done", str(tmp_path / "absent.yaml")]) == 1
    assert "does not exist" in capsys.readouterr().err

"""A door behind a broker. The tests kill the door's real daemon, and kill and restart the broker."""

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from bridges.messages.definitions import DoorModeValue
from tests.runtime.site import SERVICE, Graph, Module, command, daemon, environment, hold_open
from tests.waiting import wait_until


class Shelly(Module):
    """A broker, a relay with two inputs, and the door behind the relay."""

    text = """
kind: door
driver: dry_contact
rmf: {{transport: {transport}, network: localhost, domain_id: {domain}}}
buses:
  module:
    type: mqtt
    host: 127.0.0.1
    port: {port}
    timeout_s: 1.5
    scan_s: 0.2
    points:
      hold: {{profile: shelly-gen2, device: ward, part: "switch:0", stale_after_s: 5,
        switches_off_after_s: 86400, answers_within_s: 20}}
      opened: {{profile: shelly-gen2, device: ward, part: "input:0", stale_after_s: 5}}
      closed: {{profile: shelly-gen2, device: ward, part: "input:1", stale_after_s: 5}}
doors:
  ward_door:
    limits: {{close_grace_s: 0, stale_after_s: 30}}
    inputs:
      opened: {{point: opened, active: high}}
      closed: {{point: closed, active: high}}
    outputs:
      hold_open: {{point: hold, active: high}}
"""


class ShortTimer(Shelly):
    """A relay that switches itself off 3 s after the last command."""

    text = Shelly.text.replace("86400", "3")


@pytest.fixture(params=[Shelly])
def module(request: pytest.FixtureRequest, domain: int, tmp_path: Path) -> Iterator[Module]:
    standing: Module = request.param(tmp_path, domain)
    yield standing
    standing.close()


def _off(module: Module) -> None:
    wait_until(lambda: module.relay()[-1] is False, "the relay is off")


def test_a_clean_end_switches_off(module: Module, graph: Graph, tmp_path: Path) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        assert running.end(signal.SIGTERM) == 0
    _off(module)
    assert module.relay() == [True, False]


def test_after_kill_9_outputs_off_switches_off_by_the_record(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        running.end(signal.SIGKILL)
    module.file.write_text("the YAML is gone: the record has everything\n")
    assert module.relay() == [True]
    done = subprocess.run(
        command("outputs-off", module.file, "--runtime-dir", tmp_path / "run"),
        env=environment(),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    _off(module)
    assert module.relay() == [True, False]


def test_after_kill_9_the_guard_of_a_daemon_started_by_hand_switches_off(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run") as running:
        hold_open(module, graph, running)
        running.end(signal.SIGKILL)
        _off(module)


@pytest.mark.parametrize("module", [ShortTimer], indirect=True)
def test_a_broker_that_goes_lets_the_timer_release_the_door_and_its_return_holds_it_again(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    with daemon(module.file, tmp_path / "run", **SERVICE) as running:
        hold_open(module, graph, running)
        module.tell("fail", "ward_door", "server", "off")
        _off(module)
        running.wait_for("refuses the connection: is the broker running there?")
        module.tell("fail", "ward_door", "server", "ok")

        def held_again() -> bool:
            graph.request(DoorModeValue.MODE_OPEN)
            return module.relay() == [True, False, True]

        wait_until(held_again, "the door is held again")
        assert running.end(signal.SIGTERM) == 0
    _off(module)

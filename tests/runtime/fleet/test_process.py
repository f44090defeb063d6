"""A fleet's daemon as a process. Robots patrol, fail and recover. A daemon that must not start says
why."""

import importlib.util
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from bridges.messages.definitions import FleetState
from bridges.messages.topics import FLEET_STATES
from hal_fakes.caller import Caller
from hal_fakes.wire import join, wire
from tests.runtime.site import Daemon, command, daemon, environment, shipped
from tests.waiting import wait_until

CONFIG = Path(__file__).parents[3] / "config"
NO_ROS = importlib.util.find_spec("rmf_adapter") is None


def site(name: str, directory: Path, **change: str) -> Path:
    """Copy a shipped fleet with RMF's files. `change` maps texts in the navigation graph to the texts
    that replace them."""
    file = shipped(name, directory, wire())
    file.write_text(
        file.read_text().replace("rmf:\n", "rmf:\n  release: kilted\n")
    )  # `join` uses the release kilted too
    shutil.copy(CONFIG / "fleet_tiny.yaml", directory)
    graph = (CONFIG / "fleet_tiny_graph.yaml").read_text()
    for old, new in change.items():
        graph = graph.replace(old, new)
    (directory / "fleet_tiny_graph.yaml").write_text(graph)
    return file


@dataclass
class Fleet:
    """A running simulation. The test sees RMF's graph and the status file, and gives orders to the
    simulated robots."""

    running: Daemon
    runtime: Path
    states: list[FleetState] = field(default_factory=list)

    def robot(self, name: str = "AMR01") -> dict[str, Any]:
        status: dict[str, Any] = json.loads((self.runtime / "status.json").read_text())
        found: dict[str, Any] = status["devices"][name]
        return found

    def faults(self, name: str = "AMR01") -> list[str]:
        return [fault["code"] for fault in self.robot(name)["faults"]]

    def tells(self, order: str) -> None:
        with Caller(self.runtime / "plant.sock") as plants:
            plants.order(order)

    def until(self, condition: Callable[[], object], what: str) -> None:
        wait_until((self.runtime / "status.json").exists, "a status")
        wait_until(condition, what)


@pytest.fixture(params=["robots_http.yaml", "robots_vda5050.yaml"])
def fleet(request: pytest.FixtureRequest, domain: int, tmp_path: Path) -> Iterator[Fleet]:
    file = site(request.param, tmp_path)
    options = ("--simulate", "--domain-id", str(domain))
    with daemon(file, tmp_path / "run", *options) as running:
        made = Fleet(running, tmp_path / "run")
        transport = join("rmf", domain)
        transport.subscribe(FLEET_STATES, made.states.append)
        running.wait_for("ready")
        yield made
        transport.close()


@pytest.mark.skipif(not NO_ROS, reason="with RMF's own adapter robots move only for RMF's tasks")
@pytest.mark.long(12)
def test_robots_patrol_and_a_robot_with_a_fault_is_taken_out_until_it_is_over(
    fleet: Fleet,
) -> None:
    assert "STAND-IN: rmf_adapter is not installed" in fleet.running.log.read_text()
    fleet.running.wait_for('device=AMR01 at="L1 wait_1" doing="navigate')
    wait_until(
        lambda: fleet.states and len(fleet.states[-1].robots) == 3, "RMF's graph hears the fleet"
    )
    fleet.running.wait_for('device=AMR01 at="L1 between waypoints" doing="navigate')
    if "vda5050" in fleet.running.log.read_text():  # robots_http reports no faults
        fleet.tells("press AMR01 fault on")
        fleet.until(lambda: fleet.faults() == ["ROBOT_FAULT"], "the fault is told")
        assert fleet.robot()["new_tasks"] == "no"
        fleet.tells("press AMR01 fault off")
        fleet.until(lambda: fleet.robot()["new_tasks"] == "yes", "the robot is back")
    fleet.tells("fail AMR02 localiser wrong")
    fleet.until(lambda: "ROBOT_ON_OTHER_MAP" in fleet.faults("AMR02"), "the map is told")
    fleet.tells("fail AMR02 server off")
    fleet.until(lambda: "ROBOT_SILENT" in fleet.faults("AMR03"), "all robots are silent")
    fleet.tells("fail AMR02 server ok")
    fleet.tells("fail AMR02 localiser ok")
    fleet.until(lambda: fleet.robot("AMR02")["new_tasks"] == "yes", "the manager is back")
    assert fleet.running.end(15) == 0


@pytest.mark.skipif(not NO_ROS, reason="with RMF's own adapter RMF decides who pauses")
@pytest.mark.long(20)
def test_robots_go_on_only_at_rmfs_light_and_one_that_does_not_pause_is_said(
    domain: int, tmp_path: Path
) -> None:
    file = site("robots_traffic_light.yaml", tmp_path)
    options = ("--simulate", "--domain-id", str(domain))
    with daemon(file, tmp_path / "run", *options) as running:
        fleet = Fleet(running, tmp_path / "run")
        transport = join("rmf", domain)
        transport.subscribe(FLEET_STATES, fleet.states.append)
        running.wait_for("doing pause")
        modes = {"MODE_PAUSED": 3, "MODE_MOVING": 2}
        for mode in modes.values():
            wait_until(
                lambda: any(r.mode.mode == mode for s in fleet.states for r in s.robots),  # noqa: B023
                "RMF's graph hears a paused robot, and then a moving one",
            )
        assert fleet.states[-1].name == "tiny"
        running.wait_for("doing resume")
        for name in ("AMR01", "AMR02", "AMR03"):
            fleet.tells(f"fail {name} pause stuck")
        running.wait_for("code=ROBOT_NOT_STOPPING")
        transport.close()
        assert running.end(15) == 0


def told(file: Path, *options: str) -> tuple[int, str]:
    run = command("run", file, *options, "--runtime-dir", file.parent / "run")
    done = subprocess.run(run, env=environment(), capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.splitlines()[-1]


@pytest.mark.skipif(not NO_ROS, reason="RMF's own adapter is installed")
def test_without_rmfs_adapter_the_package_is_named(domain: int, tmp_path: Path) -> None:
    file = site("robots_http.yaml", tmp_path)
    code, said = told(file, "--domain-id", str(domain))
    assert (code, "ros-jazzy-rmf-fleet-adapter-python" in said) == (os.EX_UNAVAILABLE, True)


def test_a_file_may_be_named_from_its_own_folder(
    domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site("robots_http.yaml", tmp_path)
    monkeypatch.chdir(tmp_path)
    options = ("--domain-id", str(domain))
    if NO_ROS:
        code, said = told(Path("robots_http.yaml"), *options)
        assert (code, "rmf-fleet-adapter" in said) == (os.EX_UNAVAILABLE, True)
    with daemon(Path("robots_http.yaml"), tmp_path / "sim", "--simulate", *options) as running:
        running.wait_for("ready")


@pytest.mark.parametrize("name", ["robots_http.yaml", "robots_vda5050.yaml"])
def test_after_a_death_nothing_is_to_be_switched_off_of_robots_that_finish(
    tmp_path: Path, name: str
) -> None:
    file = site(name, tmp_path)
    off = command("outputs-off", file, "--runtime-dir", tmp_path / "run")
    assert subprocess.run(off, env=environment(), capture_output=True).returncode == 0


def test_a_graph_of_which_rmf_would_die_is_refused_before(domain: int, tmp_path: Path) -> None:
    file = site("robots_http.yaml", tmp_path, **{"name: wait_3": "name: wait_33"})
    code, said = told(file, "--simulate", "--domain-id", str(domain))
    assert code == os.EX_CONFIG
    assert "fleet_tiny.yaml:29:13: the graph has no waypoint 'wait_3'" in said

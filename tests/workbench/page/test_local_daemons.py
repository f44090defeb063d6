"""The daemon on this machine that serves a device of the page. A daemon on another graph may have a
device of the same name."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from bridges.messages import topics
from bridges.messages.stamps import stamp
from bridges.runtime.diagnostics import diagnosis
from tests.commands import runtime
from tests.workbench.page.test_live_site import WALL, heard, lift
from workbench.page import local_daemons
from workbench.page.live_site import LiveSite
from workbench.page.local_daemons import LocalDaemons

LIFT1 = ("lift", "Lift1")


class Machine:
    """A machine with a page on domain 0, and daemons that serve Lift1."""

    def __init__(self, base: Path, running: ExitStack) -> None:
        self.site = LiveSite()
        self.site.take(lift(0.0))
        self._base, self._running = base, running
        self.here = LocalDaemons(base, self.site.reporters, lambda: 0)

    def runs(self, name: str, pid: int, domain_id: int = 0, **more: object) -> None:
        """Start a daemon on this machine. `name` is the name of its node and of its directory."""
        told = {"kind": "lift", "file": f"/etc/{name}.yaml", "node": name, "pid": pid} | more
        told = {"domain_id": domain_id, "devices": {"Lift1": {}}} | told
        self._running.enter_context(runtime.served(self._base / name, told))

    def reports(self, node: str, pid: int, kind: str = "lift") -> None:
        """Let a daemon on any machine report on Lift1, on the page's graph."""
        devices = {"Lift1": {"faults": [], "input_age_s": 0.1}}
        told = diagnosis(node, kind, {"pid": pid}, devices, stamp(WALL))
        self.site.take(heard(0.1, topics.DIAGNOSTICS, told))

    def file(self, key: tuple[str, str] = LIFT1) -> str:
        """Return the YAML that the page's buttons for this device would name."""
        self.here.look()
        served = self.here.serving(key)
        return served.local.file if served else ""


@pytest.fixture
def machine(tmp_path: Path) -> Iterator[Machine]:
    with ExitStack() as running:
        yield Machine(tmp_path, running)


def test_a_daemon_that_reports_on_the_device_serves_it(machine: Machine) -> None:
    machine.runs("lift_a", pid=7)
    machine.reports("lift_a", pid=7)
    assert machine.file() == "/etc/lift_a.yaml"


def test_a_daemon_for_practice_does_not_serve_the_lift_of_another_machine(machine: Machine) -> None:
    machine.runs("practice", pid=7, domain_id=42)
    machine.runs("on_loopback", pid=8)
    machine.reports("lift_a", pid=7)
    machine.reports("supervisor", pid=8, kind="lift_supervisor")
    assert machine.file() == ""


def test_of_two_daemons_with_one_name_the_one_that_reports_serves_the_device(
    machine: Machine,
) -> None:
    machine.runs("lift_a", pid=7)
    machine.runs("practice", pid=8)
    machine.reports("lift_a", pid=7)
    assert machine.file() == "/etc/lift_a.yaml"
    machine.reports("practice", pid=8)
    assert machine.file() == ""


def test_a_reset_tells_of_every_device_of_the_file_and_of_its_alarm(machine: Machine) -> None:
    machine.runs(
        "lift_a", pid=7, devices={"Lift1": {}, "Lift2": {}}, alarm={"alarm state": "clear"}
    )
    machine.here.look()
    served = machine.here.serving(LIFT1)
    assert served is not None
    assert (served.local.devices, served.local.alarms) == (("Lift1", "Lift2"), True)


def test_of_two_directories_with_one_name_the_daemons_own_is_named(
    machine: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = [tmp_path / by / "lift_a" for by in ("service", "hand")]
    monkeypatch.setattr(local_daemons, "runtimes", lambda: folders)
    for pid, folder in enumerate(folders):
        folder.parent.mkdir()
        machine.runs(f"{folder.parent.name}/lift_a", pid=pid)
    machine.reports("hand/lift_a", pid=1)
    here = LocalDaemons(None, machine.site.reporters, lambda: 0)
    here.look()
    served = here.serving(LIFT1)
    assert served is not None
    assert served.local.runtime == str(folders[1])


def test_without_reports_a_daemon_serves_the_device_only_in_the_pages_domain(
    machine: Machine,
) -> None:
    machine.runs("practice", pid=7, domain_id=42)
    assert machine.file() == ""
    machine.runs("lift_a", pid=8)
    assert machine.file() == "/etc/lift_a.yaml"
    machine.runs("lift_b", pid=9)
    assert machine.file() == ""


def test_a_robot_is_served_by_the_daemon_of_its_fleet_that_reports_on_it(machine: Machine) -> None:
    devices = {"R1": {"faults": [], "input_age_s": 0.1}}
    robot = ("robot", "tiny/R1")
    machine.runs("fleet_a", pid=7, kind="fleet", fleet="tiny", devices=devices)
    daemon = {"pid": 9, "fleet": "tiny"}
    told = diagnosis("fleet_a", "fleet", daemon, devices, stamp(WALL))
    machine.site.take(heard(0.1, topics.DIAGNOSTICS, told))
    assert machine.file(robot) == ""
    told = diagnosis("fleet_a", "fleet", daemon | {"pid": 7}, devices, stamp(WALL))
    machine.site.take(heard(0.2, topics.DIAGNOSTICS, told))
    assert machine.file(robot) == "/etc/fleet_a.yaml"

"""A lift and its supervisor as two daemons on DDS. An operator types commands."""

import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.runtime.site import Daemon, command, daemon, environment

CONFIG = Path(__file__).parents[2] / "config"


@dataclass
class Building:
    """The daemons of a lift and its supervisor, in one DDS domain."""

    domain: int
    supervisor: Daemon
    lift: Daemon

    def operator(self, *arguments: str) -> "subprocess.CompletedProcess[str]":
        """Run one command that an operator types."""
        graph = ("--localhost", "--domain-id", str(self.domain), "--timeout", "30")
        return subprocess.run(
            command(*arguments, *graph), env=environment(), capture_output=True, text=True
        )


@pytest.fixture
def building(domain: int, tmp_path: Path) -> Iterator[Building]:
    options = ("--simulate", "--domain-id", str(domain))
    supervisor = daemon(CONFIG / "lift_supervisor.yaml", tmp_path / "supervisor", *options)
    lift = daemon(CONFIG / "lift_dry_contact.yaml", tmp_path / "lift", *options)
    with supervisor as serving, lift as moving:
        serving.wait_for("active kind=lift_supervisor")
        moving.wait_for("ready")
        yield Building(domain, serving, moving)


def test_a_lift_is_asked_for_through_the_supervisor_and_released_by_an_operator(
    building: Building,
) -> None:
    asked = building.operator(
        "send", "lift", "Lift1", "L1", "--session", "fleet/a", "--granted-only"
    )
    assert asked.returncode == 0, asked.stdout + asked.stderr
    building.supervisor.wait_for('holder="fleet/a')
    released = building.operator("release", "Lift1")
    assert released.returncode == 0, released.stdout + released.stderr
    building.lift.wait_for("outputs device=Lift1 outputs=-")


def test_of_two_supervisors_only_one_speaks(building: Building, tmp_path: Path) -> None:
    file = CONFIG / "lift_supervisor.yaml"
    options = ("--simulate", "--domain-id", str(building.domain))
    with daemon(file, tmp_path / "second", *options) as second:
        second.wait_for("passive kind=lift_supervisor")
        asked = building.operator("send", "lift", "Lift1", "L1", "--session", "b", "--granted-only")
        assert asked.returncode == 0, asked.stdout + asked.stderr
        assert "active" not in second.log.read_text()

"""Robots compete for one lift and one door on DDS. The test kills each daemon once, and one adapter."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from hal_fakes.wire import runs_here
from tests.site.on_dds import RealSite


@pytest.fixture
def site(
    domain: int, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Iterator[RealSite]:
    # The name is short, because a socket's path has at most 107 characters.
    directory: Path = tmp_path_factory.mktemp("s")
    monkeypatch.setenv("XDG_STATE_HOME", str(directory))
    monkeypatch.setenv("TRANSPORT", runs_here())
    site = RealSite(directory, domain, ("red", "green", "blue"))
    yield site
    site.close()


@pytest.mark.long(70)
def test_three_robots_share_a_lift_and_a_door_while_each_party_is_killed_once(
    site: RealSite,
) -> None:
    for robot in site.robots:
        robot.start()
    _wait_for_a_ride_and_two_passages(site)
    for party, how in (("lift supervisor", signal.SIGTERM), ("door", signal.SIGKILL)):
        site.restart(party, how)
    site.restart_adapter(site.robots[0])
    _wait_for_a_ride_and_two_passages(site)
    for party, how in (("lift", signal.SIGKILL), ("door supervisor", signal.SIGKILL)):
        site.restart(party, how)
    _wait_for_a_ride_and_two_passages(site)
    for robot in site.robots:
        robot.homing = True
    site.until(lambda: all(robot.at_rest for robot in site.robots))
    site.until(lambda: site.sessions[-1] == "" and site.driven() == [])
    assert all(robot.done["rides"] > 0 for robot in site.robots)
    assert site.voices.matched() == 1


def _wait_for_a_ride_and_two_passages(site: RealSite) -> None:
    """Wait for one more ride in the lift and two more passages through the door."""
    rides, doors = site.done("rides"), site.done("doors")
    site.until(lambda: site.done("rides") > rides and site.done("doors") > doors + 1)

"""A fleet from a configuration file in the form that RMF's tutorial uses."""

from pathlib import Path

import pytest

from hal_fakes.demo.fleets import tutorial_fleet

TINY = Path("config/fleet_tiny.yaml")
GRAPH = {f"wait_{n}": ("L1", 4.0, 2.0 * n) for n in (1, 2, 3)}


def test_the_shipped_fleet_has_robots_with_places_and_a_finishing_request() -> None:
    fleet = tutorial_fleet(TINY, GRAPH, 1.0)
    assert (fleet.name, fleet.finishing) == ("tiny", "charge")
    assert {name: robot.dedicated for name, robot in fleet.robots.items()} == {
        "AMR01": "wait_1",
        "AMR02": "wait_2",
        "AMR03": "wait_3",
    }


def test_a_part_of_the_fleet_needs_only_its_part_of_the_graph() -> None:
    fleet = tutorial_fleet(TINY, {"wait_1": GRAPH["wait_1"]}, 1.0, only=("AMR01",))
    assert list(fleet.robots) == ["AMR01"]


def test_a_waypoint_that_the_graph_lacks_is_refused() -> None:
    with pytest.raises(ValueError, match="'AMR02' has its charger at 'wait_2', not in the graph"):
        tutorial_fleet(TINY, {"wait_1": GRAPH["wait_1"]}, 1.0)


def test_a_finishing_request_that_rmf_does_not_know_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text("rmf_fleet: {name: tiny, finishing_request: dance}\n")
    with pytest.raises(ValueError, match="no finishing_request 'dance'"):
        tutorial_fleet(file, GRAPH, 1.0)

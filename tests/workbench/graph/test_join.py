"""How a command names the graph that it has joined."""

import argparse

import pytest

from workbench.graph.join import graph_of

ALONE = ", on this machine alone"


@pytest.mark.parametrize(
    ("speaks", "peers", "told"),
    [
        ("dds", "10.0.0.7", "dds in domain 3"),
        ("ros2", "10.0.0.7", "ros2 in domain 3"),
        ("dds", "", f"dds in domain 3{ALONE}"),
        ("zenoh", "10.0.0.7", f"zenoh in domain 3{ALONE}"),
    ],
)
def test_a_node_that_may_reach_static_peers_is_not_on_this_machine_alone(
    monkeypatch: pytest.MonkeyPatch, speaks: str, peers: str, told: str
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_STATIC_PEERS", peers)
    args = argparse.Namespace(config=None, domain_id=3, transport=speaks, localhost=False)
    assert graph_of(args, speaks) == told

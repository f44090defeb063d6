"""How a command names the graph that it has joined."""

import argparse
from pathlib import Path

import pytest

from bridges.transports.transport import TransportError
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


def test_a_viewers_file_has_the_section_rmf_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("ROS_STATIC_PEERS", raising=False)
    file = tmp_path / "viewer.yaml"
    args = argparse.Namespace(config=file, domain_id=None, transport=None, localhost=False)
    file.write_text("rmf: {transport: dds, domain_id: 7, network: localhost}\n")
    assert graph_of(args, "dds") == f"dds in domain 7{ALONE}"
    file.write_text("rmf: {transport: dss, topics: {lift_stats: a}}\n")
    with pytest.raises(TransportError, match=r"viewer\.yaml has errors"):
        graph_of(args, "dds")
    problems = capsys.readouterr().err.splitlines()
    assert [line.removeprefix(f"{file}:").split(" ")[0] for line in problems] == ["1:18:"]
    file.write_text("rmf: {transport: dds}\nkind: lift\n")
    with pytest.raises(TransportError):
        graph_of(args, "dds")
    assert "the file needs 'driver'" in capsys.readouterr().err

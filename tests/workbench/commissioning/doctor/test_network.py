"""What `doctor` says of the network, before it joins the graph."""

from types import SimpleNamespace
from typing import Any

import pytest

from bridges.kinds.shared.rmf_section import Rmf
from workbench.commissioning.doctor.network import GraphLook, graph


@pytest.mark.parametrize(("peers", "alone"), [("10.0.0.7", False), ("", True)])
def test_a_node_that_may_reach_static_peers_is_not_on_this_machine_alone(
    monkeypatch: pytest.MonkeyPatch, peers: str, alone: bool
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_STATIC_PEERS", peers)
    config: Any = SimpleNamespace(rmf=Rmf(transport="dds", domain_id=3))
    first = next(graph(config, GraphLook(localhost=False, listen_s=0.0, serving=None, watch="")))
    assert ("on this machine alone" in first.found) is alone

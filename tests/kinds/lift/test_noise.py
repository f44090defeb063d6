"""Messages that Jazzy's RMF repeats: after each start, when the lift goes from one robot to the next,
and each second while nobody uses the lift.

The node must not warn about these repeats.
"""

import logging

import pytest

from bridges.messages.definitions import LiftRequest
from tests.kinds.lift.rmf_world import World
from tests.kinds.lift.story import END, Controller, Story
from tests.kinds.lift.test_with_rmf import A, B, world
from workbench.rmf_model.robot import RobotContext
from workbench.rmf_model.supervisors import LiftSupervisor


def warnings(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.message for record in caplog.records if record.levelno >= logging.WARNING]


def test_a_start_with_a_waiting_robot_logs_no_warning(
    caplog: pytest.LogCaptureFixture,
) -> None:
    story = Story(Controller())
    story.asks(A, "L3")
    story.run(5.0)
    story.asks(A, "L3")
    story.run(6.0)
    assert warnings(caplog) == []
    assert story.node.refused == {"inputs settle after the start": 1}
    assert story.state.endswith("fleet/a to L3")


def test_a_handover_warns_only_of_the_early_request(
    caplog: pytest.LogCaptureFixture,
) -> None:
    a, b = RobotContext(A), RobotContext(B)
    rmf = world(a, b)
    rmf.asks(a, "L2")
    rmf.until_done(a)
    rmf.asks(b, "L1")
    rmf.run(rmf.story.now + 5.0)
    rmf.releases(a)
    rmf.until_done(b)
    assert warnings(caplog) == []
    assert set(rmf.story.node.refused) == {"released a moment ago"}


def test_an_end_without_a_session_id_is_ignored_without_a_log_line(
    caplog: pytest.LogCaptureFixture,
) -> None:
    a = RobotContext(A, jazzy=True)
    rmf = World(Story(Controller()), a)
    rmf.supervisor = LiftSupervisor(jazzy=True)
    rmf.run(10.0)
    assert LiftRequest("Lift1", rmf.requested[-1].request_time, "", END, "L1", 0) in rmf.requested
    rmf.rides(a, "L3", "L1")
    rmf.run(rmf.story.now + 10.0)
    assert (warnings(caplog), rmf.story.node.refused) == ([], {})


def test_an_end_without_a_session_id_ends_no_session() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks(A, "L2")
    story.ends("")
    story.run(12.0)
    assert story.state == "AGV, open at L2, fleet/a to L2"

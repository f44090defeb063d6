"""The publishers of a node, and messages that they cannot send."""

import pytest

from bridges.messages import definitions as d
from bridges.messages.topics import LIFT_STATES
from bridges.runtime.outlet import Outlet
from tests.transports.memory import MemoryNetwork, MemoryTransport


def test_a_message_that_cannot_be_encoded_is_a_fault_until_the_next_one_is_sent(
    caplog: pytest.LogCaptureFixture,
) -> None:
    outlet = Outlet(MemoryTransport(MemoryNetwork(), "lifts"), lambda topic: topic)
    impossible = d.LiftState(lift_name="Lift1", door_state=300)
    assert [outlet.publish(LIFT_STATES, impossible) for _ in range(2)] == [False, False]
    assert [fault.code for fault in outlet.faults] == ["NOT_PUBLISHED"]
    assert sum("not_published topic=lift_states" in text for text in caplog.messages) == 1
    assert outlet.publish(LIFT_STATES, d.LiftState(lift_name="Lift1"))
    assert outlet.faults == ()

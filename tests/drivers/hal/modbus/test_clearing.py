"""A controller on a slow line clears the calls that it has taken. tests/runtime/test_cleared_calls.py
rides such a lift."""

from drivers.hal.modbus.clearing import ClearedCalls
from drivers.hal.points import Clearing


def test_a_call_has_stayed_only_if_a_whole_scan_lies_between_its_write_and_a_later_request() -> (
    None
):
    now = 0.0
    calls = ClearedCalls(lambda: now, 0.1, {"call_L1": 0}, {"call_L1": Clearing()})
    now = 0.2  # the reply to the write
    calls.wrote("call_L1")
    now = 0.5  # a slow reply to a request that was sent long before
    assert calls.keeps("call_L1", 1, 1, asked_at=0.29)
    assert calls.may_read("call_L1", 1, 0)
    assert calls.keeps("call_L1", 1, 1, asked_at=0.31)
    assert not calls.may_read("call_L1", 1, 0)

"""Counts of scans and relays for monitoring."""

from bridges.kinds.charger.signals import ChargerOutputs
from bridges.kinds.lift.signals import LiftOutputs
from bridges.runtime.scan_counts import ScanCounts


def test_each_switching_on_is_counted_once_and_a_group_by_its_member() -> None:
    counts = ScanCounts()
    off, agv = LiftOutputs(), LiftOutputs(agv_request=True)
    calls = [LiftOutputs(agv_request=True, call=floor) for floor in ("L1", "L2", "L1")]
    for outputs in (off, agv, agv, *calls, off, agv):
        counts.scanned(0.001, outputs, failed=outputs is off)
    assert counts.status() == {
        "scans": 8,
        "failed_scans": 2,
        "scan_seconds": 0.008,
        "longest_scan_s": 0.001,
        "switched_on": {"agv_request": 2, "call L1": 2, "call L2": 1},
    }
    assert counts.status()["longest_scan_s"] == 0.0


def test_a_chargers_numbers_of_orders_are_no_relays() -> None:
    counts = ScanCounts()
    for number in range(5):
        counts.scanned(0.001, ChargerOutputs(power=True, range_checks=number), failed=False)
    assert counts.status()["switched_on"] == {"power": 1}

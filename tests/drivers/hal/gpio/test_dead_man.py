"""The dead-man switch, a thread beside the loop. The thread is real, and time is virtual."""

import pytest

from drivers.hal.gpio.dead_man import AFTER_S, GpioDeadMan
from drivers.hal.points import HalError
from tests.drivers.hal.gpio.test_bus import Bench
from tests.waiting import wait_until


@pytest.fixture
def bench() -> Bench:
    made = Bench()
    made.points.open()
    made.points.write({"call": True, "hold": True})
    return made


def test_outputs_drop_when_scans_stop_and_stay_dropped_until_an_operator_resets() -> None:
    now, drops = [0.0], []
    dead_man = GpioDeadMan(lambda: drops.append(now[0]), lambda: now[0])
    assert not dead_man.check()  # before the first scan the switch does not count time
    dead_man.fed()
    now[0] = AFTER_S
    assert not dead_man.check()
    now[0] = AFTER_S + 0.1
    wait_until(lambda: drops == [AFTER_S + 0.1], "the dead-man's thread drops the outputs once")
    now[0] = 100.0
    assert not dead_man.check()
    assert drops == [AFTER_S + 0.1]
    dead_man.close()


def test_a_look_after_the_last_scan_is_too_old_drops_the_outputs() -> None:
    now, drops = [0.0], []
    dead_man = GpioDeadMan(lambda: drops.append(now[0]), lambda: now[0])
    dead_man.fed()
    now[0] = AFTER_S + 0.1
    dead_man.check()  # the switch's thread may have checked earlier
    dead_man.close()
    assert drops == [AFTER_S + 0.1]


def test_the_relays_fall_and_neither_reads_nor_writes_work_until_a_reset(bench: Bench) -> None:
    bench.bus.scanned()
    bench.now += AFTER_S + 0.1
    fallen = [("call", False), ("hold", False)]
    wait_until(lambda: sorted(bench.relays()[-2:]) == fallen, "the dead-man drops the outputs")
    with pytest.raises(HalError, match="no scan finished for 2 s"):
        bench.points.read()
    with pytest.raises(HalError, match="no scan finished for 2 s"):
        bench.points.write({"call": False, "hold": True})
    edges = len(bench.relays())
    bench.points.make_safe()
    bench.points.open()  # an operator's reset opens the points too
    bench.points.read()
    bench.points.write({"call": True})
    assert bench.relays()[edges:] == [("call", True)]
    bench.points.close()
    bench.bus.close()


def test_a_loop_that_goes_on_is_left_alone(bench: Bench) -> None:
    for _ in range(50):
        bench.bus.scanned()
        bench.now += AFTER_S / 2
    bench.points.write({"call": True, "hold": True})
    assert sorted(bench.relays()) == [("call", True), ("hold", True)]
    bench.points.close()
    bench.bus.close()

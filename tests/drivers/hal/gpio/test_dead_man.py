"""The dead-man switch, a thread beside the loop. The thread is real, and time is virtual."""

from collections.abc import Callable
from typing import Any

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


class LatePin:
    """A pin that is switched only after another thread has done something: `meanwhile`, once."""

    def __init__(self, pin: Any, meanwhile: Callable[[], object]) -> None:
        self._pin, self._meanwhile = pin, [meanwhile]

    @property
    def state(self) -> int:
        return int(self._pin.state)

    @state.setter
    def state(self, level: int) -> None:
        while self._meanwhile:
            self._meanwhile.pop()()
        self._pin.state = level

    def __getattr__(self, name: str) -> Any:
        return getattr(self._pin, name)


def late(bench: Bench, output: str, meanwhile: Callable[[], object]) -> None:
    (lines,) = bench.bus._devices
    point = bench.points._out[output][1]
    lines._claimed[point] = LatePin(lines._claimed[point], meanwhile)


def test_no_relay_stays_on_that_is_switched_on_while_the_dead_man_drops_the_outputs() -> None:
    for outputs in (["call"], ["call", "hold"]):
        bench = Bench()
        bench.points.open()
        late(bench, "call", bench.bus._drop)
        with pytest.raises(HalError, match="no scan finished for 2 s"):
            bench.points.write(dict.fromkeys(outputs, True))
        assert dict(bench.relays())["call"] is False
        bench.points.close()
        bench.bus.close()


def test_the_dead_man_drops_every_output_although_the_loop_releases_the_pins(bench: Bench) -> None:
    (lines,) = bench.bus._devices
    late(bench, "call", lines._claimed.clear)
    lines.drop()
    assert dict(bench.relays()) == {"call": False, "hold": False}
    bench.bus.close()

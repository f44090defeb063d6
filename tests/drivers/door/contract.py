"""Duties of every driver of a door, on any bus. Each test has its own bench.

A test class implements `benches`, and derives from `DoorContract`. A class whose link can fail derives
from `WiredDoorContract`.
"""

from collections.abc import Iterable
from typing import TypedDict

import pytest

from bridges.kinds.door.signals import DoorOutputs, DoorSample
from drivers import DriverError
from drivers.hal.points import Wire
from hal_fakes.plants.door import DoorPlant
from hal_fakes.plants.plant import FailureMode
from tests.drivers import benches
from tests.drivers.benches import Contract
from tests.waiting import wait_until

HOLD, RELEASE = DoorOutputs(hold_open=True), DoorOutputs(hold_open=False)


class Pace(TypedDict):
    open_s: float
    close_s: float
    auto_close_s: float


QUICK: Pace = {"open_s": 0.05, "close_s": 0.05, "auto_close_s": 0.05}
"""The times of a simulated door (s). With such short times no test waits for the door."""


Ends = tuple[bool | None, bool | None]
"""(the driver reads open, the driver reads closed)"""


class Bench(benches.Bench[DoorSample, DoorOutputs]):
    """A bench with a door."""

    def relay(self) -> list[object]:
        """Return every edge of the output `hold_open` so far."""
        return [value for _, value in self.relays()]

    def ends(self) -> Ends:
        """Return the readings of both limit switches."""
        return ends(self.read())

    def reads(self, wanted: Ends) -> bool:
        """Return whether the driver gives these readings after all pauses of the bus."""
        found = self.patiently()
        return isinstance(found, DoorSample) and ends(found) == wanted


def ends(sample: DoorSample) -> Ends:
    return sample.opened, sample.closed


OPEN, CLOSED, BETWEEN = (True, False), (False, True), (False, False)


class DoorContract(Contract[Bench]):
    """The contract on any bus. Each bench begins with a closed door."""

    def test_opening_the_driver_moves_nothing(self, bench: Bench) -> None:
        bench.open()
        assert (bench.ends(), bench.relay()) == (CLOSED, [])

    def test_a_held_door_opens_and_a_released_one_closes_by_itself(self, bench: Bench) -> None:
        bench.open()
        bench.write(HOLD)
        wait_until(lambda: bench.ends() == OPEN, "the held door reads open")
        bench.write(RELEASE)
        wait_until(lambda: bench.ends() == CLOSED, "the released door reads closed")
        assert bench.relay() == [True, False]

    def test_a_door_that_stops_on_its_way_reads_neither_open_nor_closed(self, bench: Bench) -> None:
        bench.open()
        bench.plant.fail("operator", "garbage")
        bench.write(HOLD)
        wait_until(lambda: bench.ends() != CLOSED, "the door has left the closed end")
        assert [bench.ends() for _ in range(20)] == [BETWEEN] * 20

    def test_a_cut_limit_contact_never_reads_open(self, bench: Bench) -> None:
        bench.open()
        bench.write(HOLD)
        wait_until(lambda: bench.ends() == OPEN, "the held door reads open")
        bench.plant.fail("opened", "off")
        wait_until(lambda: bench.ends() == BETWEEN, "the cut contact reads neither open nor closed")

    def test_open_and_closed_at_once_does_not_read_as_open(self, bench: Bench) -> None:
        bench.open()
        bench.plant.fail("opened", "wrong")
        wait_until(lambda: bench.ends() != CLOSED, "both contacts at once no longer read closed")
        sample = bench.read()
        assert sample.opened == sample.closed
        assert sample.closed or sample.lost

    def test_writing_the_same_again_sends_no_command(self, bench: Bench) -> None:
        bench.open()
        for _ in range(3):
            bench.write(HOLD)
        wait_until(bench.relay, "the hold has come through")
        assert bench.relay() == [True]

    def test_make_safe_and_close_each_release_the_door(self, bench: Bench) -> None:
        bench.open()
        bench.write(HOLD)
        bench.driver.make_safe()
        bench.write(HOLD)
        bench.driver.close()
        wait_until(lambda: len(bench.relay()) == 4, "the last release")
        assert bench.relay() == [True, False] * 2


class WiredDoorContract(DoorContract):
    """The contract on a bus whose far side can fail. Its parts are `server` and `unit`."""

    @pytest.mark.parametrize("part", ["server", "unit"])
    def test_a_link_that_is_gone_is_a_driver_error_and_a_hold_survives_it(
        self, bench: Bench, part: str
    ) -> None:
        bench.open()
        bench.write(HOLD)
        wait_until(lambda: bench.ends() == OPEN, "the held door reads open")
        bench.plant.fail(part, "off")
        wait_until(lambda: isinstance(bench.patiently(), str), f"the lost {part} is noticed")
        with pytest.raises(DriverError):
            bench.driver.open()
        bench.plant.fail(part, None)
        wait_until(lambda: bench.reads(OPEN), f"the door reads open again after the {part} is back")
        bench.open()
        bench.write(HOLD)
        assert bench.relay() == [True]

    @pytest.mark.parametrize("mode", ["garbage", "wrong", "slow", "stuck"])
    def test_every_failure_is_a_driver_error_and_never_reads_as_open(
        self, bench: Bench, mode: FailureMode
    ) -> None:
        bench.open()
        seen = bench.until_it_fails("server", mode, lambda sample: False)
        assert OPEN not in map(ends, seen)
        bench.plant.fail("server", None)
        wait_until(lambda: bench.reads(CLOSED), "the door reads closed again after the failure")


def quick(name: str, wires: Iterable[Wire]) -> DoorPlant:
    """Return a simulated door that moves from end to end in 0.05 s."""
    return DoorPlant(name, wires, **QUICK)

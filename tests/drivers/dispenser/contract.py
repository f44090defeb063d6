"""Duties of every driver of a dispenser or ingestor, on any bus. Each test has its own bench."""

import pytest

from bridges.kinds.dispenser.signals import Item, WorkcellOutputs, WorkcellSample
from hal_fakes.plants.plant import FailureMode
from tests.drivers import benches
from tests.drivers.benches import Contract
from tests.waiting import wait_until

RUN = WorkcellOutputs(start=True, guid="task", item=Item("box", 1))
REST = WorkcellOutputs()


class Bench(benches.Bench[WorkcellSample, WorkcellOutputs]):
    """A bench with a workcell. The workcell's cycle is so short that no test waits for its end."""

    def moved(self) -> int:
        """Return the number of items that left the workcell."""
        return sum(edge.signal == "moved" for edge in self.plant.edges)

    def starts(self) -> list[object]:
        """Return every edge of the start signal so far."""
        return [value for signal, value in self.relays() if signal == "start"]

    def is_done(self) -> bool:
        """Return whether the driver reads `done` after all pauses of the bus."""
        found = self.patiently()
        return isinstance(found, WorkcellSample) and found.done is True


class WorkcellContract(Contract[Bench]):
    """The contract on any bus. Each bench begins with a workcell at rest."""

    def test_opening_the_driver_starts_nothing(self, bench: Bench) -> None:
        bench.open()
        sample = bench.read()
        assert (sample.done, sample.errors, bench.starts()) == (False, (), [])
        assert sample.ready is not False

    def test_a_start_moves_one_item_and_reads_done(self, bench: Bench) -> None:
        bench.open()
        bench.write(RUN)
        wait_until(bench.is_done, "the workcell reads done")
        bench.write(REST)
        assert bench.moved() == 1
        assert bench.starts() == [True, False]

    def test_writing_the_same_again_sends_no_command(self, bench: Bench) -> None:
        bench.open()
        for _ in range(3):
            bench.write(RUN)
        assert bench.starts() == [True]

    def test_a_jammed_workcell_never_reads_done(self, bench: Bench) -> None:
        bench.plant.fail("conveyor", "stuck")
        bench.open()
        bench.write(RUN)
        assert not any(bench.is_done() for _ in range(20))

    def test_a_fault_is_read(self, bench: Bench) -> None:
        bench.open()
        bench.plant.press("fault", True, 0.0)
        wait_until(lambda: bool(bench.read().fault or bench.read().errors), "the fault is read")

    def test_make_safe_and_close_each_end_a_start(self, bench: Bench) -> None:
        bench.plant.fail("conveyor", "stuck")
        bench.open()
        bench.write(RUN)
        bench.driver.make_safe()
        assert bench.starts() == [True, False]


class WiredWorkcellContract(WorkcellContract):
    """The contract on a bus whose far side can fail. The part `server` is the far side."""

    @pytest.mark.parametrize("mode", ["off", "garbage", "wrong", "slow"])
    def test_every_failure_is_a_driver_error_and_never_reads_done(
        self, bench: Bench, mode: FailureMode
    ) -> None:
        bench.open()
        seen = bench.until_it_fails("server", mode, lambda sample: False)
        assert not any(sample.done for sample in seen)
        bench.plant.fail("server", None)
        wait_until(lambda: isinstance(bench.patiently(), WorkcellSample), "it reads again")

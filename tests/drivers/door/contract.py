"""What every driver of a door has to do, on whatever it stands: each test of it has a bench of its own.

A test class derives from `DoorContract`, or from `WiredDoorContract` where the link can fail, and says
how its bench is built.
"""

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

import pytest

from bridges.door.signals import DoorOutputs, DoorSample
from drivers import Driver, DriverError
from hal_fakes.plants.door import DoorPlant
from hal_fakes.plants.plant import Plant
from tests.drivers.hal.modbus.module import Time
from tests.waiting import at_last, wait_until

HOLD, RELEASE = DoorOutputs(hold_open=True), DoorOutputs(hold_open=False)
QUICK: dict[str, Any] = {"open_s": 0.05, "close_s": 0.05, "auto_close_s": 0.05}
"""A door that is not worth waiting for."""

DoorDriver = Driver[DoorSample, DoorOutputs]


class Bench:
    """One driver on one bus, with a door behind it. `clock`: the bus's, for its pauses."""

    def __init__(self, driver: DoorDriver, plant: Plant, clock: Time | None = None) -> None:
        self.driver = driver
        self.plant = plant
        self.clock = clock or Time()

    def relay(self) -> list[Any]:
        """Every edge of the hold so far."""
        return [edge.value for edge in self.plant.edges if edge.what == "relay"]

    def ends(self) -> tuple[bool | None, bool | None]:
        """Does it read open, does it read closed?"""
        sample = at_last(self.driver.read, "a reading", self.a_moment)
        return sample.opened, sample.closed

    def write(self, outputs: DoorOutputs) -> None:
        """These outputs."""
        at_last(lambda: self.driver.write(outputs), "written", self.a_moment)

    def a_moment(self) -> None:
        """All pauses are over."""
        self.clock.now += 60.0

    def patiently(self) -> tuple[bool | None, bool | None] | str:
        """The same with all pauses over; or why it could not be read."""
        self.a_moment()
        try:
            sample = self.driver.read()
        except DriverError as error:
            return str(error)
        return sample.opened, sample.closed


OPEN, CLOSED, BETWEEN = (True, False), (False, True), (False, False)


class DoorContract(ABC):
    """On any bus."""

    @abstractmethod
    def benches(self) -> contextlib.AbstractContextManager[Bench]:
        """A bench with a closed door; nothing is open yet."""

    @pytest.fixture
    def bench(self) -> Iterator[Bench]:
        with self.benches() as bench:
            yield bench
            bench.driver.close()

    def test_opening_the_driver_moves_nothing(self, bench: Bench) -> None:
        bench.driver.open()
        assert (bench.ends(), bench.relay()) == (CLOSED, [])

    def test_a_held_door_opens_and_a_released_one_closes_by_itself(self, bench: Bench) -> None:
        bench.driver.open()
        bench.write(HOLD)
        wait_until(lambda: bench.ends() == OPEN, "open")
        bench.write(RELEASE)
        wait_until(lambda: bench.ends() == CLOSED, "closed")
        assert bench.relay() == [True, False]

    def test_a_door_that_stops_on_its_way_reads_neither_open_nor_closed(self, bench: Bench) -> None:
        bench.driver.open()
        bench.plant.fail("operator", "garbage")
        bench.write(HOLD)
        wait_until(lambda: bench.ends() != CLOSED, "it has left the closed end")
        assert [bench.ends() for _ in range(20)] == [BETWEEN] * 20

    def test_a_cut_limit_contact_never_reads_open(self, bench: Bench) -> None:
        bench.driver.open()
        bench.write(HOLD)
        wait_until(lambda: bench.ends() == OPEN, "open")
        bench.plant.fail("opened", "off")
        wait_until(lambda: bench.ends() == BETWEEN, "neither")

    def test_open_and_closed_at_once_does_not_read_as_open(self, bench: Bench) -> None:
        bench.driver.open()
        bench.plant.fail("opened", "wrong")
        wait_until(lambda: bench.ends() != CLOSED, "seen")
        sample = at_last(bench.driver.read, "a reading", bench.a_moment)
        assert sample.opened == sample.closed
        assert sample.closed or sample.lost

    def test_writing_the_same_again_sends_no_command(self, bench: Bench) -> None:
        bench.driver.open()
        for _ in range(3):
            bench.write(HOLD)
        assert bench.relay() == [True]

    def test_make_safe_and_close_each_release_the_door(self, bench: Bench) -> None:
        bench.driver.open()
        bench.write(HOLD)
        bench.driver.make_safe()
        bench.write(HOLD)
        bench.driver.close()
        assert bench.relay() == [True, False] * 2

    def test_closing_what_was_never_open_touches_nothing(self, bench: Bench) -> None:
        bench.driver.close()
        assert bench.relay() == []


class WiredDoorContract(DoorContract):
    """On a bus whose far side can go away: parts `server` and `unit` of the plant."""

    @pytest.mark.parametrize("part", ["server", "unit"])
    def test_a_link_that_is_gone_is_a_driver_error_and_a_hold_survives_it(
        self, bench: Bench, part: str
    ) -> None:
        bench.driver.open()
        bench.write(HOLD)
        wait_until(lambda: bench.ends() == OPEN, "open")
        bench.plant.fail(part, "off")
        wait_until(lambda: isinstance(bench.patiently(), str), "gone")
        with pytest.raises(DriverError):
            bench.driver.open()
        bench.plant.fail(part, None)
        wait_until(lambda: bench.patiently() == OPEN, "back")
        bench.driver.open()
        bench.write(HOLD)
        assert bench.relay() == [True]

    @pytest.mark.parametrize("mode", ["garbage", "wrong", "slow", "stuck"])
    def test_every_failure_is_a_driver_error_and_never_reads_as_open(
        self, bench: Bench, mode: Any
    ) -> None:
        bench.driver.open()
        bench.plant.fail("server", mode)
        seen = []

        def failing() -> bool:
            seen.append(bench.patiently())
            return isinstance(seen[-1], str)

        wait_until(failing, mode)
        assert OPEN not in seen
        bench.plant.fail("server", None)
        wait_until(lambda: bench.patiently() == CLOSED, "back")


def quick(name: str, wires: Any) -> DoorPlant:
    """A door that is there in no time."""
    return DoorPlant(name, wires, **QUICK)

"""Calls as a number on coils. Each coil is switched by a request of its own, so a part of a number may
stay on after a failure."""

from collections.abc import Iterator
from contextlib import closing

import pytest

from drivers import DriverError
from drivers.lift.dry_contact import create
from hal_fakes.plants.lift import LiftPlant
from tests.drivers.hal.modbus.module import Module, Time, bus_to, frame
from tests.drivers.lift.contract import AGV, CALL, QUICK, Bench
from tests.drivers.lift.wirings import coil, settings

BITS = (20, 21)
CODES = {1: "B1", 2: "G", 3: "1"}


class Controller(Module):
    """A module whose coil `worn` cannot be switched on."""

    worn: int | None = None

    def answer(self, request: bytes) -> bytes:
        function, address, on = request[7], int.from_bytes(request[8:10], "big"), request[10]
        if function == 5 and on and address == self.worn:
            return frame(request, bytes((function | 0x80, 4)))
        return super().answer(request)

    def called(self) -> str | None:
        """Return the landing that the controller reads in its coils."""
        return CODES.get(sum(self.coils[1, at] << n for n, at in enumerate(BITS)))


@pytest.fixture
def controller() -> Iterator[Controller]:
    started = Controller()
    started.inputs |= {(1, at): False for at in range(32)}
    started.coils |= {(1, at): False for at in range(32)}
    yield started
    started.close()


def test_a_code_that_is_written_only_in_part_calls_no_other_landing(
    controller: Controller,
) -> None:
    code = {"bits": [coil(at) for at in BITS], "codes": CODES}
    with closing(bus_to(controller.port, clock := Time())) as bus:
        lift = create("lift", settings(calls={}, call_code=code), bus)
        bench = Bench(lift, LiftPlant("lift", settings(), QUICK), clock)
        bench.open()
        bench.read()
        bench.write(AGV)
        controller.worn = BITS[1]
        with pytest.raises(DriverError, match="write coil 21: exception 4"):
            lift.write(CALL)
        assert controller.called() is None
        assert controller.coils[1, 0], "AGV mode stays requested"
        controller.worn = None
        bench.a_moment()
        bench.write(CALL)
        assert controller.called() == "1"

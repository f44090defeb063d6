"""Signals on points: the active level, the order of switching, and writes after a failed write."""

from collections.abc import Mapping

import pytest

from drivers import DriverError
from drivers.hal.points import HalError, Points, Pull, Wire

WIRES = (
    Wire("alarm", "in", "4", "low", "down"),
    Wire("call_1", "out", "18", "high"),
    Wire("call_2", "out", "7", "low"),
)


class Recorded:
    """A stand-in for a bus that records every write in order. If `broken` is true, each write fails."""

    def __init__(self) -> None:
        self.claims: list[tuple[Mapping[str, Pull | None], Mapping[str, bool]]] = []
        self.writes: list[dict[str, bool]] = []
        self.reads_back: dict[str, bool] | None = None
        self.broken = False

    def canonical(self, point: str) -> str:
        return f"P{point}"

    def lines(
        self, inputs: Mapping[str, Pull | None], outputs: Mapping[str, bool], *of_modbus: object
    ) -> "Recorded":
        self.claims.append((inputs, outputs))
        return self

    def claim(self) -> None:
        self.writes.append({})

    def read(self) -> dict[str, bool]:
        return {"P4": False}

    def write(self, levels: Mapping[str, bool]) -> None:
        if self.broken:
            raise HalError("broken")
        self.writes.append(dict(levels))

    def outputs(self) -> dict[str, bool] | None:
        return self.reads_back

    def close(self) -> None:
        self.writes.append({"closed": True})


@pytest.fixture
def bus() -> Recorded:
    return Recorded()


def test_points_are_claimed_by_their_one_spelling_at_their_safe_level(bus: Recorded) -> None:
    Points(WIRES, bus)
    assert bus.claims == [({"P4": "down"}, {"P18": False, "P7": True})]


def test_a_level_is_read_by_the_polarity_of_its_wire(bus: Recorded) -> None:
    assert Points(WIRES, bus).read() == {"alarm": True}


def test_outputs_that_go_off_are_written_first_and_none_is_written_twice(bus: Recorded) -> None:
    points = Points(WIRES, bus)
    points.open()
    points.write({})
    points.write({"call_1": True})
    points.write({"call_1": True})
    points.write({"call_2": True})
    points.write({})
    assert bus.writes == [
        {},
        {"P18": False, "P7": True},
        {"P18": True},
        {"P18": False},
        {"P7": False},
        {"P7": True},
    ]


def test_after_a_failed_write_everything_is_written_again(bus: Recorded) -> None:
    points = Points(WIRES, bus)
    points.write({"call_1": True})
    bus.broken = True
    with pytest.raises(HalError, match="broken"):
        points.write({})
    bus.broken = False
    bus.writes.clear()
    points.write({"call_1": True})
    assert bus.writes == [{"P7": True}, {"P18": True}]


def test_make_safe_writes_every_output_whatever_was_known(bus: Recorded) -> None:
    points = Points(WIRES, bus)
    points.write({})
    bus.writes.clear()
    points.make_safe()
    assert bus.writes == [{"P18": False, "P7": True}]


def test_make_safe_is_verified_where_outputs_can_be_read_back(bus: Recorded) -> None:
    points = Points(WIRES, bus)
    bus.reads_back = {"P18": False, "P7": True}
    points.make_safe()
    bus.reads_back = {"P18": True, "P7": False}
    with pytest.raises(DriverError, match=r"^still on after being switched off: call_1, call_2$"):
        points.make_safe()


@pytest.mark.parametrize(
    ("wire", "reads"),
    [
        (Wire("s", "in", "1", "high", "up"), True),
        (Wire("s", "in", "1", "high", "down"), False),
        (Wire("s", "in", "1", "low", "up"), False),
        (Wire("s", "in", "1", "low", "down"), True),
        (Wire("s", "in", "1", "low", "none"), None),
        (Wire("s", "in", "1", "high"), False),
        (Wire("s", "in", "1", "low"), True),
        (Wire("s", "out", "1", "low"), False),
    ],
)
def test_what_a_cut_wire_reads_follows_from_its_pull_and_sense(
    wire: Wire, reads: bool | None
) -> None:
    assert wire.broken_reads() is reads

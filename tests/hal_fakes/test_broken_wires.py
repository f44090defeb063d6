"""A simulated lift with one broken wire. The real driver reads it through gpiozero's mock pins.

The car rides in AGV mode from L1 to L3, where the door opens and closes. Each reading must show the
truth, show "unknown", or be a fault. No reading may show a closed door as open, or show a wrong floor.
"""

from collections.abc import Iterator

import pytest

from bridges.kinds.lift.signals import DoorReading, Hazard, LiftSample, Side
from drivers.lift.dry_contact import wires
from hal_fakes.plants.plant import FailureMode
from tests.hal_fakes.virtual_lift import WiredLift, shipped

SCAN_S = 0.05
LEVELS = ("L1", "L2", "L3", "L4")
INPUTS = [w.signal for w in wires(shipped()) if w.direction == "in"]
OUTPUTS = [w.signal for w in wires(shipped()) if w.direction == "out"]


@pytest.fixture
def lift() -> Iterator[WiredLift]:
    made = WiredLift()
    yield made
    made.close()


def ride(lift: WiredLift, until: float = 14.0) -> Iterator[tuple[float, LiftSample]]:
    """Yield the time and the reading of every scan during a ride to L3."""
    lift.write(agv_request=True)
    for i in range(1, round(until / SCAN_S)):
        lift.now = now = round(i * SCAN_S, 3)
        if now == 1.0:
            lift.write(agv_request=True, call="L3")
        yield now, lift.at(now)


def changes(lift: WiredLift) -> list[tuple[float, LiftSample]]:
    """Return (s, reading) of each reading that differs from the previous reading of the ride."""
    seen: list[tuple[float, LiftSample]] = []
    for now, sample in ride(lift):
        if not seen or sample != seen[-1][1]:
            seen.append((now, sample))
    return seen


def sample(
    level: str | None, door: DoorReading = DoorReading.NOT_OPEN, agv: bool = True
) -> LiftSample:
    return LiftSample(level=level, door=door, agv=agv)


def test_with_whole_wires_the_readings_show_the_ride(lift: WiredLift) -> None:
    assert changes(lift) == [
        (0.05, sample("L1", agv=False)),
        (0.5, sample("L1")),
        (1.55, sample(None)),
        (2.55, sample("L2")),
        (3.55, sample(None)),
        (4.55, sample("L3")),
        (6.05, sample("L3", DoorReading.OPEN)),
        (8.05, sample("L3")),
    ]


def truth(lift: WiredLift) -> tuple[str | None, bool]:
    car = lift.plant.car
    door = next(iter(lift.plant.doors.values()))
    return (None if car.shown is None else LEVELS[car.shown]), door.opened


@pytest.mark.parametrize("signal", INPUTS)
def test_a_cut_input_never_reads_as_an_open_door_or_another_floor(
    lift: WiredLift, signal: str
) -> None:
    lift.plant.fail(signal, "off")
    hazards = set()
    for _, seen in ride(lift):
        level, opened = truth(lift)
        assert seen.level in (None, level)
        assert seen.door is DoorReading.NOT_OPEN or (seen.door is DoorReading.OPEN and opened)
        hazards.add(seen.hazards)
    alarm = {signal} if signal in ("fire_alarm", "code_blue") else set()
    assert hazards == {frozenset(alarm)}


@pytest.mark.parametrize("signal", [s for s in INPUTS if s.startswith("floor")])
@pytest.mark.parametrize("mode", ["off", "stuck", "wrong"])
def test_one_bad_floor_line_is_a_fault_and_no_other_floor(
    lift: WiredLift, signal: str, mode: FailureMode
) -> None:
    lift.at(0.0)
    lift.plant.fail(signal, mode)
    faults = set()
    for _, seen in ride(lift):
        assert seen.level in (None, truth(lift)[0])
        faults.add(seen.code_fault)
    assert faults - {""} <= {"parity is not even: a line is broken"}


def test_a_stuck_fire_contact_keeps_its_state(lift: WiredLift) -> None:
    lift.at(0.0)
    lift.plant.fail("fire_alarm", "stuck")
    lift.plant.press("fire_alarm", True, 1.0)
    stuck = lift.at(1.0).hazards
    lift.plant.fail("fire_alarm", None)
    assert (stuck, lift.at(1.1).hazards) == (frozenset(), frozenset({Hazard.FIRE}))


def test_a_slow_door_contact_arrives_late(lift: WiredLift) -> None:
    lift.plant.fail("door", "slow")
    opened = [now for now, seen in ride(lift) if seen.door is DoorReading.OPEN]
    assert (opened[0], opened[-1]) == (8.05, 10.0)


def relays(lift: WiredLift) -> list[tuple[float, str, object]]:
    return [(round(e.at, 3), e.signal, e.value) for e in lift.plant.edges if e.what == "relay"]


@pytest.mark.parametrize("signal", ["agv_mode_request", "call_L3"])
def test_a_cut_output_moves_nothing_even_if_it_is_driven(lift: WiredLift, signal: str) -> None:
    lift.plant.fail(signal, "off")
    levels = {seen.level for _, seen in ride(lift)}
    assert (levels, relays(lift)) == (
        {"L1"},
        [(0.0, "agv_mode_request", True), (1.0, "call_L3", True)],
    )


def test_a_welded_call_relay_keeps_calling(lift: WiredLift) -> None:
    assert len(list(ride(lift, until=2.0))) == 39
    lift.plant.fail("call_L3", "stuck")
    lift.write()
    lift.at(20.0)
    lift.write(agv_request=True)
    lift.at(40.0)
    assert lift.plant.car.floor == 2


def test_releasing_the_points_switches_everything_off(lift: WiredLift) -> None:
    assert len(list(ride(lift, until=2.0))) == 39
    lift.driver.close()
    assert relays(lift)[-2:] == [
        (1.95, "agv_mode_request", False),
        (1.95, "call_L3", False),
    ]


def test_every_output_is_wired_to_its_own_pin(lift: WiredLift) -> None:
    for signal in OUTPUTS:
        lift.write(
            agv_request=signal == "agv_mode_request",
            call=signal.removeprefix("call_") if signal.startswith("call_") else None,
            hold_door=_side(signal),
        )
    assert [e[1] for e in relays(lift) if e[2]] == OUTPUTS


def _side(signal: str) -> Side | None:
    return Side.FRONT if signal == "door_open" else None

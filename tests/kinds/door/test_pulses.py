"""DOOR-PULSES-1 to DOOR-PULSES-3: pulses that reach the operator, and pulses that may not have reached
it."""

from collections.abc import Callable

from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.pulses import DoorPulses, advance, changes_at
from bridges.kinds.door.settings import DoorDurations, Pulse
from bridges.kinds.door.signals import CloseRequested, DoorSample, OpenRequested
from bridges.kinds.shared.decision import IoFailed, Sampled, WriteFailed
from tests.kinds.door.virtual import CLOSED, OPEN, OPENS, SCAN_S, CoreAlone, word

PULSE = Pulse(on_s=0.5, every_s=8.0)
BLIND = DoorSample()
LONG = DoorDurations(open_delay_s=3.0, stale_after_s=60.0)
ESTIMATED = DoorLimits(LONG, estimated=True, pulse=PULSE)
SEEN = DoorLimits(DoorDurations(stale_after_s=60.0), pulse=PULSE)

Fails = Callable[[float], bool]


def never(now: float) -> bool:
    return False


class Bus:
    """A door's core behind a bus whose writes or reads fail at some times. RMF opens the door at 1 s.

    `relay` has (s, on) of each change of the real relay. `modes` has (s, mode) of each change of the
    mode that RMF hears.
    """

    def __init__(self, limits: DoorLimits, sample: DoorSample) -> None:
        self.core = CoreAlone(limits)
        self.sample = sample
        self.relay: list[tuple[float, bool]] = [(0.0, False)]
        self.modes: list[tuple[float, str]] = []
        self.wake_at = 0.0

    def run(self, until: float, *, writes_fail: Fails = never, reads_fail: Fails = never) -> "Bus":
        """Scan until the time `until`. The functions tell for each time whether the bus fails."""
        core = self.core
        while core.now < until:
            core.now = min(until, core.now + SCAN_S, self.wake_at)
            now = core.now
            decided = core.hears(IoFailed("cut") if reads_fail(now) else Sampled(self.sample))
            if now == 1.0:
                decided = core.hears(OPENS)
            on = decided.outputs.hold_open
            if writes_fail(now):
                decided = core.hears(WriteFailed("timeout"))
            elif on != self.relay[-1][1]:
                self.relay.append((now, on))
            self.wake_at = decided.wake_at
            mode = word(decided.report.mode)
            if not self.modes or self.modes[-1][1] != mode:
                self.modes.append((now, mode))
        return self

    def told(self, mode: str) -> list[float]:
        """Return the times when RMF heard this mode anew."""
        return [at for at, heard in self.modes if heard == mode]


def between(begin: float, end: float) -> Fails:
    return lambda now: begin <= now < end


def test_a_door_is_estimated_open_a_delay_after_the_first_pulse() -> None:
    """DOOR-PULSES-1 and DOOR-PULSES-3."""
    bus = Bus(ESTIMATED, BLIND).run(30.0)
    assert bus.relay[1:5] == [(1.0, True), (1.5, False), (9.0, True), (9.5, False)]
    assert bus.told("OPEN") == [4.0]


def test_a_pulse_whose_writes_all_fail_is_given_again_at_once() -> None:
    """DOOR-PULSES-2: the writes fail for longer than the pulse would last."""
    bus = Bus(SEEN, CLOSED).run(20.0, writes_fail=between(1.0, 1.75))
    assert bus.relay[1:4] == [(1.75, True), (2.125, False), (2.25, True)]


def test_no_door_is_estimated_open_before_a_pulse_was_written() -> None:
    """DOOR-PULSES-3: a relay that was never on opened no door."""
    fails = between(1.0, 6.0)
    bus = Bus(ESTIMATED, BLIND).run(20.0, writes_fail=fails)
    assert bus.relay[1][0] >= 6.0
    assert bus.told("OPEN") == [at + 3.0 for at, on in bus.relay[2:4] if on]


def test_a_held_door_gets_its_lost_pulse_without_waiting_for_the_next_one() -> None:
    """DOOR-PULSES-2: the door would close on a robot `every_s` after its last pulse."""
    bus = Bus(SEEN, OPEN).run(20.0, writes_fail=between(9.0, 9.125))
    assert bus.relay[3:] == [
        (9.125, True),
        (9.5, False),
        (9.625, True),
        (10.125, False),
        (17.625, True),
        (18.125, False),
    ]


def test_a_pulse_during_a_failed_reading_is_given_again() -> None:
    """DOOR-PULSES-2: a module that has lost its power for a moment has dropped its relay."""
    bus = Bus(ESTIMATED, BLIND).run(20.0, reads_fail=between(9.25, 9.375))
    assert [at for at, on in bus.relay if on] == [1.0, 9.0, 9.875, 17.875]
    assert bus.told("OPEN") == [4.0, 12.875]


def test_a_failure_between_two_pulses_loses_no_pulse() -> None:
    """DOOR-PULSES-2."""
    bus = Bus(SEEN, OPEN).run(20.0, reads_fail=between(4.0, 5.0))
    assert [at for at, on in bus.relay if on] == [1.0, 9.0, 17.0]


def test_a_bus_that_fails_again_and_again_delays_no_pulse_beyond_its_time() -> None:
    """DOOR-PULSES-2: the driver is told of a new pulse each `every_s`, whatever fails."""

    def flaky(now: float) -> bool:
        return now >= 1.0 and int(now / SCAN_S) % 3 == 0

    core = Bus(SEEN, OPEN).run(60.0, writes_fail=flaky).core
    begun = [at for at, _, on in core.told if on]
    assert begun == [1.0 + n * PULSE.every_s for n in range(8)]


def test_a_write_that_takes_longer_than_the_pulse_before_it_fails_is_given_again() -> None:
    """DOOR-PULSES-2: the module may have got the request when the call failed, not when it began."""
    core = CoreAlone(SEEN)
    core.hears(Sampled(CLOSED))
    assert core.hears(OPENS).outputs.hold_open
    core.now = 1.0
    assert core.hears(WriteFailed("timeout")).outputs.hold_open
    core.now = 1.25
    assert core.hears(Sampled(CLOSED)).wake_at == 1.5
    edges = []
    for core.now in (1.5, 1.5625, 1.625):
        edges.append(core.hears(Sampled(CLOSED)).outputs.hold_open)
    assert edges == [False, False, True]


def test_a_late_scan_leaves_out_neither_a_pulse_nor_the_rest_before_it() -> None:
    """DOOR-PULSES-1: the driver must see the relay off before it asks a module for a new pulse."""
    core = CoreAlone(SEEN)
    core.hears(Sampled(CLOSED))
    core.hears(OPENS)
    seen = []
    for core.now in (8.25, 8.375, 16.25, 16.5):
        decided = core.hears(Sampled(CLOSED))
        seen.append((decided.outputs.hold_open, decided.outputs.between_pulses, decided.wake_at))
    assert seen == [
        (False, True, 8.375),
        (True, False, 8.875),
        (False, True, 16.375),
        (True, False, 17.0),
    ]


def test_a_rest_that_is_as_long_as_the_yaml_permits_delays_no_pulse() -> None:
    """DOOR-PULSES-1."""
    core = CoreAlone(
        DoorLimits(DoorDurations(stale_after_s=60.0), pulse=Pulse(on_s=0.9375, every_s=1))
    )
    core.hears(Sampled(CLOSED))
    core.hears(OPENS)
    core.sees(CLOSED, until=4.0)
    assert [at for at, _, on in core.told if on] == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_a_new_hold_begins_with_a_pulse_of_its_own() -> None:
    """DOOR-PULSES-1 and DOOR-PULSES-3: nothing of the last hold's pulses counts."""
    core = CoreAlone(
        DoorLimits(DoorDurations(close_grace_s=0.0, open_delay_s=3.0), estimated=True, pulse=PULSE)
    )
    core.hears(Sampled(BLIND))
    core.hears(OpenRequested("a"))
    core.sees(BLIND, until=4.0)
    core.hears(CloseRequested("a"))
    core.sees(BLIND, until=5.0)
    core.hears(OpenRequested("a"))
    core.sees(BLIND, until=9.0)
    assert [(at, mode, on) for at, mode, on in core.told if at >= 5.0] == [
        (5.0, "MOVING", True),
        (5.5, "MOVING", False),
        (8.0, "OPEN", False),
    ]


def test_a_failure_in_the_scan_that_begins_a_pulse_counts() -> None:
    """DOOR-PULSES-2."""
    assert advance(None, True, 5.0, PULSE) == DoorPulses(5.0, failed_at=5.0)


def test_between_pulses_that_follow_closely_the_relay_is_off_for_the_whole_time_between_them() -> (
    None
):
    """DOOR-PULSES-1."""
    close = Pulse(on_s=0.5, every_s=0.5625)
    assert changes_at(DoorPulses(5.0), close) == 5.5
    assert changes_at(DoorPulses(5.0, off_at=5.5), close) == 5.5625

"""The loop of a bus in virtual time: the order of the scans in a round, and the loop's end."""

import pytest

from bridges.messages.definitions import DoorModeValue, DoorState
from tests.runtime.corridor import SCAN_S, Corridor


def test_each_device_is_scanned_once_a_period() -> None:
    corridor = Corridor()
    assert not corridor.loop.ready
    assert corridor.round(0.0) == ["ward claimed", "ward read", "lab claimed", "lab read"]
    assert (corridor.loop.ready, corridor.loop.wake_at) == (True, SCAN_S)
    assert corridor.round(0.1) == []
    assert corridor.round(SCAN_S) == ["ward read", "lab read"]


def test_a_request_scans_its_device_and_no_other() -> None:
    corridor = Corridor()
    corridor.round(0.0)
    corridor.asks("lab")
    assert corridor.round(0.1) == ["lab read", "lab held"]


def test_an_edge_scans_every_device_once() -> None:
    corridor = Corridor()
    corridor.round(0.0)
    corridor.bus.edge()
    assert corridor.round(0.1) == ["ward read", "lab read"]
    assert corridor.round(0.11) == []


def test_an_edge_during_a_round_is_seen_in_the_next_one() -> None:
    corridor = Corridor()
    corridor.doors["lab"].during = corridor.bus.edge
    corridor.round(0.0)
    corridor.doors["lab"].during = lambda: None
    assert corridor.loop.inbox.wait(0.0), "the edge wakes the loop"
    assert corridor.round(0.01) == ["ward read", "lab read"]


def test_a_round_ends_after_the_device_under_way_when_the_loop_is_told_to_end() -> None:
    corridor = Corridor()
    corridor.doors["ward"].during = corridor.loop.inbox.close
    assert corridor.round(0.0) == ["ward claimed", "ward read"]


def test_each_round_feeds_the_buss_dead_man_and_a_round_that_does_not_end_feeds_nothing() -> None:
    """Without this, GPIO has no dead-man, and a module's watchdog trips in the midst of a ride."""
    corridor, seen = Corridor(), list[int]()
    for door in corridor.doors.values():
        door.during = lambda: seen.append(corridor.bus.fed)
    corridor.round(0.0)
    corridor.round(0.1)
    corridor.round(SCAN_S)
    assert (seen, corridor.bus.fed) == ([0, 0, 2, 2], 3)
    corridor.doors["ward"].during = corridor.loop.inbox.close
    corridor.round(2 * SCAN_S)
    assert corridor.bus.fed == 3


def test_at_the_end_every_output_is_switched_off_before_anything_is_let_go() -> None:
    corridor = Corridor()
    assert corridor.loop.end()
    off = ["bus insists", "ward off", "lab off", "ward closed", "lab closed", "bus closed"]
    assert [what for _, what in corridor.story] == off


def test_one_device_that_cannot_be_switched_off_keeps_no_other_on_and_is_reported() -> None:
    corridor = Corridor()
    corridor.doors["ward"].lost = True
    assert not corridor.loop.end()
    assert (0.0, "lab off") in corridor.story


def test_after_a_suspension_nothing_is_shown_that_was_only_true_before_it() -> None:
    """The daemon is suspended by SIGSTOP or by a laptop's sleep. The suspension is short, so the last
    reading has not yet exceeded its permitted age."""
    corridor = Corridor(debounce={"opened": 0.1, "closed": 0.1})
    for i in range(7):
        corridor.round(SCAN_S * i)
    assert [shown(state) for _, state in corridor.states[-2:]] == ["ward CLOSED", "lab CLOSED"]
    for door in corridor.doors.values():
        door.opened = True
    corridor.states.clear()
    for at in (2.4, 2.5, 2.6):
        corridor.round(at)
    assert [(at, shown(state)) for at, state in corridor.states] == [
        (2.4, "ward UNKNOWN"),
        (2.4, "lab UNKNOWN"),
        (2.5, "ward OPEN"),
        (2.5, "lab OPEN"),
    ]


def shown(state: DoorState) -> str:
    mode = DoorModeValue(state.current_mode.value)
    return f"{state.door_name} {mode.name.removeprefix('MODE_')}"


def test_a_slow_bus_does_not_count_as_a_suspension(caplog: pytest.LogCaptureFixture) -> None:
    corridor = Corridor()
    corridor.round(0.0)

    def waits() -> None:
        corridor.now += 8.0

    corridor.doors["ward"].during = waits
    for _ in range(5):
        corridor.round(max(corridor.now, corridor.loop.wake_at))
    assert "suspended" not in caplog.text


def test_each_device_that_is_scanned_and_each_call_of_the_bus_shows_that_the_loop_lives() -> None:
    """With thirty silent units one round has thirty timeouts. Such a long round must not look like a
    hang."""
    corridor = Corridor()
    counts: list[int] = []
    corridor.doors["ward"].during = lambda: counts.append(corridor.loop.finished)
    corridor.doors["lab"].during = lambda: counts.append(corridor.loop.finished)
    corridor.round(0.0)
    corridor.bus.calls += 1
    counts.append(corridor.loop.finished)
    assert counts == [0, 1, 3]

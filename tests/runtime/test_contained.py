"""A defect in one device's driver. The daemon switches this device off and shows it as offline. The
other devices stay in service."""

import pytest

from bridges.messages.definitions import DoorModeValue
from bridges.runtime.contained import LeftOn
from drivers import DriverError
from tests.runtime.corridor import SCAN_S, Corridor


def breaks(error: Exception) -> None:
    raise error


def held() -> Corridor:
    """Return a corridor in which RMF holds the door `ward` open."""
    corridor = Corridor()
    corridor.round(0.0)
    corridor.asks("ward")
    assert corridor.round(0.1) == ["ward read", "ward held"]
    return corridor


def test_a_defect_of_one_driver_switches_its_device_off_and_the_others_serve_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    corridor = held()
    corridor.doors["ward"].during = lambda: breaks(ValueError("negative size"))
    assert corridor.round(SCAN_S) == ["lab read"]
    assert corridor.round(SCAN_S + 0.1) == ["ward read", "ward off"]
    corridor.asks("lab")
    assert corridor.round(0.4) == ["lab read", "lab held"]
    for i in range(1, 100):
        corridor.round(0.4 + 0.25 * i)
    lines = [r.getMessage() for r in caplog.records if r.levelname == "ERROR"]
    why = 'reason="a defect of the driver: ValueError: negative size"'
    assert lines == [f"defect device=ward {why}", f"device_lost device=ward {why}"]
    assert [bool(r.exc_info) for r in caplog.records if r.levelname == "ERROR"] == [True, False]
    modes = [state.current_mode.value for at, state in corridor.states if state.door_name == "ward"]
    assert modes[-1] == DoorModeValue.MODE_OFFLINE
    assert {state.door_name for at, state in corridor.states if at > 20} == {"ward", "lab"}


def test_a_device_with_a_defect_is_claimed_again_after_a_pause_that_grows() -> None:
    corridor = Corridor()
    corridor.doors["lab"].during = lambda: breaks(KeyError("defect"))
    for i in range(400):
        corridor.round(0.25 * i)
    tries = [at for at, what in corridor.story if what == "lab read"]
    assert tries == [0.0, 0.5, 1.5, 3.5, 7.5, 15.5, 31.5, 61.5, 91.5]
    corridor.doors["lab"].during = lambda: None
    corridor.story.clear()
    for i in range(400, 488):
        corridor.round(0.25 * i)
    assert [(at, what) for at, what in corridor.story if what.startswith("lab")] == [
        (121.5, "lab claimed"),
        (121.5, "lab read"),
        (121.75, "lab read"),
    ]


def test_what_cannot_be_switched_off_within_a_second_ends_the_daemon() -> None:
    corridor = held()
    corridor.doors["ward"].lost = True
    corridor.doors["ward"].during = lambda: breaks(ValueError("negative size"))
    corridor.round(0.4)
    for at in (0.6, 0.8, 1.0, 1.2, 1.39):
        corridor.round(at)
    with pytest.raises(LeftOn, match="ward cannot be switched off: no answer"):
        corridor.round(1.5)


def test_a_lost_device_whose_outputs_nobody_has_switched_on_ends_no_daemon() -> None:
    corridor = Corridor()
    corridor.doors["ward"].lost = True
    corridor.doors["ward"].during = lambda: breaks(ValueError("defect"))
    for i in range(100):
        corridor.round(0.25 * i)
    assert "lab read" in [what for at, what in corridor.story if at > 20]


def test_lost_hardware_is_not_a_defect() -> None:
    corridor = held()
    corridor.doors["ward"].lost = True
    corridor.doors["ward"].during = lambda: breaks(DriverError("no answer"))
    for i in range(100):
        corridor.round(0.25 * i)
    assert [state.current_mode.value for at, state in corridor.states][-2:].count(
        DoorModeValue.MODE_OFFLINE
    ) == 1


def test_a_defect_while_switching_off_at_the_end_keeps_no_other_device_on() -> None:
    corridor = held()
    corridor.doors["ward"].make_safe = lambda: breaks(TypeError("defect"))  # type: ignore[method-assign]
    corridor.doors["ward"].close = lambda: breaks(TypeError("defect"))  # type: ignore[method-assign]
    before = len(corridor.story)
    assert not corridor.loop.end()
    assert [what for _, what in corridor.story[before:]] == [
        "bus insists",
        "lab off",
        "lab closed",
        "bus closed",
    ]

"""Inputs on a bus that is not the device's bus, in virtual time. A late or lost input is unknown."""

import itertools
import logging
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import pytest

from bridges.blackbox.ring import RingContent
from bridges.kinds.shared.decision import OperatorReset
from bridges.messages.constants import LiftMode, LiftRequestDoor, LiftRequestType
from bridges.messages.definitions import DoorMode, DoorModeValue, DoorRequest, LiftRequest
from bridges.messages.topics import DOOR_REQUESTS, LIFT_REQUESTS
from bridges.runtime.clock import Clock
from bridges.runtime.other_bus import Handover, OtherReading
from bridges.runtime.service import NOBODY_OBEYS
from drivers import DriverError
from tests.depth import depth, part
from tests.runtime.on_two_buses import DOOR, OnTwoBuses
from workbench.replay.replayed import Replay, ReplayedCores, of_head

LIFT: Final = Path(__file__).parents[2] / "config" / "lift_two_buses.yaml"
STALE_S: Final = 1.0
LATEST_S: Final = STALE_S + 0.15 + 0.1
"""The greatest age (s) of the inputs that a device uses. It is the sum of three times:
- `stale_after_s`
- the time for which a reading of the bus `header` is valid (0.05 s + 0.1 s)
- a scan of the bus `gateway`"""
SEEN_S: Final = 0.05 + 0.15 + 0.1 + 0.05
"""The longest time (s) until the device sees an alarm. It is the sum of a fire contact's debounce time,
a reading's age, and a scan of each bus."""


@pytest.fixture
def door(tmp_path: Path) -> OnTwoBuses:
    return a_door(tmp_path)


def a_door(folder: Path) -> OnTwoBuses:
    file = folder / "door.yaml"
    file.write_text(DOOR)
    return OnTwoBuses(file)


def hold(on: OnTwoBuses) -> None:
    mode = DoorMode(DoorModeValue.MODE_OPEN)
    asked = DoorRequest(requester_id="me", door_name=on.device, requested_mode=mode)
    on.rmf.publisher(DOOR_REQUESTS).publish(asked)


def ride(on: OnTwoBuses) -> None:
    asked = LiftRequest(
        lift_name=on.device,
        session_id="me",
        request_type=LiftRequestType.REQUEST_AGV_MODE,
        destination_floor="L3",
        door_state=LiftRequestDoor.DOOR_OPEN,
    )
    on.rmf.publisher(LIFT_REQUESTS).publish(asked)


def modes(on: OnTwoBuses) -> list[str]:
    """Return the door's modes in order, without repetitions."""
    names = (DoorModeValue(state.current_mode.value).name[5:] for _, state in on.states)
    return [name for name, _ in itertools.groupby(names)]


def test_a_reset_of_one_device_goes_to_that_device(door: OnTwoBuses) -> None:
    for device, answer in (("D", {}), ("", {}), ("E", {"": NOBODY_OBEYS})):
        door.served.obey(OperatorReset(), device)
        door.run(1.0)
        assert door.served.refusals() == answer


def test_a_door_obeys_its_own_bus_and_reads_its_fire_contact_on_the_other(door: OnTwoBuses) -> None:
    door.run(1.0)
    hold(door)
    door.run(3.0)
    assert (door.relays(), modes(door)[-2:]) == (["hold_open"], ["MOVING", "OPEN"])
    door.press("fire", True)
    door.run(SEEN_S)
    assert (door.relays(), modes(door)[-1]) == ([], "UNKNOWN")


def test_the_first_state_is_no_loss_because_it_waits_for_the_first_reading_of_the_other_bus(
    door: OnTwoBuses, caplog: pytest.LogCaptureFixture
) -> None:
    door.run(2.0)
    assert "device_lost" not in caplog.text
    assert modes(door) == ["UNKNOWN", "CLOSED"]


def test_a_dead_other_bus_at_the_start_leaves_the_device_offline_and_its_outputs_claimed_off(
    door: OnTwoBuses,
) -> None:
    door.far["header"].down = "the header is gone"
    door.run(1.0)
    hold(door)
    door.run(2.0)
    assert (modes(door), door.relays()) == (["OFFLINE"], [])
    assert door.far["gateway"]._levels == {"unit 1 coil 0": False}
    faults = door.served.devices()["D"]["faults"]
    assert "bus header: the header is gone" in str(faults)


def test_when_the_other_bus_is_back_so_is_the_device(door: OnTwoBuses) -> None:
    door.far["header"].down = "the header is gone"
    door.run(2.0)
    door.far["header"].down = ""
    door.run(2.0)
    assert modes(door) == ["OFFLINE", "UNKNOWN", "CLOSED"]


def test_an_alarm_that_begins_while_the_other_bus_is_dead_is_never_taken_for_none(
    door: OnTwoBuses,
) -> None:
    door.run(1.0)
    hold(door)
    door.run(3.0)
    door.far["header"].down = "the header is gone"
    door.press("fire", True)
    door.run(LATEST_S)
    assert (door.relays(), modes(door)[-1]) == ([], "OFFLINE")
    door.far["header"].down = ""
    held: list[str] = []
    door.after_round = lambda bus: held.extend(door.relays())
    door.run(3.0)
    assert (held, modes(door)[-1]) == ([], "UNKNOWN"), "the relay was on before the alarm was seen"


def test_one_reading_of_the_other_bus_is_no_debounced_change(door: OnTwoBuses) -> None:
    """Between two readings of `header`, the thread of `gateway` uses the last reading several times.
    That must not count as several equal readings."""
    door.run(1.0)
    hold(door)
    door.run(3.0)
    header = door.loops["header"]
    door.press("fire", True)
    header.stir()
    header.round()
    door.press("fire", False)
    door.loops["gateway"].stir()
    door.run(1.0)
    assert "UNKNOWN" not in modes(door)[1:], "a glitch of one reading is no alarm"


def test_a_hanging_other_bus_delays_no_scan_of_the_device_and_the_other_way_round(
    door: OnTwoBuses,
) -> None:
    scans = dict.fromkeys(door.loops, 0)

    def count(bus: str) -> None:
        scans[bus] += 1

    door.run(1.0)
    door.after_round = count
    door.hanging = {"header"}
    door.run(2.0)
    assert scans == {"gateway": pytest.approx(20, abs=2), "header": 0}
    door.hanging = {"gateway"}
    door.run(2.0)
    assert scans["header"] == pytest.approx(40, abs=2)


def test_a_change_on_the_other_bus_causes_a_scan_at_once(door: OnTwoBuses) -> None:
    door.run(1.0)
    scanned: list[tuple[float, str]] = []
    door.after_round = lambda bus: scanned.append((round(door.now, 3), bus))
    door.run(0.005)
    door.press("fire", True)
    door.far["header"].wake()
    door.run(0.002)
    assert [bus for _, bus in scanned if bus == "gateway"], scanned


def test_a_reading_counts_from_before_it_was_asked_for_and_not_longer_than_its_time() -> None:
    now = 10.0
    handover = Handover("header", 0.2, Clock(lambda: now, lambda: now))
    woken: list[float] = []
    handover.changed = lambda: woken.append(now)
    with pytest.raises(DriverError, match="bus header: not read yet"):
        handover.take()
    handover.put(OtherReading({"fire": False}, 9.9, why_not=""))
    handover.put(OtherReading({"fire": False}, 10.0, why_not=""))
    assert (handover.take(), woken) == ({"fire": False}, [10.0])
    now = 10.21
    with pytest.raises(DriverError, match=r"bus header: not read for 0\.2 s"):
        handover.take()


def test_what_was_decided_on_two_buses_is_decided_again_from_its_recording(tmp_path: Path) -> None:
    """The recorded sample has the values of both buses, and the debounce times come from the YAML. So a
    replay can repeat every decision."""
    file = tmp_path / "door.yaml"
    file.write_text(DOOR)
    on = OnTwoBuses(file, ring=tmp_path)
    on.run(1.0)
    hold(on)
    on.run(3.0)
    on.press("fire", True)
    on.run(1.0)
    down("header", "no answer")(on)
    on.run(2.0)
    down("header", "")(on)
    on.press("fire", False)
    on.run(2.0)
    for loop in on.loops.values():
        loop.end()
    read = RingContent(tmp_path / "ring")
    replay = Replay(read.entries(), ReplayedCores(of_head(read.head)))
    assert list(replay.differences()) == []
    assert (replay.course.subjects, replay.course.unusable) == ({"D"}, 0)
    assert replay.course.decisions > 20


# ---- every order of some losses and returns of the two buses


Step = tuple[str, Callable[[OnTwoBuses], None]]


def down(bus: str, why: str) -> Callable[[OnTwoBuses], None]:
    def act(on: OnTwoBuses) -> None:
        on.far[bus].down = why
        on.hanging.discard(bus)

    return act


def hang(bus: str) -> Callable[[OnTwoBuses], None]:
    return lambda on: on.hanging.add(bus)


STEPS: Final[Sequence[Step]] = [
    ("header dead", down("header", "no answer")),
    ("header hangs", hang("header")),
    ("header back", down("header", "")),
    ("gateway dead", down("gateway", "no answer")),
    ("gateway hangs", hang("gateway")),
    ("gateway back", down("gateway", "")),
    ("time", lambda on: on.run(1.2)),
]
PART_S: Final = 0.3


class Laws:
    """Laws that hold for every order of events. `look` checks them after each round of the device's
    bus."""

    def __init__(self, on: OnTwoBuses, fire: str, says_fit: Callable[[OnTwoBuses], bool]) -> None:
        self._on = on
        self._says_fit = says_fit
        wires = on.config.wires_on("header", on.device)
        self._fire = next(wire for wire in wires if wire.signal == fire)
        self._alarm_since: float | None = None
        self._round_at = float("-inf")
        on.after_round = self.look

    def look(self, bus: str) -> None:
        header, now = self._on.far["header"], self._on.now
        if bus == "header":
            return
        age_s, gap_s = now - header.read_at, now - self._round_at
        self._round_at = now
        if self._on.far["gateway"].down:
            self._alarm_since = None
            return
        assert not self._on.relays() or age_s <= LATEST_S, f"driven on inputs {age_s:.2f} s old"
        assert not self._says_fit(self._on) or age_s <= LATEST_S, f"fit, but {age_s:.2f} s old"
        read = max(age_s, gap_s) <= 0.15
        alarm = read and self._fire.asserted(header.shown[self._fire.point])
        self._alarm_since = (self._alarm_since or now) if alarm else None
        if self._alarm_since is not None and now > self._alarm_since + SEEN_S:
            assert not self._on.relays(), "an alarm that is read is taken for none"


def walk(
    on: OnTwoBuses, steps: Sequence[Step], press: str, ask: Callable[[OnTwoBuses], None]
) -> None:
    for i, (_, act) in enumerate(steps):
        act(on)
        if i == 1:
            on.press(press, True)
        on.run(PART_S)
        ask(on)
    for bus in on.far:
        down(bus, "")(on)
    on.run(SEEN_S + 2.5)
    assert not on.relays(), "the alarm is on, so in the end nothing is driven"


def door_is_fit(on: OnTwoBuses) -> bool:
    last = on.states[-1][1].current_mode.value if on.states else DoorModeValue.MODE_OFFLINE
    return last in (DoorModeValue.MODE_OPEN, DoorModeValue.MODE_CLOSED)


def lift_is_fit(on: OnTwoBuses) -> bool:
    last = on.states[-1][1].current_mode if on.states else LiftMode.MODE_OFFLINE
    return last in (LiftMode.MODE_AGV, LiftMode.MODE_HUMAN)


ORDERS: Final = part(list(itertools.product(STEPS, repeat=depth(3, 4))), 2)


@pytest.mark.parametrize("served_before", [False, True])
def test_no_order_of_losses_lets_a_door_be_held_or_shown_on_inputs_that_are_stale(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, served_before: bool
) -> None:
    caplog.set_level(logging.CRITICAL)
    for order in ORDERS:
        on = a_door(tmp_path)
        Laws(on, "fire", door_is_fit)
        if served_before:
            on.run(1.0)
            hold(on)
            on.run(1.0)
        walk(on, order, "fire", hold)


def test_no_order_of_losses_lets_a_lift_be_called_or_shown_on_inputs_that_are_stale(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "lift.yaml"
    file.write_text(re.sub(r" *ros_setup: .*\n", "", LIFT.read_text()))
    caplog.set_level(logging.CRITICAL)
    for order in ORDERS:
        on = OnTwoBuses(file)
        Laws(on, "fire_alarm", lift_is_fit)
        on.run(1.0)
        ride(on)
        on.run(1.5)
        assert on.relays(), "the lift is driven before the losses begin"
        walk(on, order, "fire_alarm", ride)

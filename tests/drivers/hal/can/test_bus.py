"""The CAN bus. Frames reach their listeners, errors name a silent bus, and a lost bus recovers."""

import errno
from collections.abc import Iterator
from typing import Any

import can
import pytest

from drivers.hal.can import (
    EXTENDED,
    CanBus,
    CanSettings,
    Frame,
    FrameFilter,
    Slcan,
    named,
    warnings,
)
from tests.drivers.hal.can.far_end import Clock, FarEnd, bus_on, channel, failure, two_ends
from tests.drivers.hal.modbus.module import Time
from tests.waiting import PATIENCE_S

Ends = tuple[CanBus, FarEnd, Time]
SILENT = "no other frames come on the bus either: check power, cable, termination and bitrate"


@pytest.fixture
def ends() -> Iterator[Ends]:
    with two_ends() as made:
        yield made


def heard_by(bus: CanBus, *wanted: FrameFilter) -> list[Frame]:
    """Return a list of frames. The list grows with each arriving frame that a filter accepts."""
    heard: list[Frame] = []
    bus.listen(wanted, lambda frame, at: heard.append(frame))
    return heard


def test_a_frame_goes_to_whoever_wants_its_id_and_to_nobody_else(ends: Ends) -> None:
    bus, far, _ = ends
    seven, any_node = heard_by(bus, FrameFilter(0x707)), heard_by(bus, FrameFilter(0x700, 0x780))
    far.send(0x707, "05")
    far.send(0x70A, "7f")
    far.send(0x123, "01")
    bus.take()
    assert seven == [Frame(0x707, b"\5")]
    assert any_node == [Frame(0x707, b"\5"), Frame(0x70A, b"\x7f")]


def test_a_29_bit_id_differs_from_the_same_11_bit_id(ends: Ends) -> None:
    bus, far, _ = ends
    short, long = heard_by(bus, FrameFilter(0x123)), heard_by(bus, FrameFilter(0x123 | EXTENDED))
    far.send(0x123, "01")
    far.send(0x123, "02", extended=True)
    bus.take()
    assert (short, long) == ([Frame(0x123, b"\1")], [Frame(0x123 | EXTENDED, b"\2")])


def test_remote_frames_and_fd_frames_are_ignored(ends: Ends) -> None:
    bus, far, _ = ends
    heard = heard_by(bus, FrameFilter(0x10))
    far.put(can.Message(arbitration_id=0x10, is_extended_id=False, is_remote_frame=True))
    far.put(can.Message(arbitration_id=0x10, is_extended_id=False, is_fd=True, data=bytes(12)))
    bus.take()
    assert heard == []


def test_what_is_sent_is_on_the_bus_as_it_is(ends: Ends) -> None:
    bus, far, _ = ends
    bus.send(Frame(0x60A, bytes.fromhex("2f00200101000000")))
    bus.send(Frame(0x1806E5F4 | EXTENDED, b"\xaa"))
    assert far.heard() == [(0x60A, "2f00200101000000"), (0x1806E5F4, "aa")]


def test_a_silent_bus_is_distinguished_from_one_on_which_others_speak(ends: Ends) -> None:
    bus, far, clock = ends
    heard_by(bus, FrameFilter(0x70A))
    assert bus.silence() == SILENT
    far.send(0x70B, "05")
    far.send(0x18FF50E5, "00", extended=True)
    bus.take()
    told = "the bus works, and other ids are heard: 0x70B, 0x18FF50E5"
    assert bus.silence() == told
    clock.now += 10
    assert bus.silence() == SILENT


def test_others_are_remembered_up_to_a_bound(ends: Ends) -> None:
    bus, far, _ = ends
    for frame_id in range(5000):
        far.send(frame_id, extended=True)
    bus.take()
    assert len(bus.others()) <= 64
    assert bus.silence().endswith(" …")


def test_frames_that_came_while_we_hung_are_discarded_as_their_age_is_unknown(ends: Ends) -> None:
    bus, far, clock = ends
    heard = heard_by(bus, FrameFilter(1))
    far.send(1, "01")
    clock.now += 5
    bus.take()
    assert heard == []
    far.send(1, "02")
    bus.take()
    assert heard == [Frame(1, b"\2")]


def test_waiting_ends_when_it_is_heard_or_when_the_time_is_up() -> None:
    with two_ends(Clock()) as (bus, far, _):
        heard = heard_by(bus, FrameFilter(1))
        assert bus.wait(lambda: bool(heard), 0.02) is False
        far.send(1)
        assert bus.wait(lambda: bool(heard), PATIENCE_S) is True


# ---- trouble


BUS_OFF_TEXT = (
    "CAN can0: bus-off: the controller has left the bus after too many errors; check bitrate,"
    " termination and cable, and set restart-ms so that it tries again"
)


def test_a_bus_off_is_named_and_pauses_the_bus(ends: Ends) -> None:
    bus, far, clock = ends
    far.trouble(0x40)
    assert failure(bus.take) == BUS_OFF_TEXT
    assert failure(bus.take) == BUS_OFF_TEXT
    assert failure(lambda: bus.send(Frame(1, b""))) == BUS_OFF_TEXT
    clock.now += 0.5
    assert failure(bus.take) == ""
    assert bus.silence() == "the bus has trouble: bus-off"


def test_a_bus_off_is_over_when_a_frame_is_heard_again(ends: Ends) -> None:
    bus, far, clock = ends
    heard = heard_by(bus, FrameFilter(1))
    far.trouble(0x40)
    failure(bus.take)
    clock.now += 0.5
    bus.take()
    far.send(1, "01")
    bus.take()
    assert (heard, bus.silence()) == ([Frame(1, b"\1")], SILENT)


def test_a_bus_off_is_over_when_the_controller_says_that_it_restarts(ends: Ends) -> None:
    bus, far, clock = ends
    far.trouble(0x40)
    failure(bus.take)
    clock.now += 0.5
    bus.take()
    far.trouble(0x100)
    bus.take()
    assert bus.silence() == SILENT


def test_pauses_grow_while_the_bus_stays_off_and_are_short_again_after_a_frame(ends: Ends) -> None:
    bus, far, clock = ends

    def pause() -> float:
        """Return the length (s) of the pause after a bus-off. During the pause calls fail at once."""
        far.trouble(0x40)
        assert failure(bus.take)
        begun_at = clock()
        while failure(bus.take):
            clock.now += 0.25
        return round((clock() - begun_at) * 4) / 4

    assert [pause(), pause(), pause()] == [0.5, 1.0, 2.0]
    far.send(1)
    bus.take()
    assert pause() == 0.5


@pytest.mark.parametrize(
    ("error_id", "text"),
    [
        (0x20, "nobody acknowledges frames"),
        (0x04, "the controller counts many errors"),
        (0x88, "bus errors"),
        (0x01, "frames cannot be sent in time"),
    ],
)
def test_minor_faults_of_the_controller_are_named_where_a_station_is_silent(
    ends: Ends, error_id: int, text: str
) -> None:
    bus, far, clock = ends
    far.trouble(error_id)
    bus.take()
    assert bus.silence() == f"the bus has trouble: {text}"
    clock.now += 10
    assert bus.silence() == SILENT


class Broken(can.BusABC):
    """An interface on which one call fails. `where` names the call."""

    def __init__(self, error: Exception, where: str) -> None:
        super().__init__("broken")
        self._error, self._where = error, where
        if where == "open":
            self.shutdown()
            raise error

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self._where == "recv":
            raise self._error
        return None, False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if self._where == "send":
            raise self._error


def wrapped(code: int) -> Exception:
    """Return python-can's exception for a failed system call with this error code."""
    return can.CanOperationError("Failed", error_code=code)


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (OSError(errno.ENODEV, "x"), "no such interface"),
        (wrapped(errno.ENETDOWN), "the interface is down; sudo ip link set can0 up type can"),
        (OSError(errno.EAFNOSUPPORT, "x"), "this kernel has no CAN; sudo modprobe can-raw"),
        (wrapped(errno.ENOBUFS), "frames pile up because no device acknowledges them"),
        (OSError(errno.EPERM, "x"), "Operation not permitted"),
        (can.CanInitializationError("no\nway"), "no?way"),
        (ValueError("invalid literal"), "invalid literal"),
    ],
)
@pytest.mark.parametrize("where", ["open", "recv", "send"])
def test_an_interface_that_fails_is_named_with_what_to_do_and_paused(
    where: str, error: Exception, text: str
) -> None:
    clock = Clock()
    opened: list[Any] = []

    def vendor() -> can.BusABC:
        opened.append(1)
        return Broken(error, where)

    bus = CanBus(CanSettings(socketcan="can0"), clock, lambda: 0.0, vendor)

    def use() -> None:
        bus.take()
        bus.send(Frame(1, b""))

    first = failure(use)
    assert first.startswith("CAN can0: ")
    assert text in first
    assert failure(use) == first
    assert len(opened) == 1
    clock.now += 0.6
    failure(use)
    assert len(opened) == 2
    bus.insist()
    failure(use)
    assert len(opened) == 3
    bus.close()
    bus.close()


def test_an_interface_that_is_not_there_is_found_when_it_comes() -> None:
    clock, name = Clock(), channel()
    there = False

    def vendor() -> can.BusABC:
        if not there:
            raise OSError(errno.ENODEV, "x")
        return can.Bus(name, interface="virtual")

    bus = CanBus(CanSettings(socketcan="can0"), clock, lambda: 0.0, vendor)
    assert failure(bus.take)
    there = True
    assert failure(bus.take)
    clock.now += 0.6
    assert failure(bus.take) == ""
    bus.close()


def test_closing_lets_go_and_may_be_done_twice() -> None:
    name = channel()
    bus = bus_on(name)
    bus.take()
    bus.close()
    bus.close()
    far = FarEnd(name)
    far.send(1)
    far.close()


# ---- settings


def problems(settings: CanSettings) -> list[tuple[tuple[str, ...], str]]:
    return list(settings.problems())


def test_a_bus_is_one_of_the_two_sorts() -> None:
    place = Slcan(port="/dev/serial/by-id/x", bitrate=250_000)
    assert problems(CanSettings(socketcan="can0")) == []
    assert problems(CanSettings(slcan=place)) == []
    [(nowhere, what)] = problems(CanSettings())
    assert (nowhere, what[:18]) == ((), "needs an interface")
    [(path, text)] = problems(CanSettings(socketcan="can0", slcan=place))
    assert (path, text[:37]) == (("slcan",), "a bus has only one of socketcan and s")


def test_a_bitrate_that_no_adapter_knows_is_a_problem() -> None:
    [(path, text)] = problems(CanSettings(slcan=Slcan(port="/dev/serial/by-id/x", bitrate=251_000)))
    assert path == ("slcan", "bitrate")
    assert text.startswith("slcan adapters know 10000, 20000, ")


def test_a_port_whose_name_may_change_is_worth_a_warning() -> None:
    [(path, text)] = warnings(CanSettings(slcan=Slcan(port="/dev/ttyACM0", bitrate=250_000)))
    assert path == ("slcan", "port")
    assert text.startswith("/dev/ttyACM0 may name another adapter")
    assert list(warnings(CanSettings(socketcan="can0"))) == []


def test_ids_are_written_as_people_write_them() -> None:
    assert [named(0x58A), named(5), named(0x18FF50E5 | EXTENDED)] == [
        "0x58A",
        "0x005",
        "0x18FF50E5",
    ]


def test_nothing_is_given_to_a_cyclic_sender_so_that_a_daemon_that_hangs_is_silent(
    ends: Ends,
) -> None:
    bus, far, _ = ends
    bus.send(Frame(1, b"\1"))
    assert far.heard(wait_s=0.2) == [(1, "01")]

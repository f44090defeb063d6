"""An slcan adapter on a pseudo-terminal: CAN frames on a serial port, and failures of the port."""

import os
import threading
from collections.abc import Iterator

import can
import pytest

from drivers.hal.can import EXTENDED, CanBus, CanSettings, Frame, FrameFilter, Slcan
from hal_fakes.can.side import CanFarSide, Send
from hal_fakes.can.slcan_port import SlcanPort, decoded, encoded
from hal_fakes.plants.charger import ChargerPlant
from hal_fakes.plants.plant import Plant
from tests.drivers.hal.can.far_end import Clock, failure
from tests.waiting import PATIENCE_S, wait_until


class Echo:
    """A station that answers each frame. The answer's id is higher by one."""

    def __init__(self) -> None:
        self.plant: Plant = ChargerPlant("echo", links=["bus"])
        self.heard = 0

    def hear(self, message: can.Message, now: float, send: Send) -> None:
        self.heard += 1
        message.arbitration_id += 1
        message.timestamp = 0.0
        send(message)

    def tick(self, now: float, send: Send) -> None:
        """Do nothing, because the station only answers."""


class Desk:
    """Our bus behind an adapter, and the frames that the bus has heard."""

    def __init__(self) -> None:
        self.echo = Echo()
        self.port = SlcanPort()
        self.side = CanFarSide(self.port, [self.echo], slow_s=0.2)
        self.clock = Clock()
        self.bus = self.opened()
        self.heard: list[Frame] = []
        wanted = [FrameFilter(0x124), FrameFilter(0x18FF50E6 | EXTENDED)]
        self.bus.listen(wanted, lambda frame, at: self.heard.append(frame))

    def opened(self) -> CanBus:
        place = Slcan(port=str(self.port.adapter.path), bitrate=250_000)
        return CanBus(CanSettings(slcan=place, timeout_s=0.3), self.clock, lambda: 0.0)

    def passes(self) -> bool:
        """Send a frame, and return whether the station's answer arrives."""
        self.clock.now += 60
        self.heard.clear()
        if failure(self.bus.take) or failure(lambda: self.bus.send(Frame(0x123, b"\1"))):
            return False
        return failure(lambda: self.bus.wait(lambda: bool(self.heard), 1.0)) == "" and bool(
            self.heard
        )

    def text(self) -> str:
        """Return why the bus does not work, or "" if it works."""
        return failure(self.bus.take)

    def close(self) -> None:
        self.bus.close()
        self.side.close()


@pytest.fixture
def desk() -> Iterator[Desk]:
    made = Desk()
    yield made
    made.close()


def test_frames_go_both_ways(desk: Desk) -> None:
    desk.bus.send(Frame(0x123, b"\1\2"))
    desk.bus.send(Frame(0x18FF50E5 | EXTENDED, bytes(8)))
    assert desk.bus.wait(lambda: len(desk.heard) == 2, PATIENCE_S)
    assert desk.heard == [Frame(0x124, b"\1\2"), Frame(0x18FF50E6 | EXTENDED, bytes(8))]


def test_a_line_is_a_frame_and_a_frame_a_line() -> None:
    for line in ("t12320102", "T18FF50E580000000000000000", "t0000"):
        assert encoded(decoded(line)) == line.encode() + b"\r"


def test_acknowledgements_between_frames_hide_no_frame(desk: Desk) -> None:
    for n in range(50):
        desk.bus.send(Frame(0x123, bytes((n,))))
    assert desk.bus.wait(lambda: len(desk.heard) == 50, PATIENCE_S)
    assert [frame.payload[0] for frame in desk.heard] == list(range(50))


def test_an_adapter_that_is_pulled_is_a_failure_and_is_found_again_when_it_is_back(
    desk: Desk,
) -> None:
    assert desk.passes()
    desk.echo.plant.fail("bus", "off")
    wait_until(lambda: desk.text() != "", "the pulled adapter is noticed")
    desk.clock.now += 60
    wait_until(
        lambda: "the adapter is not there; is it plugged in?" in desk.text(),
        "the text names the missing adapter",
    )
    desk.echo.plant.fail("bus", None)
    wait_until(desk.passes, "the adapter passes frames again")


def test_noise_on_the_adapter_is_a_failure_that_ends_with_the_noise(desk: Desk) -> None:
    assert desk.passes()
    desk.echo.plant.fail("bus", "garbage")
    wait_until(lambda: desk.text() != "", "noise on the adapter is noticed")
    desk.echo.plant.fail("bus", None)
    wait_until(desk.passes, "the adapter passes frames again")


def test_a_bus_that_passes_nothing_is_silent_and_no_failure(desk: Desk) -> None:
    assert desk.passes()
    desk.echo.plant.fail("bus", "stuck")
    wait_until(lambda: not desk.passes(), "the stuck bus returns no frame")
    assert desk.text() == ""


def test_an_adapter_that_another_program_has_is_named(desk: Desk) -> None:
    desk.bus.take()
    other = desk.opened()
    assert failure(other.take).endswith("another program has it open")
    other.close()


def test_an_adapter_that_takes_nothing_costs_one_timeout() -> None:
    leader, follower = os.openpty()
    place = Slcan(port=os.ttyname(follower), bitrate=250_000)
    bus = CanBus(CanSettings(slcan=place, timeout_s=0.05))
    ended = threading.Event()

    def fill() -> None:
        while not failure(lambda: bus.send(Frame(0x123, bytes(8)))):
            pass
        ended.set()

    threading.Thread(target=fill, daemon=True).start()
    assert ended.wait(PATIENCE_S)
    bus.close()
    os.close(leader)
    os.close(follower)


JUNK: list[bytes] = [
    b"\r",
    b"\a",
    b"t\r",
    b"T123\r",
    b"tXYZ10\r",
    b"t1239\r",
    b"t12380102\r",
    b"t1231zz\r",
    b"\xff\xfe\r",
    b"r1230\r",
    b"d1239" + b"00" * 12 + b"\r",
    b"z\r",
    b"V1013\r",
    b"t1240\rt",
]


@pytest.mark.parametrize("junk", JUNK)
def test_whatever_an_adapter_says_is_a_frame_or_a_failure_and_never_breaks_us(
    junk: bytes,
) -> None:
    leader, follower = os.openpty()
    place = Slcan(port=os.ttyname(follower), bitrate=250_000)
    clock = Clock()
    bus = CanBus(CanSettings(slcan=place, timeout_s=0.05), clock, lambda: 0.0)
    heard: list[Frame] = []
    bus.listen([FrameFilter(0x321)], lambda frame, at: heard.append(frame))
    bus.take()
    os.write(leader, junk)

    def again() -> bool:
        clock.now += 60
        failure(bus.take)
        os.write(leader, b"\rt32110A\r")
        failure(lambda: bus.wait(lambda: bool(heard), 0.05))
        return bool(heard)

    wait_until(again, "a good frame is heard after the nonsense")
    assert set(heard) == {Frame(0x321, b"\x0a")}
    bus.close()
    os.close(leader)
    os.close(follower)

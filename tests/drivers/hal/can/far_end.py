"""Tools for tests of the CAN bus: a `virtual` bus of python-can, and its far end."""

import itertools
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import can

from drivers import DriverError
from drivers.hal.can import CanBus, CanSettings
from tests.drivers.hal.modbus.module import Time

_numbers = itertools.count()


def channel() -> str:
    """Return the name of a virtual bus that nobody else uses."""
    return f"test-{next(_numbers)}"


class Clock(Time):
    """Real time plus jumps into the future. `now` is the sum of the jumps (s)."""

    def __call__(self) -> float:
        return time.monotonic() + self.now


def data_frame(frame_id: int, payload: str, extended: bool = False) -> can.Message:
    """Return a data frame. The payload has hexadecimal digits."""
    data = bytes.fromhex(payload)
    return can.Message(arbitration_id=frame_id, is_extended_id=extended, data=data)


class FarEnd:
    """The far end of the bus. The test sends any frame from here, and reads our frames here."""

    def __init__(self, channel: str) -> None:
        self._bus = can.Bus(channel, interface="virtual")

    def send(self, frame_id: int, payload: str = "", extended: bool = False) -> None:
        """Send a data frame. The payload has hexadecimal digits."""
        self._bus.send(data_frame(frame_id, payload, extended))

    def trouble(self, error_id: int) -> None:
        """Send an error frame, as SocketCAN does to report trouble of a controller."""
        data = bytes(8)
        self._bus.send(can.Message(arbitration_id=error_id, is_error_frame=True, data=data, dlc=8))

    def put(self, message: can.Message) -> None:
        """Send any frame."""
        self._bus.send(message)

    def heard(self, wait_s: float = 0.0) -> list[tuple[int, str]]:
        """Return our frames so far, as (id, payload in hexadecimal digits)."""
        found = []
        while (message := self._bus.recv(wait_s)) is not None:
            found.append((message.arbitration_id, bytes(message.data).hex()))
        return found

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


def bus_on(
    channel: str, clock: Callable[[], float] | None = None, *, timeout_s: float = 0.1
) -> CanBus:
    """Return our bus. After a failure the bus pauses. `clock` measures these pauses, whose lengths are
    not random."""
    settings = CanSettings(socketcan="can0", timeout_s=timeout_s, scan_s=0.05)
    vendor = lambda: can.Bus(channel, interface="virtual")  # noqa: E731
    return CanBus(settings, clock or time.monotonic, lambda: 0.0, vendor)


@contextmanager
def two_ends(clock: Time | None = None) -> Iterator[tuple[CanBus, FarEnd, Time]]:
    """Yield our bus, its far end, and the clock of our bus.

    The clock stands still. So no timeout expires on a busy machine.
    """
    name, clock = channel(), clock or Time()
    far, bus = FarEnd(name), bus_on(name, clock, timeout_s=0.05)
    bus.take()
    try:
        yield bus, far, clock
    finally:
        bus.close()
        far.close()


class Reactive(can.BusABC):
    """A bus in virtual time. The stations on the bus answer at once. A wait takes no real time, but
    adds to `now`.

    The frames in `later` arrive only during a wait.
    """

    def __init__(self) -> None:
        super().__init__("reactive")
        self.now = 0.0
        self.react: Callable[[can.Message], list[can.Message]] = lambda message: []
        self.coming: deque[can.Message] = deque()
        self.later: list[can.Message] = []

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if self.coming:
            return self.coming.popleft()
        if timeout and self.later:
            return self.later.pop(0)
        self.now += (timeout or 0.0) + 1e-6
        return None

    def say(self, frame_id: int, payload: str = "", extended: bool = False) -> None:
        """Let a station send this frame without a request. The payload has hexadecimal digits."""
        self.coming.append(data_frame(frame_id, payload, extended))

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.coming.extend(self.react(msg))

    def bus(self) -> CanBus:
        place = CanSettings(socketcan="can0", timeout_s=0.05, scan_s=0.05)
        return CanBus(place, lambda: self.now, lambda: 0.0, lambda: self)

    def shutdown(self) -> None:
        """Keep the bus alive, so that the driver can open the same bus again."""
        self._is_shutdown = True


def failure(call: Callable[[], object]) -> str:
    """Return the text of the DriverError that this call raises, or "" without an error."""
    try:
        call()
    except DriverError as error:
        return str(error)
    return ""

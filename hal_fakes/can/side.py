"""The far side of a CAN bus: a medium (the wire) with stations. They run in a thread of their own.

Within one process the medium is python-can's `virtual` bus. Across processes the medium is an slcan
adapter on a pseudo-terminal (`hal_fakes/can/slcan_port.py`). Each plant on the medium has a part `bus`,
which fails in the ways of a bus:

- `off`: the adapter is unplugged; a virtual bus is silent
- `stuck`: nothing passes in either direction
- `slow`: every frame from the far side comes too late
- `garbage`: an adapter sends bytes that are not slcan; a virtual bus sends random frames
- `wrong`: the controller reports bus-off; an adapter cannot report bus-off, so an adapter passes only
  frames of other stations
"""

import heapq
import itertools
import random
import threading
import time
from collections.abc import Sequence
from typing import Final, Protocol

import can

from drivers.hal.can import CanSettings
from hal_fakes.plants.plant import FailureMode, Plant

LOOK_S: Final = 0.02
"""The longest time (s) between two checks of the far side. Ordered failures, heartbeats and status
frames may be late by this time."""
BUS_OFF: Final = 0x40
SLOWNESS: Final = 1.5
"""The delay of a slow answer, as a multiple of the client's timeout."""


def slow_s(settings: CanSettings) -> float:
    """Return the delay (s) of a slow answer on this bus."""
    return SLOWNESS * settings.timeout_s


class Medium(Protocol):
    """The wire of the simulated bus. `replace` has the settings with which the real bus finds this
    wire."""

    replace: dict[str, object]

    def receive(self, wait_s: float) -> can.Message | None:
        """Return the daemon's next frame. Return None if no frame comes within `wait_s`."""

    def send(self, message: can.Message) -> None:
        """Send a frame to the daemon. The frame is lost if no program has the bus open."""

    def fail(self, mode: FailureMode | None) -> None:
        """Fail in this mode from now on. None ends the failure. The far side calls `fail` often."""

    def close(self) -> None:
        """End the medium. The caller may call `close` twice."""


class Send(Protocol):
    """The function with which a station sends."""

    def __call__(self, message: can.Message, late: bool = False) -> None:
        """Send a frame now. With `late`, send it after the daemon has stopped waiting."""


class CanStation(Protocol):
    """One controller on the bus, with its plant behind it."""

    plant: Plant

    def hear(self, message: can.Message, now: float, send: Send) -> None:
        """Take a frame from the daemon."""

    def tick(self, now: float, send: Send) -> None:
        """Send every frame that is due. The far side calls this often."""


class VirtualBus:
    """python-can's `virtual` bus. Both sides open the bus under the name `channel`.

    `interface` may name another interface of python-can, such as `socketcan` with the channel vcan0.
    """

    def __init__(self, channel: str, interface: str = "virtual") -> None:
        self.replace: dict[str, object] = {}
        self._bus: can.BusABC | None = can.Bus(channel, interface=interface)
        self._noise = random.Random("can")
        self._off_told = False

    def receive(self, wait_s: float) -> can.Message | None:
        """Return the next frame."""
        return self._bus.recv(wait_s) if self._bus else None

    def send(self, message: can.Message) -> None:
        """Send a frame to every program that has the channel open."""
        if self._bus:
            self._bus.send(message)

    def fail(self, mode: FailureMode | None) -> None:
        """Send noise in the mode `garbage`. Report each bus-off once, and the end of each bus-off
        once."""
        if mode == "garbage":
            self.send(any_frame(self._noise))
        if (mode == "wrong") != self._off_told:
            self._off_told = mode == "wrong"
            found = BUS_OFF if self._off_told else 0x100
            self.send(can.Message(arbitration_id=found, is_error_frame=True, dlc=8, data=bytes(8)))

    def close(self) -> None:
        """Leave the channel."""
        bus, self._bus = self._bus, None
        if bus:
            bus.shutdown()


def any_frame(noise: random.Random) -> can.Message:
    """Make a random frame."""
    extended = noise.random() < 0.5
    return can.Message(
        arbitration_id=noise.randrange(1 << (29 if extended else 11)),
        is_extended_id=extended,
        data=noise.randbytes(noise.randrange(9)),
    )


class CanFarSide:
    """The simulated stations on a CAN bus, while they run. `replace` has the bus's settings (interface,
    channel) that take the place of the YAML's, so that the daemon's bus meets these stations.

    `slow_s` is the delay (s) of a late frame, and of every frame on a slow bus.
    """

    def __init__(self, medium: Medium, stations: Sequence[CanStation], slow_s: float) -> None:
        self.replace = medium.replace
        self._medium = medium
        self._stations = stations
        self._slow_s = slow_s
        self._order = itertools.count()
        self._due: list[tuple[float, int, can.Message]] = []
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="can", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the far side. The caller may call `close` twice."""
        self._closed.set()
        self._thread.join()
        self._medium.close()

    def _run(self) -> None:
        while not self._closed.is_set():
            mode = self._failure()
            self._medium.fail(mode)
            message = self._medium.receive(self._idle_s())
            now = time.monotonic()
            passes = mode not in ("off", "stuck", "wrong")
            if message is not None and passes:
                for station in self._stations:
                    station.hear(message, now, self._post(mode, now))
            for station in self._stations:
                station.tick(now, self._post(mode, now))
            self._say(passes)

    def _failure(self) -> FailureMode | None:
        modes = (station.plant.failures.get("bus") for station in self._stations)
        return next((mode for mode in modes if mode is not None), None)

    def _idle_s(self) -> float:
        next_at = self._due[0][0] if self._due else float("inf")
        return min(LOOK_S, max(0.0, next_at - time.monotonic()))

    def _post(self, mode: FailureMode | None, now: float) -> Send:
        def post(message: can.Message, late: bool = False) -> None:
            at = now + (self._slow_s if late or mode == "slow" else 0.0)
            heapq.heappush(self._due, (at, next(self._order), message))

        return post

    def _say(self, passes: bool) -> None:
        while self._due and self._due[0][0] <= time.monotonic():
            message = heapq.heappop(self._due)[2]
            if passes:
                self._medium.send(message)

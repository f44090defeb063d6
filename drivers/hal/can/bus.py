"""One CAN bus through python-can. The bus is on an interface of the kernel (SocketCAN) or on an slcan
adapter.

Everything runs in the loop's thread. A reading takes all frames that came since the last reading. The
bus gives each frame to the devices that listen to its id. For some seconds the bus remembers the ids to
which no device listens, because errors about missing frames name these ids. Only a scan sends frames.
No cyclic sender of the kernel or of the library sends frames. So a daemon that hangs sends nothing.

If the interface is down, gone or bus-off, the bus closes it and opens it again after a backoff of 0.5
to 30 s. Calls during the backoff fail at once. A bus-off is over when the next frame comes, or when the
controller reports a restart. `restart-ms` of `ip link` makes the controller restart.
"""

import random
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

from bridges.system.machine_time import machine_s
from drivers.hal import Bus, HalError
from drivers.hal.backoff import Backoff
from drivers.hal.can.frames import Frame, FrameFilter, Hear, LinkDown, Trouble, named
from drivers.hal.can.settings import CanSettings

if TYPE_CHECKING:
    from drivers.hal.can.link import Link, Vendor

FRAMES_AT_ONCE: Final = 20_000
"""The maximum number of frames in a reading. A bus at 1 Mbit/s has about 8,000 frames a second."""
HANG_S: Final = 1.0
"""The longest delay (s) of a reading beyond the scan period. A longer delay means that the daemon has
hung."""
ROUTES_MAX: Final = 4096
RECENT_S: Final = 5.0
OTHERS_MAX: Final = 64
OTHERS_SHOWN: Final = 5


class CanBus(Bus):
    """One bus and its devices. Tests replace `clock`, `jitter` and `vendor`."""

    def __init__(
        self,
        settings: CanSettings,
        clock: Callable[[], float] = machine_s,
        jitter: Callable[[], float] = random.random,
        vendor: "Vendor | None" = None,
    ) -> None:
        self.settings = settings
        self.now = clock
        self.where = settings.slcan.port if settings.slcan else str(settings.socketcan)
        self._link = _link(settings, self.where, vendor, clock)
        self._jitter = jitter
        self._backoffs = [Backoff(clock, jitter)]
        self._wanted: list[tuple[FrameFilter, Hear]] = []
        self._routes: dict[int, tuple[Hear, ...]] = {}
        self._others: dict[int, float] = {}
        self._trouble = Trouble("", bus_off=False)
        self._trouble_at = float("-inf")
        self._failing = False
        self._taken_at = float("-inf")
        self._deaf = False

    def backoff(self) -> Backoff:
        """Return a new backoff for one device. `insist` of the bus reaches this backoff too."""
        made = Backoff(self.now, self._jitter)
        self._backoffs.append(made)
        return made

    def listen(self, wanted: Iterable[FrameFilter], hear: Hear) -> None:
        """Call `hear` with each received frame that one of these filters lets pass, until the bus is
        closed."""
        self._wanted += [(one, hear) for one in wanted]
        self._routes.clear()
        self._others.clear()

    def take(self) -> None:
        """Distribute the frames that came since the last call. Raises HalError.

        If the daemon has hung since the last call (HANG_S), drop these frames, because their age is
        unknown.
        """
        self._deaf = self.now() - self._taken_at > HANG_S + self.settings.scan_s
        try:
            for _ in range(FRAMES_AT_ONCE):
                if not self._step(0.0):
                    break
        finally:
            self._deaf, self._taken_at = False, self.now()

    def wait(self, heard: Callable[[], bool], within_s: float) -> bool:
        """Take frames until `heard()` is true, or for at most `within_s` seconds. Return whether
        `heard()` became true. Raises HalError."""
        deadline = self.now() + within_s
        while not heard():
            left_s = deadline - self.now()
            if left_s <= 0:
                return False
            try:
                self._step(left_s)
            finally:
                self.calls += 1
            self._taken_at = self.now()
        return True

    def send(self, frame: Frame) -> None:
        """Send a frame. Raises HalError. After an error the frame may have been sent."""
        self._open()
        try:
            self._link.send(frame)
        except LinkDown as error:
            raise self._failed(str(error)) from error

    def silence(self) -> str:
        """Describe a likely cause of a device's silence, such as trouble on the bus, or ids that no
        device wants."""
        if self._trouble.text and (
            self._trouble.bus_off or self.now() - self._trouble_at < RECENT_S
        ):
            return f"the bus has trouble: {self._trouble.text}"
        others = self.others()
        if not others:
            return "no other frames come on the bus either: check power, cable, termination and bitrate"
        shown = ", ".join(map(named, others[:OTHERS_SHOWN]))
        return f"the bus works, and other ids are heard: {shown}{' …' if others[OTHERS_SHOWN:] else ''}"

    def others(self) -> list[int]:
        """Return the ids that no device wants and that were heard in the last RECENT_S seconds."""
        now = self.now()
        return sorted(found for found, at in self._others.items() if now - at < RECENT_S)

    def insist(self) -> None:
        """Let the next call skip the backoff, so that outputs go off before the daemon ends."""
        for backoff in self._backoffs:
            backoff.insist()

    def close(self) -> None:
        """Close the interface."""
        self._link.close()

    def _open(self) -> None:
        self._backoffs[0].check()
        try:
            self._link.open()
        except LinkDown as error:
            raise self._failed(str(error)) from error

    def _step(self, wait_s: float) -> bool:
        """Receive one frame or one report of a bus trouble. Return False if neither came."""
        self._open()
        try:
            found = self._link.receive(wait_s)
        except LinkDown as error:
            raise self._failed(str(error)) from error
        if isinstance(found, Trouble):
            self._note(found)
        elif found is not None and not self._deaf:
            self._give(found)
        return found is not None

    def _give(self, frame: Frame) -> None:
        if self._failing or self._trouble.text:
            self._well()
        routes = self._routes.get(frame.id)
        if routes is None:
            routes = self._route(frame.id)
        now = self.now()
        for hear in routes:
            hear(frame, now)
        if not routes and (frame.id in self._others or len(self._others) < OTHERS_MAX):
            self._others[frame.id] = now

    def _route(self, frame_id: int) -> tuple[Hear, ...]:
        if len(self._routes) >= ROUTES_MAX:
            self._routes.clear()
            self._others.clear()
        made = tuple(hear for wanted, hear in self._wanted if wanted.fits(frame_id))
        self._routes[frame_id] = made
        return made

    def _note(self, trouble: Trouble) -> None:
        """Record the controller's report that a trouble of the bus has begun or ended."""
        self._trouble, self._trouble_at = trouble, self.now()
        if trouble.bus_off:
            raise self._failed(
                f"CAN {self.where}: bus-off: the controller has left the bus after too many errors;"
                " check bitrate, termination and cable, and set restart-ms so that it tries again"
            )
        if not trouble.text:
            self._well()

    def _well(self) -> None:
        self._failing, self._trouble = False, Trouble("", bus_off=False)
        self._backoffs[0].mended()

    def _failed(self, text: str) -> HalError:
        self._failing = True
        self._link.close()
        return self._backoffs[0].failed(text)


def _link(
    settings: CanSettings, where: str, vendor: "Vendor | None", clock: Callable[[], float]
) -> "Link":
    """Return the link to the bus. Only this function imports python-can."""
    from drivers.hal.can.link import Link, slcan, socketcan

    place = settings.slcan
    made = (lambda: slcan(place)) if place else (lambda: socketcan(where))
    return Link(vendor or made, where, settings.timeout_s, clock)

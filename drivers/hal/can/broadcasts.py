"""A device that broadcasts its frames, and works only while it receives periodic frames.

A received frame is valid only for a certain time. The scan loop itself sends the periodic frames. There
is no cyclic sender beside the loop. So the frames cease when the daemon hangs.
"""

from collections.abc import Callable, Collection, Mapping
from typing import NamedTuple

from drivers.hal import HalError
from drivers.hal.can.bus import CanBus
from drivers.hal.can.frames import EXTENDED, Frame, FrameFilter, named

NEVER = float("-inf")


class Said(NamedTuple):
    """A frame that the device sends. `mask` has a 1 for each bit of the id that must equal `id`.
    `length` is the payload's length in bytes.

    `fresh_s` is the time (s) for which a received frame is valid. If `needed` is true, a reading fails
    without this frame.
    """

    id: int
    mask: int
    length: int
    fresh_s: float
    needed: bool


Values = Mapping[str, float]
"""The value of each signal. A key is the frame's name, a dot, and the signal's name."""


class Sequel(NamedTuple):
    """The frames that explain a certain state in another frame. For example, error frames give the
    cause of an error state, and may come later than the state.

    `first` is the name of the frame with the state, and `others` are the names of the explaining
    frames. `begins(values)` returns whether the state now needs an explanation. `is_told(values)`
    returns whether the explanation has come.
    """

    first: str
    others: Collection[str]
    begins: Callable[[Values], bool]
    is_told: Callable[[Values], bool]


class Broadcasts:
    """The frames of one device, by their names. `decode(frame, payload)` must return the value of each
    signal in a payload."""

    def __init__(
        self,
        bus: CanBus,
        frames: Mapping[str, Said],
        decode: Callable[[str, bytes], Values],
        sequel: Sequel,
    ) -> None:
        self._bus = bus
        self._frames = frames
        self._decode = decode
        self._sequel = sequel
        self._begun = False
        self._pause = bus.backoff()
        self._heard: dict[str, tuple[bytes, float]] = {}
        self._odd: dict[str, str] = {}
        self._sent_at: dict[int, float] = {}
        for name, said in frames.items():
            bus.listen(
                [FrameFilter(said.id, said.mask | EXTENDED)], self._hearer(name, said.length)
            )

    def read(self) -> dict[str, float]:
        """Return the value of each signal in all fresh frames. Raises HalError, and the errors of
        `decode`.

        If a needed frame is missing, the call waits for this frame. If the first frame of `Sequel` has
        just begun to show a state that needs an explanation, the call waits once for the explaining
        frames.
        """
        self._bus.take()
        if self._missing():
            self._pause.check()
            if not self._bus.wait(lambda: not self._missing(), self._bus.settings.timeout_s):
                raise self._pause.failed(self._silent())
        else:
            self._odd.clear()
        self._pause.mended()
        values = self._values()
        before, self._begun = self._begun, self._sequel.begins(values)
        if self._begun and not before and not self._sequel.is_told(values):
            self._wait_for_sequel()
            values = self._values()
        return values

    def _wait_for_sequel(self) -> None:
        since = self._at(self._sequel.first)
        self._bus.wait(
            lambda: all(self._at(name, since) > since for name in self._sequel.others),
            self._bus.settings.timeout_s,
        )

    def check_pace(self, frame: str, every_s: float) -> None:
        """Raise HalError if `scan_s` is too long to send this frame on time."""
        scan_s = self._bus.settings.scan_s
        if every_s < scan_s:
            raise HalError(
                f"{frame} must be sent every {every_s:g} s, and a scan is"
                f" every {scan_s:g} s: set the bus's scan_s to {every_s:g} or less"
            )

    def feed(self, frame_id: int, every_s: float, payload: Callable[[], bytes]) -> bool:
        """Send a frame if the frame is due in this scan. Return whether the frame was sent. Raises
        HalError."""
        now, slack_s = self._bus.now(), self._bus.settings.scan_s / 2
        if now < self._sent_at.get(frame_id, NEVER) + every_s - slack_s:
            return False
        self._bus.send(Frame(frame_id, payload()))
        self._sent_at[frame_id] = now
        return True

    def feed_at_once(self) -> None:
        """Make every frame due at once. The caller does this when the contents of the frames change."""
        self._sent_at.clear()

    def _hearer(self, name: str, length: int) -> Callable[[Frame, float], None]:
        def hear(heard: Frame, at: float) -> None:
            if len(heard.payload) == length:
                self._heard[name] = (heard.payload, at)
            else:
                size = f"{len(heard.payload)} bytes instead of the map's {length}"
                self._odd[name] = f"one ({named(heard.id)}) of {size}"

        return hear

    def _at(self, name: str, otherwise: float = NEVER) -> float:
        return self._heard[name][1] if name in self._heard else otherwise

    def _is_fresh(self, name: str) -> bool:
        return self._bus.now() - self._at(name) < self._frames[name].fresh_s

    def _values(self) -> dict[str, float]:
        fresh = ((name, said) for name, (said, _) in self._heard.items() if self._is_fresh(name))
        return {
            f"{name}.{signal}": value
            for name, payload in fresh
            for signal, value in self._decode(name, payload).items()
        }

    def _missing(self) -> str:
        """Return the first needed frame that is not fresh. Return "" if all needed frames are fresh."""
        needed = (name for name, said in self._frames.items() if said.needed)
        return next((name for name in needed if not self._is_fresh(name)), "")

    def _silent(self) -> str:
        name = self._missing()
        said = self._frames[name]
        text = f"no {name} ({named(said.id)}) at {self._bus.where} within {said.fresh_s:g} s"
        if odd := self._odd.pop(name, ""):
            return f"{text}, but {odd}: is the device of another make?"
        return f"{text}: {self._bus.silence()}"

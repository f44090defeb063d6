"""The inputs of a device that are on another bus than the device itself. The other bus's thread reads
these inputs, and the device's thread takes the values.

The two threads share one Handover, which holds the last reading. The device's thread never waits for a
reading. So a dead bus delays no other bus. If the last reading is late or failed, the device counts as
not read, as if a cable of the device's own bus were cut.
"""

import logging
from collections.abc import Callable, Iterable, Mapping

from msgspec import Struct

from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.runtime.clock import Clock
from bridges.runtime.contained import Contained
from bridges.system.log import pairs
from drivers import DriverError
from drivers.hal.points import Points

log = logging.getLogger(__name__)


class OtherReading(Struct, frozen=True):
    """One reading of the inputs.

    - `shown`: for each signal, whether it is asserted
    - `read_at`: the time (monotonic s) just before the reading
    - `why_not`: the reason why nothing was read, or ""
    """

    shown: Mapping[str, bool] = {}
    read_at: float = AGES_AGO
    why_not: str = "not read yet"


class Handover:
    """The last reading of one device's inputs on another bus. One thread writes the reading, and one
    other thread reads it.

    `lasts_s`: the time (s) for which a reading is valid. `changed`: a callback that the writing thread
    calls after a change.
    """

    def __init__(self, bus: str, lasts_s: float, clock: Clock) -> None:
        self.changed: Callable[[], None] = lambda: None
        self._bus = bus
        self._lasts_s = lasts_s
        self._clock = clock
        self._last = OtherReading()

    def put(self, reading: OtherReading) -> None:
        """Replace the last reading."""
        before, self._last = self._last, reading
        if (before.shown, before.why_not) != (reading.shown, reading.why_not):
            self.changed()

    def take(self) -> Mapping[str, bool]:
        """Return the present inputs. Raises DriverError if the last reading is late or failed."""
        last = self._last
        late = self._clock.monotonic() > last.read_at + self._lasts_s
        if why := last.why_not or (f"not read for {self._lasts_s:g} s" if late else ""):
            raise DriverError(f"bus {self._bus}: {why}")
        return last.shown


def taken(handovers: Iterable[Handover]) -> dict[str, bool]:
    """Return the present inputs on all other buses. Raises DriverError if the last reading of one bus
    is late or failed."""
    return {signal: on for one in handovers for signal, on in one.take().items()}


class InputReader:
    """The reader of one device's inputs on another bus. The loop of that bus
    (`bridges/runtime/loop.py`) calls it."""

    def __init__(self, device: str, bus: str, points: Points, to: Handover, clock: Clock) -> None:
        self.name = device
        self.wake_at = AGES_AGO
        self.ready = False
        self.answers = False
        self._points = Contained(f"{device} on {bus}", points, clock)
        self._about = {"device": device, "bus": bus}
        self._to = to
        self._clock = clock
        self._open = False

    def was_suspended(self, for_s: float) -> None:
        """Note that nothing was read for `for_s` (s)."""
        self._to.put(OtherReading(why_not=f"nothing was read for {for_s:.1f} s"))

    def scan(self, events: Iterable[object] = ()) -> None:
        """Read every input once, and hand over the values. If reading fails, hand over the reason."""
        before = self.answers or not self.ready
        reading = self._read()
        self._to.put(reading)
        self.answers, self.ready, self.wake_at = not reading.why_not, True, NEVER
        if before and not self.answers:
            log.error(pairs("inputs_lost", **self._about, reason=reading.why_not))
        elif self.answers and not before:
            log.info(pairs("inputs_back", **self._about))

    def _read(self) -> OtherReading:
        at = self._clock.monotonic()
        try:
            if not self._open:
                self._points.open()
            self._open = True
            return OtherReading(self._points.read(), at, why_not="")
        except DriverError as error:
            self._open = False
            return OtherReading(why_not=str(error) or type(error).__name__)

    def make_safe(self) -> bool:
        """Return True, because a reader has no outputs."""
        return True

    def close(self) -> None:
        """Release the inputs."""
        self._points.close()

"""A device's inputs on another bus than its own: that bus's thread reads them, the device's takes them.

The two threads share one Handover. A dead bus delays no other bus, because the device's thread only
looks at the last reading. If that reading is late or failed, the device counts as not read: the device
then has the same fate as with a cut cable on its own bus.
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
    """One reading: signal -> asserted, and the time just before it (monotonic s). `why_not`: the reason
    if there is none."""

    shown: Mapping[str, bool] = {}
    read_at: float = AGES_AGO
    why_not: str = "not read yet"


class Handover:
    """The last reading of one device's inputs on another bus, with one writer and one reader.

    `lasts_s`: how long a reading counts as present (s). `changed` is called from the writer's thread.
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
        """Return the present inputs. Raises DriverError if they are not known now."""
        last = self._last
        late = self._clock.monotonic() > last.read_at + self._lasts_s
        if why := last.why_not or (f"not read for {self._lasts_s:g} s" if late else ""):
            raise DriverError(f"bus {self._bus}: {why}")
        return last.shown


def taken(handovers: Iterable[Handover]) -> dict[str, bool]:
    """Return the present inputs on all other buses. Raises DriverError if one bus is not read now."""
    return {signal: on for one in handovers for signal, on in one.take().items()}


class InputReader:
    """Reads one device's inputs in the rounds of their bus (`bridges/runtime/loop.py`)."""

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
        """Read every input once and hand the values over, or the reason why there are none."""
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
        """Do nothing: there are no outputs here."""
        return True

    def close(self) -> None:
        """Release the inputs."""
        self._points.close()

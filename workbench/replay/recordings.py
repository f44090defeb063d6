"""Functions that all commands on a recording share. They select the part to read, report an unreadable
recording, and skip samples that bring nothing new."""

import argparse
import os
import re
from collections import Counter, OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from bridges.blackbox.incident import OWN_TOPICS
from bridges.messages import topics
from bridges.messages.heard import Heard, Own
from workbench.explain import noted
from workbench.graph.join import complain
from workbench.replay.bags import Keep, all_in
from workbench.replay.sources import BagError, Notes

CLOCK = re.compile(r"(?:(\d{4}-\d\d-\d\d)[ T])?(\d\d?):(\d\d)(?::(\d\d(?:\.\d+)?))?")
SAME_S = 2.4
"""Time (s) after which a diagnostics sample is taken even if only its numbers have changed. A daemon
counts as silent after 3 s, so this time is shorter."""
STAMPED = 12
"""Number of bytes before a DiagnosticArray's status, which are CDR's head and the stamp (OMG DDSI-RTPS
10.2; Header)."""
MOST_TOLD = 512
FIRST_OF_OTHERS = 300
COORDINATOR = b"charger_coordinator"


@dataclass(frozen=True, slots=True)
class TypedTime:
    """A time as the user typed it: seconds after the recording's beginning, or a local time of day. If
    `day` is None, the recording's first day is meant."""

    after_s: float | None = None
    day: str | None = None
    of_day_s: float = 0.0

    def past_s(self, heard: Heard | Own, first: Heard | Own) -> float:
        """Return how long (s) after this time a message was heard. The result is negative before this
        time. `first`: the recording's first message.

        Seconds after the beginning count by a clock that never steps. The wall clock may step, for
        example when a machine without a battery for its clock gets the time from the network.
        """
        if self.after_s is not None:
            return heard.at - first.at - self.after_s
        return heard.wall - self._wall(first.wall)

    def _wall(self, began: float) -> float:
        """Return the time of day (s since the epoch). `began` is the recording's beginning (s since the
        epoch)."""
        day = datetime.fromisoformat(self.day) if self.day else datetime.fromtimestamp(began)
        midnight = day.replace(hour=0, minute=0, second=0, microsecond=0)
        return (midnight + timedelta(seconds=self.of_day_s)).timestamp()


@dataclass(slots=True)
class RecordingSpan:
    """The part of a recording to read. `begins_at` is the time (s) at which this part begins, by the
    clock of `Heard.at`."""

    from_: TypedTime | None
    to: TypedTime | None
    begins_at: float = float("-inf")


def unreadable(command: str, error: BagError) -> int:
    """Print the reason why the recording cannot be read. Return the exit code, which is 66 for every
    command."""
    complain(command, error)
    return os.EX_NOINPUT


def add_span_arguments(parser: argparse.ArgumentParser) -> None:
    """Add `--from` and `--to`."""
    times = (
        "14:03, 14:03:07, '2026-11-22 14:03' (this machine's time), or +90 (s after the beginning)"
    )
    parser.add_argument(
        "--from", dest="from_", type=_time, metavar="TIME", help=f"begin then: {times}"
    )
    parser.add_argument("--to", type=_time, metavar="TIME", help="end then")


def _time(text: str) -> TypedTime:
    """Parse a time. Raises ArgumentTypeError."""
    found = CLOCK.fullmatch(text)
    try:
        if found is None:
            return TypedTime(after_s=_plus(text))
        day, hour, minute, second = found.groups()
        if day:
            datetime.fromisoformat(day)
        if int(hour) > 23 or int(minute) > 59 or float(second or 0) >= 60:
            raise ValueError
    except ValueError:
        why = "write 14:03:07, '2026-11-22 14:03:07', or +90 for 90 s after the beginning"
        raise argparse.ArgumentTypeError(f"'{text}' is not a time: {why}") from None
    return TypedTime(None, day, int(hour) * 3600.0 + int(minute) * 60.0 + float(second or 0))


def _plus(text: str) -> float:
    if not re.fullmatch(r"\+\d{1,9}(\.\d+)?", text):
        raise ValueError(text)
    return float(text)


class Sieve:
    """A filter that chooses the samples to decode, for one device. The name "" stands for all devices.

    Diagnostics come each second and seldom change. A sample may differ from the node's last sample only
    in numbers, such as ages and counts. The sieve takes only one such sample every SAME_S. The sieve
    also takes the first samples of other devices, because explanations list the other devices' names.
    """

    def __init__(self, name: str) -> None:
        self._name = name.encode(errors="replace")
        self._others: Counter[str] = Counter()
        self._told: OrderedDict[bytes, float] = OrderedDict()

    def keep(self, topic: str, sample: bytes, at: float) -> bool:
        """Return whether to decode this sample."""
        if topic.startswith(OWN_TOPICS) and topic.removeprefix(OWN_TOPICS) not in noted.TOPICS:
            return False
        if self._name not in sample and not self._is_common(topic, sample):
            self._others[topic] += 1
            return self._others[topic] <= FIRST_OF_OTHERS
        return topic != topics.DIAGNOSTICS.name or self._is_news(sample, at)

    def _is_common(self, topic: str, sample: bytes) -> bool:
        """Return whether the topic concerns all devices. The heartbeat of the door supervisor does: if
        the heartbeat does not list a door, this tells that nobody holds the door."""
        return topic == topics.DOOR_SUPERVISOR_HEARTBEAT.name or COORDINATOR in sample

    def _is_news(self, sample: bytes, at: float) -> bool:
        essence = sample[STAMPED:].translate(None, b"0123456789")
        if 0 <= at - self._told.get(essence, float("-inf")) < SAME_S:
            return False
        self._told[essence] = at
        self._told.move_to_end(essence)
        if len(self._told) > MOST_TOLD:
            self._told.popitem(last=False)
        return True


def told_between(
    path: Path, span: RecordingSpan, command: str, device: str
) -> Iterator[Heard | Own]:
    """Yield messages and our recorder's texts about the device, from the same part as `between`. ""
    stands for all devices.

    The `Sieve` skips messages that differ little from second to second.
    """
    return between(path, span, command, Sieve(device).keep)


def between(
    path: Path, span: RecordingSpan, command: str, keep: Keep | None = None
) -> Iterator[Heard | Own]:
    """Yield a recording from its beginning to the end of the span. Earlier states are included, because
    an earlier state may still hold in the span.

    Damage is printed on standard error. Raises BagError.
    """
    notes, first = Notes(), None
    for heard in all_in(path, notes, keep):
        first = first or heard
        has_begun = span.begins_at > float("-inf")
        if span.from_ and not has_begun and span.from_.past_s(heard, first) >= 0:
            span.begins_at = heard.at
        if span.to and span.to.past_s(heard, first) > 0:
            break
        yield heard
    if notes.damage:
        complain(command, notes.damage)


def within(path: Path, span: RecordingSpan, command: str) -> Iterator[Heard]:
    """Yield all messages inside the span. Damage is printed on standard error. Raises BagError."""
    for heard in between(path, span, command):
        has_begun = span.from_ is None or heard.at >= span.begins_at > float("-inf")
        if has_begun and isinstance(heard, Heard):
            yield heard

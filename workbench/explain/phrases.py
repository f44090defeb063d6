"""Phrases for times, durations, lists and commands."""

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, tzinfo
from typing import Final

from bridges.observe.requesters import Moment

JOINS: Final = re.compile(
    r"`(rmf-bridge (doctor|explain|exporter|judge|mqtt-out|notify|page|release|send|watch)\b[^`]*)`"
)
"""Pattern of a command in a sentence. The pattern matches only commands that join RMF's graph."""


def lasted(seconds: float) -> str:
    """Return a duration in words, such as `0.4 s`, `12 s`, `2 min 39 s`, `3 h 5 min`, `2 d 4 h`."""
    if seconds < 9.95:
        return f"{max(0.0, seconds):.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    for large, small, in_s in (("min", "s", 60), ("h", "min", 3600), ("d", "h", 86400)):
        if whole < {60: 3600, 3600: 86400}.get(in_s, whole + 1):
            rest = whole % in_s // (in_s // {60: 60, 3600: 60, 86400: 24}[in_s])
            return f"{whole // in_s} {large}" + (f" {rest} {small}" if rest else "")
    raise AssertionError(seconds)


def listed(names: Sequence[str], word: str = "and") -> str:
    """Join names to `a`, `a and b`, or `a, b and c`."""
    *first, last = names
    return f"{', '.join(first)} {word} {last}" if first else last


def on_graph(text: str, options: Sequence[str]) -> str:
    """Add the graph's options to every command in the text that joins the graph."""

    def joined(found: re.Match[str]) -> str:
        command, name = found.groups()
        words = [*options]
        if name == "doctor" and "--config" in words:  # doctor's FILE replaces `--config`
            at = words.index("--config")
            del words[at : at + 2]
        return f"`{command} {shlex.join(words)}`" if words else found[0]

    return JOINS.sub(joined, text)


@dataclass(frozen=True, slots=True)
class TimePhrases:
    """A writer of times in words. `now` is the present time, for phrases such as "(12 s)". `zone` is
    the time zone, or None for this machine's zone."""

    now: Moment
    zone: tzinfo | None

    def time(self, wall: float, *, tenths: bool = False) -> str:
        """Return a time such as `14:03:07`. If the day is not today, add the date."""
        at = self._local(wall)
        text = f"{at:%H:%M:%S}" + (f".{at.microsecond // 100000}" if tenths else "")
        return text if at.date() == self._local(self.now.wall).date() else f"{at:%Y-%m-%d} {text}"

    def date(self, wall: float) -> str:
        """Return a date and time such as `2026-11-22 14:03:07`."""
        return f"{self._local(wall):%Y-%m-%d %H:%M:%S}"

    def since(self, moment: Moment) -> str:
        """Return a phrase such as `since 14:03:07 (12 s)`."""
        for_s = lasted(self.now.at - moment.at)
        if moment.seen:
            return f"since {self.time(moment.wall)} ({for_s})"
        return f"since before {self.time(moment.wall)} (at least {for_s})"

    def _local(self, wall: float) -> datetime:
        try:
            return datetime.fromtimestamp(wall, self.zone)
        except (
            OverflowError,
            ValueError,
            OSError,
        ):  # a recording may have a time that no calendar has
            return datetime.fromtimestamp(0, self.zone)

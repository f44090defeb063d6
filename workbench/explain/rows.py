"""Rows of a growing timeline. A value holds until the next value comes, or until the value expires."""

import sys
from collections import deque
from collections.abc import Iterator
from typing import Final

from bridges.messages import words
from workbench.explain.timeline import LaneSpan, Mark, Tone

LONGEST_LABEL: Final = 120
MOST_SPANS: Final = 2000
"""Maximum number of a row's spans and marks. The row drops the oldest."""
NOT_HEARD: Final = "not heard"


def label(text: str, longest: int = LONGEST_LABEL) -> str:
    """Convert a text from the network to a label, which is one line of at most `longest` characters."""
    shown = words.printable(text[: longest + 1])
    return shown if len(shown) <= longest else shown[: longest - 1] + "…"


class LaneRow:
    """A row of marks and of spans that never overlap.

    A value holds for `keeps_s` (s) at most. If `fills` is true, the time after an expired value gets a
    span NOT_HEARD. The row forgets spans that ended more than `past_s` (s) before the newest span.
    """

    def __init__(
        self,
        keeps_s: float = float("inf"),
        *,
        fills: bool = False,
        past_s: float = float("inf"),
    ) -> None:
        self.heard_at = float("-inf")
        self.left_out = 0
        self._keeps_s = keeps_s
        self._fills = fills
        self._past_s = past_s
        self._spans: deque[LaneSpan] = deque(maxlen=MOST_SPANS)
        self._marks: deque[Mark] = deque(maxlen=MOST_SPANS)
        self._open: tuple[float, str, Tone] | None = None

    def say(self, at: float, text: str, tone: Tone) -> None:
        """Set the row's value from `at` on. "" ends the value."""
        self._expire(at)
        if self._open is not None and self._open[1:] != (text, tone):
            self._close(at)
        if text and self._open is None:
            self._open = at, sys.intern(text), tone  # thousands of spans share few texts
        self.heard_at = at

    def mark(self, at: float, text: str, tone: Tone) -> None:
        """Mark an event."""
        self.left_out += len(self._marks) == MOST_SPANS
        self._marks.append(Mark(at, text, tone))
        while self._marks[0].at_s < at - self._past_s:
            self._marks.popleft()
        self.heard_at = max(self.heard_at, at)

    def spans(self, from_s: float, to_s: float) -> Iterator[LaneSpan]:
        """Yield the parts of the spans that lie between these times. The last span may not have ended
        yet."""
        for span in (*self._spans, *self._going_on(to_s)):
            if span.to_s > from_s and span.from_s < to_s:
                yield LaneSpan(
                    max(from_s, span.from_s), min(to_s, span.to_s), span.label, span.tone
                )

    def marks(self, from_s: float, to_s: float) -> Iterator[Mark]:
        """Yield the marks between these times."""
        return (mark for mark in self._marks if from_s <= mark.at_s <= to_s)

    def _going_on(self, to_s: float) -> Iterator[LaneSpan]:
        until = self.heard_at + self._keeps_s
        late = to_s > until
        if self._open is not None:
            since, text, tone = self._open
            yield LaneSpan(since, self.heard_at if late else to_s, text, tone)
        if late and self._fills:
            yield LaneSpan(self.heard_at, to_s, NOT_HEARD, "unknown")

    def _expire(self, at: float) -> None:
        """End the present span if no message has repeated its value for `keeps_s`. The span ends at the
        last such message."""
        if at <= self.heard_at + self._keeps_s or self.heard_at == float("-inf"):
            return
        self._close(self.heard_at)
        if self._fills:
            self._append(LaneSpan(self.heard_at, at, NOT_HEARD, "unknown"))

    def _close(self, at: float) -> None:
        if self._open is not None:
            since, text, tone = self._open
            self._append(LaneSpan(since, at, text, tone))
        self._open = None

    def _append(self, span: LaneSpan) -> None:
        if span.to_s > span.from_s:
            self.left_out += len(self._spans) == MOST_SPANS
            self._spans.append(span)
            while self._spans[0].to_s < span.to_s - self._past_s:
                self._spans.popleft()

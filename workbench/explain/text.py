"""An explanation as one screen of text."""

import textwrap
from collections.abc import Iterator
from datetime import tzinfo
from typing import Final

from bridges.observe.requesters import Moment
from workbench.explain.explanation import CheckedField, Explanation
from workbench.explain.phrases import TimePhrases

MOST_WIDE: Final = 100


SCREEN_LINES: Final = 40
LEAST_STORY: Final = 6
FIRST: Final = 2
"""Number of lines at the beginning of a story that the screen always shows."""
MOST_FAULTS: Final = 4


def lines(
    explanation: Explanation,
    zone: tzinfo | None = None,
    width: int = MOST_WIDE,
    height: int = SCREEN_LINES,
) -> list[str]:
    """Return one screen of lines. A line is wider than `width` only if a single word is wider."""
    found = [*_answer(explanation, min(width, MOST_WIDE))]
    room = max(LEAST_STORY, height - len(found) - 1)
    return [*found, *_story(explanation, zone, room)]


def _answer(one: Explanation, width: int) -> Iterator[str]:
    yield f"{one.kind} {one.device}, heard from {one.heard}"
    yield ""
    for sentence in one.now:
        yield from _wrapped(sentence, width)
    if one.fields:
        yield ""
        yield f"What RMF checks for {one.asks}:"
        yield from _table(one.fields)
    yield ""
    for step in one.next:
        yield from _wrapped(f"Next, {step.who}: {step.what}.", width)
    for fault in one.faults[:MOST_FAULTS]:
        detail = f" ({fault.detail})" if fault.detail else ""
        remedy = f": {fault.cause}. Do: {fault.do}" if fault.cause else ""
        yield from _wrapped(f"Fault {fault.code}{detail} {fault.since}{remedy}.", width)
    if len(one.faults) > MOST_FAULTS:
        yield f"And {len(one.faults) - MOST_FAULTS} more faults: `rmf-bridge status` shows all faults."
    for note in one.notes:
        yield from _wrapped(f"Note: {note}", width)
    if one.before:
        yield ""
        yield from _wrapped(one.before, width)


def _story(one: Explanation, zone: tzinfo | None, room: int) -> Iterator[str]:
    """Yield the beginning of the story. Then yield as much of the story's end as fits."""
    shown = one.story
    if not shown:
        return
    yield ""
    clock = TimePhrases(Moment(0.0, shown[-1].wall), zone)
    told = [f"  {clock.time(line.wall, tenths=True)}  {line.text}" for line in shown]
    out = len(told) + one.left_out - room + 1
    if len(told) + (one.left_out > 0) <= room:
        yield from [f"  … {one.left_out} before …"] if one.left_out else []
        yield from told
        return
    yield from told[:FIRST]
    yield f"  … {out} more …"
    yield from told[len(told) - (room - 1 - FIRST) :]


def _table(fields: tuple[CheckedField, ...]) -> Iterator[str]:
    """Yield a text row for each field. The row shows the present value. If the requester waits for
    another value, the row shows the wanted value too."""
    widths = [
        max(len(text) for text in column) for column in zip(*map(_cells, fields), strict=True)
    ]
    for field in fields:
        cells = (f"{text:<{wide}}" for text, wide in zip(_cells(field), widths, strict=True))
        yield f"  {'  '.join(cells)}  {field.since}"


def _cells(field: CheckedField) -> tuple[str, str, str]:
    met = "as wanted" if field.met else f"MISSING, wanted: {field.wanted}"
    return field.name, field.shown, met


def _wrapped(text: str, width: int) -> list[str]:
    return textwrap.wrap(
        text, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )

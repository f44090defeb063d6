"""An explanation (`workbench/explain/`) as HTML. All functions are pure, and every text is escaped."""

from collections.abc import Iterator
from datetime import tzinfo
from html import escape

from bridges.observe.requesters import Moment
from workbench.explain.explanation import CheckedField, Explanation, FaultTold
from workbench.explain.phrases import TimePhrases
from workbench.page.tables import table


def explanation(found: Explanation) -> str:
    """Format the sentences, the fields that RMF checks, the next steps, and the faults with
    remedies."""
    return "".join(_parts(found))


def timeline(svg: str, opens_at: float = 1.0) -> str:
    """Format a timeline's picture. On a narrow screen, people scroll the picture by hand or by
    keyboard.

    `opens_at` tells which part of the picture the screen shows first, as a fraction of the picture's
    width.
    """
    where = f'tabindex="0" role="region" aria-label="Timeline" data-open="{opens_at:.4f}"'
    return f'<div class="timeline" {where}>{svg}</div>'


def _parts(found: Explanation) -> Iterator[str]:
    yield "".join(f"<p>{escape(sentence)}</p>" for sentence in found.now)
    if found.next:
        steps = "".join(f"<li>{escape(f'{step.who}: {step.what}')}</li>" for step in found.next)
        yield f"<p>Next:</p><ul>{steps}</ul>"
    if found.faults:
        yield f"<h3>Faults</h3><ul>{''.join(map(_fault, found.faults))}</ul>"
    if found.fields:
        rows = [
            (one.name, one.shown, one.wanted, _met(one), one.since.removeprefix("since "))
            for one in found.fields
        ]
        headings = ("field", "shows", "wanted", "met", "since")
        yield table(headings, rows, f"What RMF checks for {found.asks}")
    yield "".join(f"<p>Note: {escape(note)}</p>" for note in found.notes)


def _met(one: CheckedField) -> str:
    return "✔ yes" if one.met else "✖ no"


def _fault(one: FaultTold) -> str:
    told = ": ".join(filter(None, (f"{one.code} {one.since}", one.detail)))
    cause = f"<p>Likely cause: {escape(one.cause)}</p>" if one.cause else ""
    do = f"<p><b>Do:</b> {escape(one.do)}</p>" if one.do else ""
    return f'<li><span class="wrong">✖ {escape(told)}</span>{cause}{do}</li>'


def story(found: Explanation, zone: tzinfo | None = None) -> str:
    """Format the events, one line for each event. `zone` is the time zone of the events."""
    if not found.story:
        return "<p>Nothing was heard about the device.</p>"
    last = found.story[-1]
    clock = TimePhrases(Moment(last.at, last.wall), zone)
    left_out = f"<p>{found.left_out} lines before that.</p>" if found.left_out else ""
    lines = "\n".join(f"{clock.time(line.wall)}  {line.text}" for line in found.story)
    return f"{left_out}<pre>{escape(lines)}</pre>"

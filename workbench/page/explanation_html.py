"""An explanation (`workbench/explain/`) as HTML. Pure; every text is escaped."""

from collections.abc import Iterator
from html import escape

from bridges.observe.requesters import Moment
from workbench.explain.explanation import Explanation
from workbench.explain.phrases import TimePhrases
from workbench.page.tables import table


def explanation(found: Explanation) -> str:
    """Format the sentences, RMF's conditions, the party to act next, and the faults with remedies."""
    return "".join(_parts(found))


def timeline(svg: str) -> str:
    """Format a timeline's picture; on a narrow screen it scrolls, by keyboard too."""
    return f'<div class="timeline" tabindex="0" role="region" aria-label="Timeline">{svg}</div>'


def _parts(found: Explanation) -> Iterator[str]:
    yield "".join(f"<p>{escape(sentence)}</p>" for sentence in found.now)
    if found.fields:
        rows = [
            (one.name, one.shown, one.wanted, "✔ yes" if one.met else "✖ no", one.since)
            for one in found.fields
        ]
        headings = ("field", "shows", "wanted", "met", "since")
        yield table(headings, rows, f"What RMF checks for {found.asks}")
    if found.next:
        steps = "".join(f"<li>{escape(f'{step.who}: {step.what}')}</li>" for step in found.next)
        yield f"<p>Next:</p><ul>{steps}</ul>"
    if found.faults:
        told = [
            (f"{one.code} {one.since}", one.detail, one.cause or "?", one.do or "see its log")
            for one in found.faults
        ]
        yield table(("fault", "detail", "likely cause", "do"), told, "Faults, and what to do")
    yield "".join(f"<p>Note: {escape(note)}</p>" for note in found.notes)


def story(found: Explanation) -> str:
    """Format the events, line by line."""
    if not found.story:
        return "<p>Nothing was heard of it.</p>"
    last = found.story[-1]
    clock = TimePhrases(Moment(last.at, last.wall), None)
    left_out = f"<p>{found.left_out} lines before that.</p>" if found.left_out else ""
    lines = "\n".join(f"{clock.time(line.wall)}  {line.text}" for line in found.story)
    return f"{left_out}<pre>{escape(lines)}</pre>"

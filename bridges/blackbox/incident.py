"""One incident: the reasons for a recording, and the daemon's entries before and after these reasons.
The functions of this file are pure."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

import msgspec

from bridges.blackbox.entries import AnyEntry, Clocks, Decided, Head, Known
from bridges.blackbox.value_codec import Tree, name_of
from bridges.kinds.shared.decision import IoFailed, Sampled, Suspended, WriteFailed

BEFORE_S: Final = 120.0
AFTER_S: Final = 30.0
READING: Final = name_of(Sampled)
ERRORS: Final = (name_of(IoFailed), name_of(WriteFailed), name_of(Suspended))


class Note(msgspec.Struct, frozen=True):
    """A reason for a recording. `at`: the time (monotonic s) at which the reason came. `code`: one of a
    few fixed words."""

    at: float
    code: str
    text: str = ""
    subject: str = ""


class Incident(msgspec.Struct, frozen=True):
    """The content of one recording's file. The first entries contain everything that a replay needs."""

    head: Head
    entries: Sequence[AnyEntry]
    notes: tuple[Note, ...] = ()


def part(entries: Sequence[AnyEntry], begin_at: float, end_at: float) -> Sequence[AnyEntry]:
    """Return the entries from `begin_at` to `end_at` (monotonic s). Also return the earlier entries
    from which a replay can start."""
    first = 0
    for place, (entry, following) in enumerate(pairwise(entries)):
        if entry.at > begin_at:
            break
        if isinstance(entry, Clocks) and isinstance(following, Known):
            first = place
    return [entry for entry in entries[first:] if entry.at <= end_at]


def of_end(head: Head, entries: Sequence[AnyEntry], notes: tuple[Note, ...]) -> Incident:
    """Return the last BEFORE_S of a run that is over."""
    at = entries[-1].at if entries else 0.0
    return Incident(head, part(entries, at - BEFORE_S, at), notes)


def timed(entries: Sequence[AnyEntry]) -> Iterator[tuple[AnyEntry, float, float]]:
    """Yield each entry with two times (s since the epoch). The first of the two never jumps. The second
    is the wall clock's time, which jumps when somebody sets that clock."""
    clocks = [entry for entry in entries if isinstance(entry, Clocks)]
    steady = wall = clocks[0].wall - clocks[0].at if clocks else 0.0
    for entry in entries:
        if isinstance(entry, Clocks):
            wall = entry.wall - entry.at
        yield entry, entry.at + steady, entry.at + wall


def readable(step: Decided) -> Iterator[tuple[str, Tree]]:
    """Yield the parts of a decision as pairs of a topic and a JSON value. Foxglove and `ros2 bag` can
    show them."""
    event = step.event if isinstance(step.event, dict) else {}
    kind = str(event.get("", ""))
    if kind == READING:
        yield "samples", {"subject": step.subject, "sample": event.get("sample")}
    elif kind in ERRORS:
        yield "bus_errors", {"subject": step.subject, "kind": kind, "reason": event.get("reason")}
    else:
        yield "events", {"subject": step.subject, "event": step.event}
    if step.news or step.refused or step.publish:
        news = step.news[0] if step.news else None
        told = {"refused": step.refused, "news": news, "publish": step.publish}
        yield "decisions", {"subject": step.subject, **told}
    for outputs in step.outputs:
        yield "outputs", {"subject": step.subject, "outputs": outputs}
    for faults in step.faults:
        yield "faults", {"subject": step.subject, "faults": faults}


OWN_TOPICS: Final = "rmf_bridge/"


INSTALL: Final = "in the git clone of rmf-bridges run .venv/bin/pip install '.[recording,sqlite]'"


LIBRARY: Final = "rmf-bridges"
"""The first word of the header field `library` in our own recordings."""

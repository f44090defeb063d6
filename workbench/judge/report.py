"""Format a judge's verdict for people, programs and CI servers."""

from dataclasses import dataclass
from datetime import datetime
from typing import Final
from xml.etree import ElementTree

import msgspec

from bridges.messages import words
from workbench.judge.judge import LAWS, Judge, JudgedKind
from workbench.judge.law import JudgedLaw, Verdict, shown

ORDER: Final = (Verdict.BROKEN, Verdict.KEPT, Verdict.NOT_SEEN)
OTHERS: Final = 5
NARROWEST: Final = 60


@dataclass(frozen=True, slots=True)
class Judgement:
    """One judgement.

    - `wall`: the beginning (s since the epoch).
    - `heard_s`: the time of listening (s).
    - `states`: number of states heard; for an adapter, number of its requests.
    - `others`: names of other devices of the same kind.
    - `notes`: the listener's remarks.
    - `silences`: the beginning (s since the epoch) and length (s) of each silence of the whole network.
    """

    kind: JudgedKind
    name: str
    wall: float
    heard_s: float
    states: int
    others: tuple[str, ...]
    judged: tuple[JudgedLaw, ...]
    notes: tuple[str, ...] = ()
    silences: tuple[tuple[float, float], ...] = ()

    def of(self, verdict: Verdict) -> list[JudgedLaw]:
        """Return the laws with this verdict."""
        return [judged for judged in self.judged if judged.verdict is verdict]


def report(judge: Judge, judged: tuple[JudgedLaw, ...], heard_s: float, *notes: str) -> Judgement:
    """Collect a judge's findings."""
    wall, history = judge.first.wall if judge.first else 0.0, judge.history
    others = tuple(sorted(history.others))
    about = (judge.kind, judge.name, wall, heard_s, history.states, others, judged)
    return Judgement(*about, notes, tuple(history.silences))


def text(report: Judgement, width: int) -> str:
    """Format one screen. First come the broken laws with their evidence, then a line for each other
    law."""
    name = words.printable(report.name)
    if not report.states and not report.of(Verdict.BROKEN):
        heard = f"no {_counted(report)} heard in {report.heard_s:.0f} s"
        lines = [f"{report.kind} {name}: {heard}{_others(report)}"]
        return "\n".join([*lines, *report.notes])
    counts = ", ".join(f"{len(report.of(verdict))} {verdict}" for verdict in ORDER)
    head = f"{report.kind} {name}: {counts}; {report.states} {_counted(report)}s"
    head += f" in {report.heard_s:.0f} s"
    lines = [head, ""]
    for verdict in ORDER:
        for judged in report.of(verdict):
            lines += _lines(judged, max(width, NARROWEST))
    quiet = [
        f"{_time(wall)}  nobody on the network was heard for {silent_s:.0f} s, which counts as no"
        " breach"
        for wall, silent_s in report.silences
    ]
    return "\n".join([*lines, *(f"\n{note}" for note in (*quiet, *report.notes))])


def _counted(report: Judgement) -> str:
    return {"adapter": "request", "alarm": "message"}.get(report.kind, "state")


def _lines(judged: JudgedLaw, width: int) -> list[str]:
    law, verdict = judged.law, judged.verdict
    line = f"{verdict.upper() if verdict is Verdict.BROKEN else verdict:8}  {law.id:14}  "
    if verdict is not Verdict.BROKEN:
        lines = [law.sentence, *([f"needs: {law.occasion}"] if verdict is Verdict.NOT_SEEN else [])]
        heads = (line, " " * len(line))
        return [
            head + _cut(one, width - len(head)) for head, one in zip(heads, lines, strict=False)
        ]
    told = [f"            {_time(e.wall)}  {e.text}" for e in judged.evidence]
    more = judged.times - len(judged.evidence)
    told += [f"            and {more} times more"] if more else []
    return [line + law.sentence, *told, f"            why: {law.reason} ({law.source})"]


def _cut(sentence: str, room: int) -> str:
    return sentence if len(sentence) <= room else sentence[: room - 1] + "…"


def _time(wall: float) -> str:
    """Format the local time of day, to the millisecond. If no calendar has the time, format the time as
    a number."""
    try:
        return f"{datetime.fromtimestamp(wall):%H:%M:%S}.{int(wall * 1000) % 1000:03d}"
    except (OverflowError, ValueError, OSError):
        return f"{wall:.3f}"


def _others(report: Judgement) -> str:
    if not report.others:
        return (
            ": check the name, the domain and the network. States that are published BEST_EFFORT are"
            " not heard. RMF on Cyclone DDS does not hear such states either"
        )
    some = ", ".join(shown(other) for other in report.others[:OTHERS])
    more = len(report.others) - OTHERS
    return f"; heard: {some}" + (f" and {more} more" if more > 0 else "")


def verdict(report: Judgement) -> Verdict:
    """Return the verdict on all laws together."""
    return next((v for v in ORDER if report.of(v)), Verdict.NOT_SEEN)


def as_json(report: Judgement) -> str:
    """Return one JSON object."""
    about = ("kind", "name", "wall", "heard_s", "states", "notes", "silences")
    texts = ("id", "sentence", "occasion", "reason", "source")
    laws = [
        {key: getattr(j.law, key) for key in texts}
        | {"verdict": j.verdict, "times": j.times, "evidence": j.evidence}
        for j in report.judged
    ]
    told = {key: getattr(report, key) for key in about} | {"verdict": verdict(report), "laws": laws}
    return msgspec.json.encode(told).decode()


def junit(report: Judgement) -> str:
    """Return JUnit's XML. Each law is a test case. A broken law is a failure, and an unseen law is
    skipped."""
    suite = ElementTree.Element(
        "testsuite",
        name=words.printable(f"rmf-bridge judge {report.kind} {report.name}"),
        tests=str(len(report.judged)),
        failures=str(len(report.of(Verdict.BROKEN))),
        skipped=str(len(report.of(Verdict.NOT_SEEN))),
        time=f"{report.heard_s:.3f}",
    )
    for judged in report.judged:
        _case(suite, report, judged)
    ElementTree.indent(suite)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ElementTree.tostring(suite, "unicode")}\n'


def _case(suite: ElementTree.Element, report: Judgement, judged: JudgedLaw) -> None:
    law = judged.law
    case = ElementTree.SubElement(
        suite,
        "testcase",
        classname=words.printable(f"{report.kind}.{report.name}"),
        name=f"{law.id}: {law.sentence}",
    )
    if judged.verdict is Verdict.BROKEN:
        told = [f"{_time(e.wall)} {e.text}" for e in judged.evidence]
        failure = ElementTree.SubElement(case, "failure", message=told[0])
        failure.text = "\n".join([*told, f"{law.reason} ({law.source})"])
    elif judged.verdict is Verdict.NOT_SEEN:
        ElementTree.SubElement(case, "skipped", message=f"not seen; needs: {law.occasion}")


def markdown(kind: JudgedKind) -> str:
    """Return a kind's laws as a table for docs/reference/laws.md. `*` marks a law that a faulty wire
    can break too."""
    rows = [
        f"| `{law.id}`{'*' if law.sensed else ''} | {law.sentence} | {law.occasion} | {law.reason}"
        f" | {law.source} |"
        for law in LAWS[kind]
    ]
    return "\n".join(["| law | | occasion | why | source |", "|---|---|---|---|---|", *rows])

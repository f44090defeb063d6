"""A finding of the doctor: subject, severity, fact, meaning and remedy."""

from collections.abc import Iterable
from typing import Final, Literal

import msgspec

Level = Literal["ok", "note", "unknown", "warning", "wrong"]
"""Severity of a finding. With `note`, the reader need not act. With `unknown`, this machine cannot show
the fact."""
WELL, WARNINGS, WRONG = 0, 1, 2
EXIT_CODE: Final = {
    "ok": WELL,
    "note": WELL,
    "unknown": WARNINGS,
    "warning": WARNINGS,
    "wrong": WRONG,
}


class Finding(msgspec.Struct, frozen=True):
    """One finding. An `ok` finding has no meaning and no remedy."""

    subject: str
    level: Level
    found: str
    means: str = ""
    do: str = ""


def ok(subject: str, found: str) -> Finding:
    """Make a finding that all is well."""
    return Finding(subject, "ok", found)


def note(subject: str, found: str, means: str = "", do: str = "") -> Finding:
    """Make a finding that is worth knowing."""
    return Finding(subject, "note", found, means, do)


def unknown(subject: str, found: str, means: str = "", do: str = "") -> Finding:
    """Make a finding about a fact that this machine cannot show."""
    return Finding(subject, "unknown", found, means, do)


def warning(subject: str, found: str, means: str, do: str) -> Finding:
    """Make a finding about a fact that does no harm now, but may do harm later."""
    return Finding(subject, "warning", found, means, do)


def wrong(subject: str, found: str, means: str, do: str) -> Finding:
    """Make a finding about a fact that prevents a working bridge."""
    return Finding(subject, "wrong", found, means, do)


def exit_code(findings: Iterable[Finding]) -> int:
    """Return 0 if all is well, 1 for warnings and unknown facts, and 2 if something is wrong."""
    return max((EXIT_CODE[one.level] for one in findings), default=WELL)

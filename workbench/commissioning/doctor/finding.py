"""What a doctor finds: a subject, how good it is, what was found, what it means and what to do."""

from collections.abc import Iterable
from typing import Final, Literal

import msgspec

Level = Literal["ok", "note", "warning", "wrong"]
"""`note`: worth knowing, and no reason to act."""
WELL, WARNINGS, WRONG = 0, 1, 2
EXIT_CODE: Final = {"ok": WELL, "note": WELL, "warning": WARNINGS, "wrong": WRONG}


class Finding(msgspec.Struct, frozen=True):
    """One finding. A finding that is `ok` has neither a meaning nor a remedy."""

    subject: str
    level: Level
    found: str
    means: str = ""
    do: str = ""


def ok(subject: str, found: str) -> Finding:
    """All is well."""
    return Finding(subject, "ok", found)


def note(subject: str, found: str, means: str = "", do: str = "") -> Finding:
    """Worth knowing."""
    return Finding(subject, "note", found, means, do)


def warning(subject: str, found: str, means: str, do: str) -> Finding:
    """It works now, but may fail later."""
    return Finding(subject, "warning", found, means, do)


def wrong(subject: str, found: str, means: str, do: str) -> Finding:
    """It cannot work like this."""
    return Finding(subject, "wrong", found, means, do)


def exit_code(findings: Iterable[Finding]) -> int:
    """0 all well, 1 warnings, 2 something is wrong."""
    return max((EXIT_CODE[one.level] for one in findings), default=WELL)

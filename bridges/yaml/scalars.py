"""Finds texts without quotes that YAML reads as other values, such as numbers. Accepts only unambiguous
numbers.

`017`, `1:30`, `no` or `1e3` mean different things to YAML 1.1 (PyYAML), to YAML 1.2 and to people.
Therefore a name without quotes must be the same text for all three. A number must have the same value
for all three.
"""

import math
import re
from collections.abc import Callable

TRUTHS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}

_NULLS = ("", "~", "null", "Null", "NULL")
_NULL_WORDS = _NULLS[1:]
_YES = ("y", "yes", "on", "true")
_NO = ("n", "no", "off", "false")
_INT = re.compile(r"[-+]?(0|[1-9][0-9]*|0x[0-9a-fA-F]+)")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?")

_Reading = Callable[[str], object]
_NUMBERS: tuple[tuple[re.Pattern[str], _Reading], ...] = (
    (re.compile(r"[-+]?0b[01_]+"), lambda t: int(t, 2)),
    (re.compile(r"[-+]?0o?[0-7_]+"), lambda t: int(t.replace("o", ""), 8)),
    (re.compile(r"[-+]?0x[0-9a-fA-F_]+"), lambda t: int(t, 16)),
    (re.compile(r"[-+]?[0-9][0-9_]*"), int),
    (re.compile(r"[-+]?[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?"), lambda t: _base_60(t)),
    (re.compile(r"[-+]?([0-9][0-9_]*\.?[0-9_]*|\.[0-9_]+)([eE][-+]?[0-9]+)?"), float),
    (re.compile(r"[-+]?\.(inf|Inf|INF)"), lambda t: "infinity"),
    (re.compile(r"\.(nan|NaN|NAN)"), lambda t: "not a number"),
)
_DATE = re.compile(r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}([Tt \t].*)?")


def _base_60(text: str) -> float:
    total = 0.0
    for part in text.lstrip("+-").split(":"):
        total = total * 60 + float(part)
    return -total if text.startswith("-") else total


def is_null(text: str) -> bool:
    """Return whether YAML reads the text as null."""
    return text in _NULLS


def is_null_word(text: str) -> bool:
    """Return whether the text is one of the words for null. An empty text is not such a word."""
    return text in _NULL_WORDS


def reads_as(text: str) -> str | None:
    """Describe how YAML 1.1 or 1.2 reads a text without quotes. Return None if both read the text
    unchanged.

        >>> reads_as("017"), reads_as("no"), reads_as("L1")
        ('the number 15', 'false', None)
    """
    if is_null(text):
        return "nothing"
    if text.lower() in _YES + _NO and text in (text.lower(), text.capitalize(), text.upper()):
        return "true" if text.lower() in _YES else "false"
    if text in ("=", "<<"):
        return "a special mark"
    if _DATE.fullmatch(text):
        return "a date"
    return _reads_as_number(text)


def _reads_as_number(text: str) -> str | None:
    for form, reading in _NUMBERS:
        if form.fullmatch(text):
            try:
                value = reading(text)
                return value if isinstance(value, str) else f"the number {_short(value)}"
            except ValueError:  # Python converts no text of underscores, and not so many digits
                return "a number"
    return None


def _short(value: object) -> str:
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        value = int(value)
    text = str(value)
    return text if len(text) <= 20 else f"{text[:17]}..."


def whole_number(text: str) -> int | None:
    """Return the whole number that is written as a text such as `12`, `-3` or `0x2000`. Return None for
    an ambiguous spelling."""
    if not _INT.fullmatch(text) or len(text) > 20:
        return None
    return int(text, 16 if "x" in text else 10)


def number(text: str) -> float | None:
    """Return the number that is written as a text such as `5`, `0.05` or `1e3`. Return None for an
    ambiguous spelling, and for infinity."""
    if not _FLOAT.fullmatch(text):
        return None
    value = float(text)
    return value if math.isfinite(value) else None

"""Formats names for error texts: it shortens and lists names, and finds the known name that is most
similar."""

from collections.abc import Iterable


def short(text: str) -> str:
    """Shorten a text to 40 characters for a message."""
    return text if len(text) <= 40 else f"{text[:37]}..."


def either(names: Iterable[str]) -> str:
    """Join the names as `a, b or c`."""
    *others, last = list(names) or ["nothing"]
    return f"{', '.join(others)} or {last}" if others else last


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the most similar known name; None if no name is similar."""
    from difflib import get_close_matches  # imported late, because only misspelt names need it

    return next(iter(get_close_matches(name, list(known), n=1)), None)


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """Return the error text for an unknown name, with the nearest known name and all known names."""
    names = list(dict.fromkeys(known))
    near = nearest(name, names)
    meant = f"did you mean '{short(near)}'? " if near else ""
    there = f"known here: {', '.join(map(short, names))}" if names else "there is none"
    return f"unknown {what} '{short(name)}': {meant}{there}"

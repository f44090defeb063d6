"""An answer's body as the one JSON object that it must be."""

import json
from typing import Any

from drivers.hal import HalError


def shown(text: str) -> str:
    """The beginning of a text, printable."""
    return "".join(c if c.isprintable() else "?" for c in text[:80])


def json_object(url: str, content_type: str, body: bytes) -> dict[str, Any]:
    """The one JSON object that an answer is. Raises HalError."""
    sort = content_type.partition(";")[0].strip().lower()
    if sort != "application/json" and not sort.endswith("+json"):
        what = shown(sort) or "no content type"
        raise HalError(f"{url} answered {what} instead of JSON: is api_base the API's address?")
    try:
        found = json.loads(
            body.decode(), parse_constant=_no_number, object_pairs_hook=_without_doubles
        )
    except (ValueError, RecursionError) as error:
        raise HalError(f"{url} answered JSON that is none: {shown(str(error))}") from None
    if not isinstance(found, dict):
        raise HalError(f"{url} answered JSON that is no object: {shown(repr(found))}")
    return found


def _no_number(word: str) -> Any:
    raise ValueError(f"{word} is no JSON")


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object that says two things under one name says nothing."""
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a name stands twice in one object")
    return found

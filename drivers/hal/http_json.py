"""Decodes an answer's body, which must be one JSON object."""

import json
from typing import NoReturn

from drivers.hal import HalError


def excerpt(text: str) -> str:
    """Return the beginning of a text, made printable."""
    return "".join(c if c.isprintable() else "?" for c in text[:80])


class WrongAnswer(HalError):
    """The error of an answer that is not what this call needs. The server works, so other calls to the
    same server may succeed."""


class RefusedCall(WrongAnswer):
    """The error of an answer with a status 4xx: the server has not carried out the call."""


def json_object(url: str, content_type: str, body: bytes) -> dict[str, object]:
    """Decode the answer's JSON object. Raises WrongAnswer if the answer is not a JSON object."""
    sort = content_type.partition(";")[0].strip().lower()
    if sort != "application/json" and not sort.endswith("+json"):
        what = excerpt(sort) or "no content type"
        raise WrongAnswer(f"{url} answered {what} instead of JSON: is api_base the API's address?")
    try:
        found = strict_json(body.decode())
    except ValueError as error:
        raise WrongAnswer(f"{url} answered invalid JSON: {excerpt(str(error))}") from None
    if not isinstance(found, dict):
        raise WrongAnswer(f"{url} answered JSON that is not an object: {excerpt(repr(found))}")
    return found


def strict_json(text: str) -> object:
    """Decode JSON as RFC 8259 defines it, without NaN and without duplicate keys. Raises ValueError."""
    try:
        return json.loads(text, parse_constant=_no_number, object_pairs_hook=_without_doubles)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _no_number(word: str) -> NoReturn:
    raise ValueError(f"{word} is not JSON")


def _without_doubles(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Refuse an object with a duplicate key, because JSON does not define which value counts."""
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key occurs twice in one object")
    return found

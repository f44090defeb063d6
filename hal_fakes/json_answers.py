"""The counterpart of `drivers/json_fields.py`. This file writes an answer in which the driver finds its
fields."""

from drivers.http_call import Call
from drivers.json_fields import JsonFlag, Value, same


def asked(call: Call) -> tuple[str, str, str]:
    """Return the request that carries the command to its controller."""
    return call.method, call.path, call.body or ""


def value_of(place: JsonFlag, yes: bool) -> Value:
    """Return the value that means yes or no."""
    if not place.when:
        return yes
    if yes:
        return place.when[0]
    others: list[Value] = [not place.when[0], *range(len(place.when) + 1)]
    return next(no for no in others if not any(same(no, when) for when in place.when))


def put(answer: dict[str, object], field: str, value: object) -> None:
    """Put a value into its field. List items are not supported."""
    first, _, below = field.partition(".")
    if below:
        inner = answer.setdefault(first, {})
        assert isinstance(inner, dict)
        put(inner, below, value)
    else:
        answer[first] = value

"""Hypothesis strategies for every message type, built from the annotations in `definitions.py`."""

import typing
from typing import Any

from hypothesis import settings
from hypothesis import strategies as st

from bridges.messages import definitions as d
from bridges.messages.releases import NEWEST, Release
from tests.depth import examples

NUMBERS: dict[str, st.SearchStrategy[Any]] = {
    "uint8": st.integers(0, 2**8 - 1),
    "byte": st.integers(0, 2**8 - 1),
    "uint32": st.integers(0, 2**32 - 1),
    "uint64": st.integers(0, 2**64 - 1),
    "int32": st.integers(-(2**31), 2**31 - 1),
    "float32": st.floats(width=32, allow_nan=False),
}
TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=20)

repeatable = settings(max_examples=examples(40))
"""Settings with which Hypothesis gives the same values in every run."""

MESSAGE_TYPES: tuple[Any, ...] = typing.get_args(d.Message)


def values(kind: Any, release: Release = NEWEST) -> st.SearchStrategy[Any]:
    """Return a strategy for values of this field type or message type. Each value fits the release."""
    if typing.get_origin(kind) is typing.Annotated:
        return NUMBERS[kind.__metadata__[0]]
    if typing.get_origin(kind) is tuple:
        return st.lists(values(typing.get_args(kind)[0], release), max_size=6).map(tuple)
    if kind is str:
        return TEXTS
    if kind is bool:
        return st.booleans()
    carried = release.fields(kind).items()
    return st.builds(kind, **{name: values(field, release) for name, field in carried})

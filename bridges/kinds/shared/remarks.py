"""Remarks that a struct, kind or driver makes on its settings in the YAML."""

from collections.abc import Iterable

Remark = tuple[tuple[str, ...], str]
"""A problem, warning or note: the path of its key inside the struct, and a text with the remedy."""
Remarks = Iterable[Remark]

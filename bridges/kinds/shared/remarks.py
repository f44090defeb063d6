"""Remarks about settings in the YAML. A struct, kind or driver makes them about its own settings."""

from collections.abc import Iterable

Remark = tuple[tuple[str, ...], str]
"""A problem, warning or note: the path of its key inside the struct, and a text with the remedy."""
Remarks = Iterable[Remark]

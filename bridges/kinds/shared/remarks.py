"""Remarks of a struct, kind or driver on its settings in the YAML."""

from collections.abc import Iterable

Remark = tuple[tuple[str, ...], str]
"""A problem, warning or note: its path below the remarking struct, and the text with the fix."""
Remarks = Iterable[Remark]

"""Remarks on settings: what a struct, a kind or a driver says of the YAML that it is made of."""

from collections.abc import Iterable

Remark = tuple[tuple[str, ...], str]
"""A problem, warning or note: its path below the struct that gives it, and the text with the fix."""
Remarks = Iterable[Remark]

"""Checks of a panel's sources and its drill that hold for every wiring."""

from collections.abc import Collection
from typing import Final

from bridges.kinds.alarm.settings import PanelSettings
from bridges.kinds.alarm.signals import DRILL, SILENT
from bridges.kinds.shared.remarks import Remarks

PURPOSE: Final = (
    "purpose",
    "it informs robots; it is no part of the building's alarm, which works without it",
)


def drill_problems(settings: PanelSettings, sources: Collection[str], drills: bool) -> Remarks:
    """Yield sources with a reserved name, and a drill without a duration or without a contact."""
    for name in sorted({SILENT, DRILL}.intersection(sources)):
        yield ("sources", name), f"'{name}' is a word of the panel itself: take another name"
    if drills and settings.drill_s is None:
        yield ("drill",), "give the duration of a drill: drill_s: 300"
    if settings.drill_s and not drills:
        yield ("drill_s",), "no input begins a drill: wire drill, or delete drill_s"

"""Checks of a panel's sources and of its drill, for every wiring."""

from collections.abc import Collection
from typing import Final

from bridges.kinds.alarm.settings import PanelSettings
from bridges.kinds.alarm.signals import DRILL, SILENT
from bridges.kinds.shared.remarks import Remarks

PURPOSE: Final = (
    "purpose",
    "this device informs robots; the building's alarm works without this device",
)


def drill_problems(settings: PanelSettings, sources: Collection[str], drills: bool) -> Remarks:
    """Yield a problem for each source with a reserved name. Yield a problem for a drill without a
    duration or without a contact."""
    for name in sorted({SILENT, DRILL}.intersection(sources)):
        yield ("sources", name), f"'{name}' is a reserved name: choose another name"
    if drills and settings.drill_s is None:
        yield ("drill",), "give the duration of a drill: drill_s: 300"
    if settings.drill_s and not drills:
        yield ("drill_s",), "no input begins a drill: wire drill, or delete drill_s"

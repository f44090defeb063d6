"""Whose fault it is: a station's self-check, read from the error message of its ChargerState.

The charger daemons say "station: …" or "robot: …" where the controller's own diagnosis tells, and
fixed texts for what they find themselves (`bridges/charger/told.py`, `pad.py`). A text of another
node is UNCLEAR, and then a second station tells: a robot that fails there too is the one at fault.
"""

from collections.abc import Iterable
from enum import StrEnum
from typing import Final

from bridges.charger.settings import Robot


class Side(StrEnum):
    """PAD: another robot than the one expected stands there. LOST: the station cannot be reached or
    commanded, which says nothing of either side."""

    NONE = ""
    ROBOT = "robot"
    STATION = "station"
    PAD = "pad"
    LOST = "lost"
    UNCLEAR = "unclear"


WRONG_DOCKING: Final = "wrong docking: "
UNKNOWN_RECEIVER: Final = "unknown receiver "
BEGINNINGS: Final = {
    "robot:": Side.ROBOT,
    "station:": Side.STATION,
    "out of service after:": Side.STATION,
    WRONG_DOCKING: Side.PAD,
    UNKNOWN_RECEIVER: Side.PAD,
    "Charger unreachable": Side.LOST,
    "Charger takes no commands": Side.LOST,
    "two nodes for one device": Side.LOST,
    "receivers are given, and the charger does not say": Side.STATION,
}


def side(error: str) -> Side:
    """By how the text begins."""
    found = (side for start, side in BEGINNINGS.items() if error.startswith(start))
    return next(found, Side.UNCLEAR)


def on_pad(error: str, robots: Iterable[Robot], receivers: dict[str, Robot]) -> Robot | None:
    """Who stands on the pad by a text of Side.PAD; None for a stranger."""
    if error.startswith(UNKNOWN_RECEIVER):
        return receivers.get(error.removeprefix(UNKNOWN_RECEIVER).split(",")[0])
    text = error.removeprefix(WRONG_DOCKING)
    named = [who for who in robots if text.startswith(f"{who} ")]
    return max(named, key=lambda who: len(str(who)), default=None)

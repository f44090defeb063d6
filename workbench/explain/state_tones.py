"""The tones (meanings in a timeline) of the values in RMF's states. A number that RMF does not define
has the tone `unknown`."""

from collections.abc import Mapping
from enum import IntEnum
from typing import Final

from bridges.messages import definitions as d
from workbench.explain.timeline import Tone

TONES: Final[Mapping[type[IntEnum], tuple[Tone, ...]]] = {
    d.DoorModeValue: ("calm", "works", "open", "wrong", "unknown"),
    d.LiftDoor: ("calm", "works", "open"),
    d.LiftMotion: ("calm", "works", "works", "unknown"),
    d.LiftMode: ("unknown", "calm", "works", "wrong", "wrong", "wrong"),
    d.ChargerStateValue: ("calm", "asks", "works", "calm", "wrong"),
}
"""Field's type -> the tone of each value, in the order of RMF's numbers."""


def tone(kind: type[IntEnum], number: int) -> Tone:
    """Return the tone of this number. `kind` is the type of the field."""
    known: dict[int, Tone] = dict(zip(kind, TONES[kind], strict=True))
    return known.get(number, "unknown")

"""A panel's sample, outputs and events: the interface of its core."""

from typing import Final

import msgspec

from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled

SILENT: Final = "silence"
"""The cause of an alarm by a silent panel."""
DRILL: Final = "drill"
"""The signal of the drill contact."""


class PanelSample(msgspec.Struct, frozen=True):
    """Every input of one panel, with its polarity resolved and not debounced.

    `sources`: source -> is it asserted? `drill`: the drill contact; None if it is not wired.
    """

    sources: dict[str, bool] = {}
    drill: bool | None = None


class PanelOutputs(msgspec.Struct, frozen=True):
    """No output: a panel is only read."""


Event = Sampled[PanelSample] | IoFailed | RivalSeen | OperatorReset

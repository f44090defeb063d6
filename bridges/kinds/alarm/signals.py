"""A panel's sample, outputs and events: the interface of its core."""

from typing import Final

import msgspec

from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled

SILENT: Final = "silence"
"""The cause of an alarm that a panel's silence raises."""
DRILL: Final = "drill"
"""The signal of the drill contact."""


class PanelSample(msgspec.Struct, frozen=True):
    """Every input of one panel: active or not, in whichever way it is wired, and not debounced.

    `sources`: for each source, whether it is asserted. `drill`: the drill contact; None if it is not
    wired.
    """

    sources: dict[str, bool] = {}
    drill: bool | None = None


class PanelOutputs(msgspec.Struct, frozen=True):
    """No output: a panel is only read."""


Event = Sampled[PanelSample] | IoFailed | RivalSeen | OperatorReset

"""A panel's readings (samples), outputs and events, which are the interface of its decision core."""

from typing import Final

import msgspec

from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled

SILENT: Final = "silence"
"""The name of the alarm's cause if the cause is the panel's silence."""
DRILL: Final = "drill"
"""The signal name of the drill contact."""


class PanelSample(msgspec.Struct, frozen=True):
    """Every input of one panel, not debounced. True means asserted, whether the contact is wired as
    normally open or normally closed.

    `sources`: for each source, whether it is asserted. `drill`: the drill contact; None if it is not
    wired.
    """

    sources: dict[str, bool] = {}
    drill: bool | None = None


class PanelOutputs(msgspec.Struct, frozen=True):
    """The outputs of a panel: none, because a panel is only read."""


Event = Sampled[PanelSample] | IoFailed | RivalSeen | OperatorReset

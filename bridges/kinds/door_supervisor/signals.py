"""What the door supervisor's core hears from the graph: adapters' requests and doors' states."""

import msgspec

from bridges.kinds.shared.decision import OperatorReset
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.definitions import DoorModeValue


class OpenRequested(msgspec.Struct, frozen=True):
    """A requester's OPEN; `stamp` is by its clock (ns)."""

    requester: str
    stamp: int


class CloseRequested(msgspec.Struct, frozen=True):
    """A requester's CLOSE; `stamp` is by its clock (ns)."""

    requester: str
    stamp: int


class StateHeard(msgspec.Struct, frozen=True):
    """A DoorState."""

    mode: DoorModeValue


Event = OpenRequested | CloseRequested | StateHeard | MaySpeak | Woken | OperatorReset

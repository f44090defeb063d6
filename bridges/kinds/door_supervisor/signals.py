"""Events of the door supervisor's core: adapters' requests and doors' states."""

import msgspec

from bridges.kinds.shared.decision import OperatorReset
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.definitions import DoorModeValue


class RequesterOpens(msgspec.Struct, frozen=True):
    """A requester's OPEN. `stamp`: the request's time (ns) by the requester's clock."""

    requester: str
    stamp: int


class RequesterCloses(msgspec.Struct, frozen=True):
    """A requester's CLOSE. `stamp`: the request's time (ns) by the requester's clock."""

    requester: str
    stamp: int


class DoorStateHeard(msgspec.Struct, frozen=True):
    """A DoorState."""

    mode: DoorModeValue


Event = RequesterOpens | RequesterCloses | DoorStateHeard | MaySpeak | Woken | OperatorReset

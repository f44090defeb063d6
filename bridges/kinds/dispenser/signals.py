"""The readings (samples), outputs and events of a dispenser or ingestor, which are the interface of its
decision core."""

import msgspec

from bridges.kinds.shared.decision import (
    DecidedByPerson,
    IoFailed,
    MemoryKept,
    MemoryNotKept,
    OperatorReset,
    RivalSeen,
    Sampled,
)


class Item(msgspec.Struct, frozen=True):
    """The content of a request: one sort of item, or nothing (an empty `type_guid`)."""

    type_guid: str = ""
    quantity: int = 0
    compartment: str = ""

    def __str__(self) -> str:
        where = f" in {self.compartment}" if self.compartment else ""
        return f"{self.quantity} {self.type_guid}{where}" if self.type_guid else "no items"


class WorkcellSample(msgspec.Struct, frozen=True):
    """Every input, not debounced. True means asserted, whether the contact is wired as normally open or
    normally closed. None: not wired.

    `done`: the cycle has succeeded. `busy`: a cycle runs. `ready`: a cycle may start. `fault`: the
    workcell reports a fault. `errors`: the faults that its controller names.
    """

    done: bool | None = None
    busy: bool | None = None
    ready: bool | None = None
    fault: bool | None = None
    errors: tuple[str, ...] = ()


class WorkcellOutputs(msgspec.Struct, frozen=True):
    """Every output: `start`, which starts a cycle, and the item that was requested. `item` stays the
    same as long as the cycle runs."""

    start: bool = False
    guid: str = ""
    item: Item = Item()


class ItemRequested(msgspec.Struct, frozen=True):
    """RMF's request to dispense or ingest something. RMF repeats the request each second until it gets
    a result."""

    guid: str
    item: Item = Item()
    transporter: str = ""


Event = (
    Sampled[WorkcellSample]
    | IoFailed
    | RivalSeen
    | OperatorReset
    | MemoryKept
    | MemoryNotKept
    | DecidedByPerson
    | ItemRequested
)

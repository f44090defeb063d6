"""The interface of every decision core: events in, a Decision out.

A core is one pure function, `decide(memory, event, now, limits) -> Decision`. The core has no I/O, no
clock and no log. `now` is monotonic seconds. Each call derives the whole set of outputs and the whole
report afresh. Therefore a repeated, lost or reordered event cannot leave a relay in a wrong position.
"""

from typing import Final, Generic, Literal, Protocol, TypeVar

import msgspec

from bridges.messages.definitions import Message
from bridges.messages.topics import Topic

X = TypeVar("X")
"""A sample, as a driver decodes it."""
M = TypeVar("M")
"""A core's memory."""
O = TypeVar("O")  # noqa: E741
"""A core's outputs; None if the core has no hardware."""
R = TypeVar("R", bound="Report")
"""A core's report."""


Said = tuple[Topic[Message], Message]
"""A message to publish, as a pair of topic and message."""


class Fault(msgspec.Struct, frozen=True):
    """One present fault. `code`: its fixed name. `detail`: the faulty part, and the reason."""

    code: str
    detail: str = ""

    def __str__(self) -> str:
        return f"{self.code}: {self.detail}" if self.detail else self.code


class Sampled(msgspec.Struct, Generic[X], frozen=True):
    """The driver has just read every input once."""

    sample: X


class IoFailed(msgspec.Struct, frozen=True):
    """A read or a write failed. The state of the outputs is unknown, and the inputs were not read."""

    reason: str


class Suspended(IoFailed, frozen=True):
    """The process was stopped, or the machine slept. All earlier readings are stale."""


class WriteFailed(IoFailed, frozen=True):
    """The inputs were read, but not every output could be written. The next scan tries again."""


class RivalSeen(msgspec.Struct, frozen=True):
    """Another node publishes states under this device's name."""


class Attended(msgspec.Struct, frozen=True):
    """A change in the publishers of the requests that this device obeys. `yes`: at least one node
    publishes them."""

    yes: bool


class OperatorReset(msgspec.Struct, frozen=True):
    """An operator has run `rmf-bridge reset`. A latched fault may now clear if its cause is gone."""


class AlarmInputs(msgspec.Struct, frozen=True):
    """The causes of an alarm that one device sees. `bridges/kinds/shared/fleet_alarm.py` tells the
    fleets about them.

    `present`: the causes that are seen now. `seen`: the inputs are read, so a cause that is not in
    `present` is over. `drill`: the device asks for a drill.
    """

    present: frozenset[str] = frozenset()
    seen: bool = False
    drill: bool = False


class MemoryKept(msgspec.Struct, frozen=True):
    """The memory was written to disk, so it outlives the daemon. It is the memory that the core had
    before this event."""


class MemoryNotKept(msgspec.Struct, frozen=True):
    """The memory could not be written to disk. The next attempt follows in a second."""

    reason: str


NOT_KEPT: Final = "NOT_KEPT"
"""The code of the fault that a memory is not on disk."""


class DecidedByPerson(msgspec.Struct, frozen=True):
    """A person has decided the outcome of a request with `rmf-bridge workcell`, because the daemon does
    not know that outcome.

    `request`: the request's guid. "" means every request in doubt. With "", the person also accepts
    that the memory of earlier requests is lost.
    """

    verdict: Literal["done", "again", "failed"]
    request: str = ""


class DrillOrdered(msgspec.Struct, frozen=True):
    """A person has run `rmf-bridge drill`. `for_s`: the duration of the drill (s); 0 ends a drill that
    a person has ordered."""

    for_s: float


OrderedByPerson = OperatorReset | DecidedByPerson | DrillOrdered
"""The orders that a person can give to a running daemon."""


class Report(Protocol):
    """The content of RMF's state message and of the status file."""

    @property
    def read_at(self) -> float | None:
        """The monotonic time of the reading behind the report; None before the first reading."""

    @property
    def faults(self) -> tuple[Fault, ...]:
        """All present faults, most serious first."""

    def news(self) -> object:
        """Return the part of the report whose change is published at once. This is everything except
        the age."""


class Decision(msgspec.Struct, Generic[M, O, R], frozen=True):
    """The result of one scan.

    `outputs`: the wanted levels of all outputs. `wake_at`: the time by which the core must decide again
    (monotonic seconds); `inf` if only an event can change anything. `refused`: the reason for a
    refusal, as `kind` or `kind: detail`; "" if the event was obeyed. The daemon counts refusals by
    their `kind`, which is a short fixed name. `publish`: messages in addition to the state, each sent
    once.
    """

    memory: M
    outputs: O
    report: R
    wake_at: float
    refused: str = ""
    publish: tuple[Said, ...] = ()


RELEASED_LATELY = "released a moment ago"
STARTING = "inputs settle after the start"
EXPECTED = frozenset({RELEASED_LATELY, STARTING})
"""Refusals that every normal handover or start causes. They are counted, but cause no warning."""

LONGEST_DETAIL = 300


class RequestRefused(Exception):
    """A message is not obeyed. `kind`: a short fixed name. Refusals are counted by kind, and each kind
    is logged once.

    `detail` may quote the message. Anybody can send a message, so the detail is cut to LONGEST_DETAIL
    characters.
    """

    def __init__(self, kind: str, detail: str) -> None:
        detail = detail[:LONGEST_DETAIL]
        super().__init__(f"{kind}: {detail}")
        self.kind = kind
        self.detail = detail

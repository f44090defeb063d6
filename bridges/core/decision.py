"""What every decision core takes and gives: events in, a Decision out.

A core is one pure function, `decide(memory, event, now, limits) -> Decision`. It has no I/O, no
clock and no log. `now` is monotonic seconds. Each call derives the whole set of outputs and the
whole report afresh, so a repeated, lost or reordered event cannot leave a relay where it should
not be.
"""

from typing import Generic, Protocol, TypeVar

import msgspec

from bridges.rmf.definitions import Message
from bridges.rmf.topics import Topic

X = TypeVar("X")
"""A sample, as a driver decodes it."""
M = TypeVar("M")
"""A core's memory."""
O = TypeVar("O")  # noqa: E741
"""A core's outputs; None for one that moves no hardware."""
R = TypeVar("R", bound="Report")
"""A core's report."""


Said = tuple[Topic[Message], Message]
"""A message and where it goes."""


class Fault(msgspec.Struct, frozen=True):
    """One thing that is wrong, by a name that an engineer knows; `detail` says which and why."""

    code: str
    detail: str = ""

    def __str__(self) -> str:
        return f"{self.code}: {self.detail}" if self.detail else self.code


class Sampled(msgspec.Struct, Generic[X], frozen=True):
    """The driver has read every input once; the reading is as old as `now` when it is decided."""

    sample: X


class IoFailed(msgspec.Struct, frozen=True):
    """A read or a write did not succeed: the outputs are unknown and the inputs not fresh."""

    reason: str


class Suspended(IoFailed, frozen=True):
    """Nobody has read anything for a while: the process was stopped, or the machine slept. What was
    believed is as stale as after a long time without a reading."""


class WriteFailed(IoFailed, frozen=True):
    """The inputs were read, but not every output could be written. The next scan tries again."""


class RivalSeen(msgspec.Struct, frozen=True):
    """Somebody else publishes states under this device's name."""


class OperatorReset(msgspec.Struct, frozen=True):
    """`rmf-bridge reset`: latched faults may clear if their cause is gone."""


class Report(Protocol):
    """What RMF and the status file are told. Equal reports are the same news."""

    @property
    def read_at(self) -> float | None:
        """Monotonic time of the reading that the report rests on; None before the first."""

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Everything that is wrong now, most serious first."""

    def news(self) -> object:
        """The part whose change is worth publishing at once: the report without its age."""


class Decision(msgspec.Struct, Generic[M, O, R], frozen=True):
    """The result of one scan.

    `outputs`: the whole set, to be written as it is. `wake_at`: decide again by then at the latest
    (monotonic seconds; `inf` when only an event can change anything). `refused`: why the event was
    not obeyed, as a short fixed kind to count by or as `kind: detail`; "" when it was. `publish`:
    messages beside the state, each to go out once.
    """

    memory: M
    outputs: O
    report: R
    wake_at: float
    refused: str = ""
    publish: tuple[Said, ...] = ()


LONGEST_DETAIL = 300


class RequestRefused(Exception):
    """A message that is not obeyed. `kind` is a short fixed name to count and to log once by.

    `detail` may quote the message, which anybody can send: it is cut to LONGEST_DETAIL characters.
    """

    def __init__(self, kind: str, detail: str) -> None:
        detail = detail[:LONGEST_DETAIL]
        super().__init__(f"{kind}: {detail}")
        self.kind = kind
        self.detail = detail

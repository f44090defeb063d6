"""What one message changed of what is known of a device."""

from dataclasses import dataclass
from typing import Literal

from bridges.observe.requesters import DeviceRequester, Moment

What = Literal[
    "first state",  # of a device that was silent until then
    "states again",  # `gap_s` after the one before
    "read",  # the age of its readings is another now: `text`
    "changed",  # facts in `changed` are others than in the state before
    "asks",  # for something new; of a lift: in the mode `text`
    "passed on",  # the supervisor asks for something new
    "ends",  # a requester; `passed_on` by the supervisor
    "has",  # a requester has it now
    "lost",  # `text` had it until now
    "met",  # RMF sees what a requester waits for
    "gone",  # a requester asks no more, without END
    "over",  # a requester's visit
    "fault",  # of the code `text`, as `who` says, one of its diagnoses
    "fault over",
    "refused",  # a request, by the node that says so: for the reason `text`
]


@dataclass(frozen=True, slots=True)
class News:
    """One thing that a message changed. `who`: the requester, as a text; `requester`: its memory, if it
    has asked. `text`: as `What` says; `gap_s`: how long that had lasted."""

    what: What
    at: Moment
    who: str = ""
    text: str = ""
    requester: DeviceRequester | None = None
    gap_s: float = 0.0
    passed_on: bool = False

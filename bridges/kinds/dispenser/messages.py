"""Turns requests into events, refuses invalid requests, and turns reports into states and results.

The messages of dispensers and ingestors have the same fields, and differ only in their names.
"""

from collections.abc import Callable, Mapping
from typing import Final

from msgspec.structs import replace

from bridges.kinds.dispenser.report import WorkcellReport
from bridges.kinds.dispenser.settings import WorkcellSettings
from bridges.kinds.dispenser.signals import Item, ItemRequested
from bridges.kinds.shared.decision import RequestRefused, Said
from bridges.kinds.shared.kind import RefusalAnswer
from bridges.kinds.shared.names import check_length
from bridges.messages.constants import WorkcellStatus
from bridges.messages.definitions import (
    DispenserRequest,
    DispenserResult,
    DispenserState,
    IngestorRequest,
    IngestorResult,
    IngestorState,
    Time,
)
from bridges.messages.topics import Topic

Request = DispenserRequest | IngestorRequest
State = DispenserState | IngestorState
Result = DispenserResult | IngestorResult
UNSAYABLE: Final = "cannot be asked here"
"""The first words of a refusal for which RMF gets the result FAILED. No repeat of such a request could
ever be obeyed."""


def accept(message: Request, settings: WorkcellSettings) -> ItemRequested:
    """Turn a request into an event. Raises RequestRefused if the request is malformed, or names
    something that the YAML does not list."""
    if not message.request_guid:
        raise RequestRefused("empty request_guid", "a result must name its request")
    check_length(request_guid=message.request_guid, transporter_type=message.transporter_type)
    for field in ("request_guid", "transporter_type"):
        if not (text := getattr(message, field)).isprintable():
            raise RequestRefused(f"impossible {field}", f"{text[:40]!r}")
    return ItemRequested(message.request_guid, _item(message, settings), message.transporter_type)


def _item(message: Request, settings: WorkcellSettings) -> Item:
    if not message.items and not settings.items:
        return Item()
    if len(message.items) != 1:
        raise RequestRefused(
            UNSAYABLE, f"{len(message.items)} sorts of items; one cycle handles one sort"
        )
    [one] = message.items
    found = settings.items.get(one.type_guid)
    if found is None:
        known = ", ".join(settings.items) or "none"
        raise RequestRefused(UNSAYABLE, f"item {one.type_guid[:40]!r}; items has {known}")
    if not 1 <= one.quantity <= found.most:
        raise RequestRefused(UNSAYABLE, f"quantity {one.quantity}; most is {found.most}")
    if one.compartment_name not in (found.compartments or [""]):
        known = ", ".join(found.compartments) or "none"
        raise RequestRefused(
            UNSAYABLE, f"compartment {one.compartment_name[:40]!r}; compartments has {known}"
        )
    return Item(one.type_guid, one.quantity, one.compartment_name)


def device_name(message: Request | State) -> str:
    """Return the workcell that a request or state is about."""
    return message.target_guid if isinstance(message, Request) else message.guid


def state_of(made: type[State]) -> Callable[[str, object, WorkcellReport, Time], State]:
    """Return the function `state_message` of a kind whose states are of the type `made`. The state has
    no `seconds_remaining`, because nobody knows that time."""
    return lambda name, settings, report, stamp: made(
        time=stamp, guid=name, mode=int(report.mode), request_guid_queue=report.queue
    )


def results_on(topic: Topic[Result]) -> Callable[[str, WorkcellReport], tuple[Said, ...]]:
    """Return the function `results` of a kind that sends its results on this topic. The results have no
    stamps yet."""
    return lambda name, report: tuple(
        (topic, topic.type(request_guid=guid, source_guid=name, status=int(status)))
        for guid, status in report.results
    )


def answer_on(
    topic: Topic[Result],
) -> Callable[[str, object, str, WorkcellReport], RefusalAnswer | None]:
    """Return the function `answer` of a kind that sends its results on this topic. The function answers
    FAILED, without a stamp, if no repeat of the request could ever be obeyed."""

    def answer(
        name: str, request: object, reason: str, report: WorkcellReport
    ) -> RefusalAnswer | None:
        if not isinstance(request, Request) or not reason.startswith(UNSAYABLE):
            return None
        if request.request_guid in report.queue:
            return None  # the request in the queue has other items and gets its own result
        failed = topic.type(
            request_guid=request.request_guid, source_guid=name, status=WorkcellStatus.FAILED
        )
        return RefusalAnswer(topic, failed, {"request": request.request_guid, "reason": reason})

    return answer


def stamped(message: Result, stamp: Time) -> Result:
    """Return the result with its time of sending, because RMF ignores a result that is older than the
    last state."""
    return replace(message, time=stamp)


def summary(report: WorkcellReport) -> Mapping[str, str]:
    """Summarise the report in one line, for the log, the status file and `watch`."""
    words = {"mode": report.mode.name, "queue": ", ".join(report.queue) or "-"}
    words |= {"running": report.running, "item": report.item} if report.running else {}
    return {**words, "waits": report.waits} if report.waits else words

"""A notice as text for people: a headline, the sentences of `explain`, and the next step."""

from collections.abc import Iterator
from typing import Final
from urllib.parse import quote

from msgspec import Struct

from bridges.messages.words import KINDS
from workbench.explain.answer import Remedies
from workbench.explain.explanation import Explanation
from workbench.notify.notices import Notice

SAYS: Final = {"new": "", "again": "Still: ", "over": "Over: "}
MOST_SENTENCES: Final = 4


class NoticeText(Struct, frozen=True):
    """A notice as people receive it. `key` names the trouble for `rmf-bridge notify FILE --ack`."""

    event: str
    severity: str
    key: str
    title: str
    text: str
    link: str = ""


def worded(
    notice: Notice, explained: Explanation | None, page: str | None, remedies: Remedies
) -> NoticeText:
    """Write a notice in words. `explained` is the device's present explanation, or None if the device
    is no longer known."""
    trouble = notice.trouble
    lines = [f"The trouble has lasted {_lasted(notice.for_s)}."]
    if notice.event == "over":
        lines = [f"The trouble lasted {_lasted(notice.for_s)}."]
    else:
        lines += _explained(explained, trouble.what, remedies)
    if trouble.severity == "critical" and notice.event != "over":
        lines.append(f"To stop the repeats: rmf-bridge notify FILE --ack '{trouble.key}'")
    link = ""
    if page and trouble.kind in KINDS:
        link = f"{page.rstrip('/')}/{trouble.kind}/{quote(trouble.device, safe='')}"
    title = SAYS[notice.event] + trouble.headline
    return NoticeText(notice.event, trouble.severity, trouble.key, title, "\n".join(lines), link)


def _explained(explained: Explanation | None, code: str, remedies: Remedies) -> Iterator[str]:
    """Yield the sentences of `explain`, and the next steps.

    If the trouble has its own remedy, leave out the step "nobody has to act". That step says only that
    no robot's request needs an action.
    """
    known = {code: remedies[code]} if code in remedies else {}
    if explained is not None:
        yield from explained.now[:MOST_SENTENCES]
        for step in explained.next:
            if step.who != "nobody" or not known:
                yield f"Next, {step.who}: {step.what}."
        known = {one.code: (one.cause, one.do) for one in explained.faults if one.do} | known
    yield from (f"{code}: {cause}. {do}" for code, (cause, do) in known.items())


def _lasted(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"

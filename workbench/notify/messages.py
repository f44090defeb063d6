"""A notice as text for people: a headline, the sentences of `explain`, and the next step."""

import shlex
from collections.abc import Iterator
from datetime import datetime
from typing import Final
from urllib.parse import quote

from msgspec import Struct

from bridges.messages.words import KINDS
from workbench.explain.answer import Remedies
from workbench.explain.explanation import Explanation
from workbench.notify.notices import Notice
from workbench.notify.troubles import LEFT_ON, NOT_SERVING, SILENT

NEXT: Final = (
    "Next, a person: run `rmf-bridge status` on the machine of its daemon, and do what it says."
)
"""The next step for a daemon that is silent or dead, and that no explanation covers."""
SAYS: Final = {"new": "", "again": "Still: ", "over": "Over: "}
MOST_SENTENCES: Final = 4


class NoticeText(Struct, frozen=True):
    """A notice as people receive it. `key` names the trouble for `rmf-bridge notify FILE --ack`. `at`:
    the local time of the notice, in ISO 8601."""

    event: str
    severity: str
    key: str
    title: str
    text: str
    link: str = ""
    at: str = ""


def worded(
    notice: Notice,
    explained: Explanation | None,
    page: str | None,
    remedies: Remedies,
    at: datetime,
    acknowledge: str,
) -> NoticeText:
    """Write a notice in words. `explained` is the device's present explanation, or None if the device
    is no longer known. `at`: the time of the notice. `acknowledge`: the command that takes `--ack`."""
    trouble = notice.trouble
    lasted = f"had lasted {_lasted(notice.for_s)}"
    if notice.event == "over":
        lines = [f"At {at:%Y-%m-%d %H:%M:%S} the trouble was over; it {lasted}."]
    else:
        lines = [f"At {at:%Y-%m-%d %H:%M:%S} the trouble {lasted}."]
        lines += _explained(explained, trouble.what, remedies)
        if trouble.what in (SILENT, NOT_SERVING, LEFT_ON) and explained is None:
            lines.append(NEXT)
    if trouble.severity == "critical" and notice.event != "over":
        lines.append(f"To stop the repeats: {acknowledge} --ack {shlex.quote(trouble.key)}")
    link = ""
    if page and trouble.kind in KINDS:
        link = f"{page.rstrip('/')}/{trouble.kind}/{quote(trouble.device, safe='')}"
    title = SAYS[notice.event] + trouble.headline
    text, when = "\n".join(lines), at.isoformat(timespec="seconds")
    return NoticeText(notice.event, trouble.severity, trouble.key, title, text, link, when)


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
    yield from (f"{code}: {cause}. Do: {do}" for code, (cause, do) in known.items())


def _lasted(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"

"""Decide when `send` publishes and when `send` ends. If the request has no effect, compose the text
that says why.

`step(request, seen, now)` is pure. Like RMF, `send` repeats a request at 1 Hz until a state shows the
effect. Only a state heard after the first request counts. An earlier state may show the same effect for
another reason. `requests/` has each request's message and the condition that fulfils the request.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from bridges.messages import words
from bridges.observe.limits import SILENT_S
from workbench.graph.requests import Failed, Fulfilled, Obstacle, Request, RequestProgress

REPEAT_S: Final = 1.0
PATIENCE_S: Final = 2.0
"""Time (s) to wait for the device's first state. After this time, `send` sends the request even though
the device is silent. States come at 1 Hz."""
HINT_AFTER_S: Final = 3.0
"""Time (s) after which `send` prints a hint about a missing node. A starting node needs a second or two
to find other nodes."""


@dataclass(frozen=True, slots=True)
class SendStep:
    """The next step: a request to send now, a hint to print once, or the outcome.

    With `direct`, the request goes to the device's own daemon instead of the supervisor.
    """

    send: words.Requested | None = None
    hint: str = ""
    outcome: Fulfilled | Failed | None = None
    direct: bool = False


def step(request: Request, seen: RequestProgress, now: float) -> SendStep:
    """Return the next step at time `now` (monotonic s)."""
    over = request.outcome(seen)
    if over is not None:
        return SendStep(outcome=over)
    late = now >= seen.began_at + min(HINT_AFTER_S, seen.timeout_s)
    if late and (wrong_kind := request.misnamed(seen)):
        return SendStep(outcome=Failed(wrong_kind))
    if now >= seen.began_at + seen.timeout_s:
        return SendStep(outcome=Failed(_reason(request, seen, now)))
    hint, direct = _hint(request, seen, now), request.goes_direct(seen, now)
    if not _may_send(request, seen, now, direct=direct):
        return SendStep(hint=hint)
    return SendStep(request.message(seen), hint, direct=direct)


def _may_send(request: Request, seen: RequestProgress, now: float, *, direct: bool) -> bool:
    if seen.last_sent_at is not None:
        return now >= seen.last_sent_at + REPEAT_S
    heard_or_late = request.ready(seen) or now >= seen.began_at + PATIENCE_S
    return (direct or seen.listeners > 0) and heard_or_late


def _hint(request: Request, seen: RequestProgress, now: float) -> str:
    """Return a hint for the user, or "". The hint comes before the timeout."""
    if now < seen.began_at + HINT_AFTER_S:
        return ""
    if missed := _missed(request, seen):
        return _said(missed)
    if seen.first_sent_at is None or now < seen.first_sent_at + PATIENCE_S:
        return ""
    obstacle = _first(request.obstacles(seen))
    return _said(obstacle) if obstacle.remedy else ""


def _reason(request: Request, seen: RequestProgress, now: float) -> str:
    """Return why the request timed out, and what the user should check next."""
    if missed := _missed(request, seen):
        return _given_up("", seen) if _said(missed) in seen.hinted else _said(missed)
    silent_s = now - seen.stated_at
    if silent_s > SILENT_S:
        return f"{request.name} fell silent {silent_s:.0f} s ago: is its daemon still running?"
    obstacle = _first(request.obstacles(seen))
    state = words.described(seen.states[-1])
    whole = _said(obstacle._replace(text=f"{obstacle.text} (last state: {state})"))
    return (
        whole if _said(obstacle) not in seen.hinted else _given_up(f"; last state: {state}", seen)
    )


def _missed(request: Request, seen: RequestProgress) -> Obstacle | None:
    """Return the obstacle that a node is missing on the graph. The missing node is the request's
    receiver or the device. Return None if neither is missing."""
    if seen.first_sent_at is None and seen.listeners == 0:
        return request.nobody(seen)
    return None if seen.states else request.unheard(seen)


def _given_up(more: str, seen: RequestProgress) -> str:
    """Return the text of a timeout whose reason an earlier hint has already given."""
    return f"gave up after {seen.timeout_s:g} s{more}"


def _first(obstacles: Iterable[Obstacle]) -> Obstacle:
    return next(obstacle for obstacle in obstacles if obstacle.present)


def _said(obstacle: Obstacle) -> str:
    return f"{obstacle.text}; {obstacle.remedy}" if obstacle.remedy else obstacle.text

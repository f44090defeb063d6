"""The notices that wait for a recipient that does not take them."""

import json

import pytest
from msgspec.structs import replace

from tests.waiting import wait_until
from tests.workbench.notify.sink import Sink
from workbench.notify import courier
from workbench.notify.courier import MOST_WAITING, Courier
from workbench.notify.messages import NoticeText
from workbench.notify.settings import Recipient

AGAIN = NoticeText("again", "critical", "lift Lift1: SILENT", "Still: Lift1 is silent", "1")


@pytest.fixture(autouse=True)
def _tries_again_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(courier, "RETRY_S", (0.05,))


def test_a_repeat_takes_the_place_of_the_repeat_that_waits(sink: Sink) -> None:
    """After a night without a recipient, one repeat is enough."""
    sink.status = 500
    waits = Courier(Recipient(webhook=sink.url))
    new, other = replace(AGAIN, event="new"), replace(AGAIN, key="door ward: SILENT")
    for one in (new, AGAIN, other, replace(AGAIN, text="2"), replace(AGAIN, text="3")):
        waits.take(one)
    wait_until(lambda: sink.got, "a try")
    assert waits.waiting == [new, other, replace(AGAIN, text="3")]
    sink.status = 200
    wait_until(lambda: not waits.waiting, "each notice is taken")
    assert [json.loads(body)["text"][-1] for _, body in sink.got][-3:] == ["1", "1", "3"]


def test_the_oldest_of_too_many_notices_is_dropped(sink: Sink) -> None:
    sink.status = 500
    waits = Courier(Recipient(webhook=sink.url))
    for number in range(MOST_WAITING + 1):
        waits.take(replace(AGAIN, event="new", key=f"{number}"))
    assert [one.key for one in waits.waiting] == [str(n) for n in range(1, MOST_WAITING + 1)]
    sink.status = 200
    wait_until(lambda: not waits.waiting, "each notice is taken")

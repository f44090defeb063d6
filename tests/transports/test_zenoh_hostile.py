"""Samples on zenoh that no ROS node would send."""

import subprocess
import sys

import pytest

from bridges.messages import definitions as d
from bridges.messages.cdr import encode
from bridges.messages.topics import LIFT_REQUESTS
from bridges.transports.zenoh.transport import ZenohTransport
from tests.transports.zenoh_hostile import FLOOD, GOOD, arguments
from tests.waiting import wait_until

BY_HAND = 8
"""The number of forged samples that the node must count before the flood.

- One has no attachment.
- Two have malformed attachments.
- One is cut short, and one is empty.
- Two have 10 MB each.
- One is a deletion.

Two more samples follow. The first has a wrong hash in its key, so the node does not hear it. The second
has a wildcard in its key, and the node counts it.
"""


def test_forged_samples_are_dropped_and_counted_and_the_good_ones_after_them_arrive(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    received: list[d.LiftRequest] = []
    node = ZenohTransport("listener", domain, loopback=True)
    command = [sys.executable, "-m", "tests.transports.zenoh_hostile", *arguments(domain)]
    try:
        node.subscribe(LIFT_REQUESTS, received.append)
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as child:
            assert child.stdin is not None
            assert child.stdout is not None
            assert child.stdout.readline() == "flooded\n"
            received.clear()
            wait_until(lambda: len(received) >= 3, "good messages arrive after the flood")
            child.stdin.close()
            child.wait()
    finally:
        node.close()
    assert set(map(repr, received)) == {repr(GOOD)}
    # Up to a hundred samples of the flood wait for our thread. The transport drops the others unread.
    assert BY_HAND + 1 < node.dropped["lift_requests"] <= BY_HAND + 1 + FLOOD
    # The whole flood makes one line in the log. On a busy machine the line may name a later sample than
    # the first forged one.
    (said,) = caplog.messages
    assert said.startswith("sample_dropped topic=lift_requests reason=")


def test_nothing_forged_is_taken_for_a_message(domain: int) -> None:
    """Our node takes no forged sample for a message. It does not hear a key with a wrong hash. It
    counts a key with a wildcard as dropped."""
    received: list[d.LiftRequest] = []
    node = ZenohTransport("listener", domain, loopback=True)
    liar = ZenohTransport("liar", domain, loopback=True)
    try:
        node.subscribe(LIFT_REQUESTS, received.append)
        voice = liar.publisher(LIFT_REQUESTS)
        wait_until(voice.matched, "they meet")
        session = liar._session
        assert session is not None
        key = voice.place.key if voice.place else ""
        sample = encode(d.LiftRequest, d.LiftRequest("forged"))
        session.put(key[:-64] + "0" * 64, sample)
        session.put(key.rsplit("/", 1)[0] + "/*", sample)
        session.put(f"{domain}/**", sample)
        voice.publish(d.LiftRequest("true"))
        wait_until(lambda: received, "the true message arrives")
        wait_until(lambda: node.dropped == {"lift_requests": 2}, "the wildcards are counted")
    finally:
        liar.close()
        node.close()
    assert received == [d.LiftRequest("true")]

"""Another process on the graph: `python -m tests.transports.peer WHAT DOMAIN TRANSPORT`.

The process ends when its stdin ends. WHAT is `echo` or `hostile`. `echo` returns each message of
`ping_<topic>` on `pong_<topic>`, for every topic. `hostile` sends forged samples as LiftRequests.
"""

import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from bridges.messages import topics
from bridges.messages.topics import Topic
from bridges.transports.transport import Publisher
from tests.transports import zenoh_hostile
from tests.transports.joining import RELEASE, joining
from tests.waiting import wait_until

TOPICS: dict[str, Topic[Any]] = {
    name: topic
    for name, topic in vars(topics).items()
    if isinstance(topic, Topic) and RELEASE.has(topic.type)
}


@contextmanager
def running(what: str, domain: int, transport: str = "dds") -> Iterator[None]:
    """Run the peer as a child process until the `with` block ends."""
    command = [sys.executable, "-m", "tests.transports.peer", what, str(domain), transport]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as child:
        try:
            yield
        finally:
            assert child.stdin is not None
            child.stdin.close()
            child.wait()


def echo(domain: int, transport: str) -> None:
    """Return every message of `ping_<topic>` on `pong_<topic>`, for every topic."""
    node = joining(transport, domain)("echo")
    for topic in TOPICS.values():
        back = node.publisher(topic.named(f"pong_{topic.name}"))
        node.subscribe(topic.named(f"ping_{topic.name}"), back.publish)
    sys.stdin.read()
    node.close()


def sent(publisher: Publisher[Any], message: Any) -> bool:
    """Publish the message, and return False.

    In a condition of `wait_until`, this call sends the message again at each check.
    """
    publisher.publish(message)
    return False


GOOD = bytes.fromhex(
    "00010000 06000000 4c696674 3100 0000 05000000 06000000"
    "0c000000 666c6565 742f726f 626f7400 01 000000 03000000 4c330002"
)
"""The CDR bytes of LiftRequest("Lift1", Time(5, 6), "fleet/robot", 1, "L3", 2)."""

DECODED_BY_NOBODY = {
    "cut short": GOOD[:20],
    "only a header": GOOD[:4],
    "a string without its NUL": GOOD.replace(b"Lift1\0", b"Lift1x"),
    "a string longer than the sample": GOOD.replace(b"\6\0\0\0Lift", b"\xff\xff\xff\xffLift"),
}
"""Forged samples, by their defect. Cyclone's C library refuses these samples."""

COUNTED_AS_DROPPED = {
    "not UTF-8": GOOD.replace(b"Lift1", b"\xff\xfe\x80ft"),
    "a NUL inside a string": GOOD.replace(b"Lift1", b"L\0ft1"),
    "more than a LiftRequest": GOOD + b"\1\2\3\4\5\6\7\x08",
    "another encoding": b"\0\x07" + GOOD[2:],
}
"""Forged samples, by their defect. Cyclone's C library accepts these samples. Our decoder refuses
them."""


def hostile(domain: int, transport: str) -> None:
    """Match as an honest writer does, then send forged samples under that writer's id.

    The forged samples use up the writer's next sequence numbers. So the first of its fifty good samples
    are lost, and only the later samples arrive.
    """
    if transport == "zenoh":
        zenoh_hostile.main(*zenoh_hostile.arguments(domain))
        return
    from cyclonedds.domain import Domain, DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.topic import Topic as DdsTopic

    from bridges.transports.cyclone import LOOPBACK
    from tests.transports import idl_types

    kept = Domain(domain, LOOPBACK)
    participant = DomainParticipant(domain)
    cdr = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)
    qos = Qos(Policy.Reliability.Reliable(0), Policy.History.KeepLast(100), cdr)
    topic = DdsTopic(participant, "rt/lift_requests", idl_types.LiftRequest)
    writer = DataWriter(participant, topic, qos=qos)
    wait_until(writer.get_matched_subscriptions, "somebody listens")
    writer.write(idl_types.LiftRequest("before", idl_types.Time(0, 0), "", 0, "", 0))
    writer.wait_for_acks(10_000_000_000)  # afterwards the listener knows the writer
    forged = [GOOD, *DECODED_BY_NOBODY.values(), *COUNTED_AS_DROPPED.values()]
    for number, sample in enumerate(forged, start=2):
        _send_raw(domain, _data_packet(writer.guid.bytes, number, sample))
    for _ in range(50):
        writer.write(idl_types.LiftRequest("after", idl_types.Time(0, 0), "", 0, "", 0))
    sys.stdin.read()
    del writer, topic, participant, kept


def _data_packet(guid: bytes, number: int, sample: bytes) -> bytes:
    """Return an RTPS 2.1 message with one DATA submessage. The submessage goes to all readers."""
    header = b"RTPS\x02\x01\x01\x10" + guid[:12]
    body = struct.pack("<HHI", 0, 16, 0) + guid[12:] + struct.pack("<iI", 0, number) + sample
    return header + struct.pack("<BBH", 0x15, 0x05, len(body)) + body


def _send_raw(domain: int, packet: bytes) -> None:
    """Send the packet to the first four processes of the domain. Each process receives data on a UDP
    port of its own. The port's number follows from the domain and the index of the process."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for index in range(4):
            sender.sendto(packet, ("127.0.0.1", 7400 + 250 * domain + 11 + 2 * index))


if __name__ == "__main__":
    {"echo": echo, "hostile": hostile}[sys.argv[1]](int(sys.argv[2]), sys.argv[3])

"""A DDS node with Cyclone's own settings, like RMF's nodes. Unlike our nodes, it may send samples of
any size.

`python -m tests.transports.long_samples DOMAIN BYTES SECONDS` sends on every topic that a daemon hears.
Each message has a text of that many bytes. In the end the program prints the number of sent samples.

With DOMAIN alone the program answers each state of a door until its stdin ends. The answer is a request
with the time of the state.
"""

import sys
import time
from contextlib import suppress
from select import select
from typing import Any, Final

from cyclonedds.core import DDSException
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic
from msgspec.structs import replace

from bridges.messages.definitions import DoorRequest, DoorState, field_types
from bridges.messages.topics import every
from bridges.transports.cyclone import FOUND_AGAIN, INTERNAL, LOOPBACK
from bridges.transports.dds.idl import sample_type

AS_RMF: Final = LOOPBACK.replace(INTERNAL, "").replace(FOUND_AGAIN, "")
"""The configuration for loopback. All other settings are Cyclone's defaults, as in RMF's own nodes."""
RELIABLE: Final = (
    Policy.Reliability.Reliable(1_000_000_000),
    Policy.History.KeepLast(20),
    Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
)
QOS: Final = Qos(Policy.Durability.TransientLocal, *RELIABLE)
QOS_LIVE: Final = Qos(Policy.Durability.Volatile, *RELIABLE)


def main(domain: int, length: int, seconds: float) -> None:
    """Send on all topics in turn, as fast as possible."""
    kept = Domain(domain, AS_RMF)
    participant = DomainParticipant(domain)
    pairs: list[tuple[DataWriter, Any]] = []
    for topic in every():
        texts = [name for name, kind in field_types(topic.type).items() if kind is str]
        if texts:
            kind = sample_type(topic.type)
            message = kind(replace(topic.type(), **{texts[0]: "x" * length}))
            there = DdsTopic(participant, f"rt/{topic.name}", kind)
            pairs.append((DataWriter(participant, there, qos=QOS), message))
    sent, until = 0, time.monotonic() + seconds
    while time.monotonic() < until:
        for writer, message in pairs:
            if writer.get_matched_subscriptions():
                with suppress(DDSException):  # a write fails after 1 s if the reader is too slow
                    writer.write(message)
                    sent += 1
        time.sleep(0.001)
    sys.stdout.write(f"{sent}\n")
    del pairs, participant, kept


def echo(domain: int) -> None:
    """Answer each DoorState with a request until stdin ends."""
    kept = Domain(domain, AS_RMF)
    participant = DomainParticipant(domain)
    state, request = sample_type(DoorState), sample_type(DoorRequest)
    reader = DataReader(participant, DdsTopic(participant, "rt/door_states", state), qos=QOS_LIVE)
    writer = DataWriter(participant, DdsTopic(participant, "rt/door_requests", request), qos=QOS)
    while not select([sys.stdin], [], [], 0.02)[0]:
        for sample in reader.take(100):
            if sample.sample_info.valid_data:
                writer.write(request(DoorRequest(sample.message.door_time, "rmf")))
    del reader, writer, participant, kept


if __name__ == "__main__":
    if len(sys.argv) == 2:
        echo(int(sys.argv[1]))
    else:
        main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))

"""A foreign type with the name of our type but with other fields.

Either the sender has another release of RMF, or the sender lies.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl.types import int32
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.topic import Topic

from bridges.messages import definitions as d
from bridges.messages.topics import LIFT_REQUESTS
from bridges.transports.dds.transport import DdsTransport
from tests.waiting import wait_until

# mypy knows nothing of cyclonedds.
# mypy: disable-error-code="misc, call-arg"


@annotations.final
@dataclass
class LiftRequest(IdlStruct, typename="rmf_lift_msgs.msg.dds_.LiftRequest_"):
    priority: int32
    lift_name: str


class Lift:
    """A lift's node, and the list of the requests that it has heard."""

    def __init__(self, domain: int) -> None:
        self.domain = domain
        self.heard: list[d.LiftRequest] = []
        self.node = DdsTransport("lift", self.domain, loopback=True)
        self.subscription = self.node.subscribe(LIFT_REQUESTS, self.heard.append)


@pytest.fixture
def lift(domain: int) -> Iterator[Lift]:
    made = Lift(domain)
    yield made
    made.node.close()


def test_requests_of_a_namesake_are_not_heard_and_those_of_rmf_are(
    lift: Lift, caplog: pytest.LogCaptureFixture
) -> None:
    participant = DomainParticipant(lift.domain)
    cdr = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)
    qos = Qos(Policy.Reliability.Reliable(0), Policy.History.KeepLast(100), cdr)
    writer = DataWriter(participant, Topic(participant, "rt/lift_requests", LiftRequest), qos=qos)
    rmf = DdsTransport("rmf", lift.domain, loopback=True)
    try:
        wait_until(
            lambda: any("its type does not fit" in t for t in caplog.messages),
            "the log names the type that does not fit",
        )
        writer.write(LiftRequest(7, "Lift1"))
        requests = rmf.publisher(LIFT_REQUESTS)
        wait_until(requests.matched, "RMF's own publisher is served")
        requests.publish(d.LiftRequest("Lift1"))
        wait_until(lambda: lift.heard, "RMF's request is heard")
        assert lift.heard == [d.LiftRequest("Lift1")]
        assert lift.subscription.matched() == 1
    finally:
        rmf.close()
        for entity in (writer, participant):
            entity.__del__()

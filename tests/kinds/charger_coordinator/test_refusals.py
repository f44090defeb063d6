"""The coordinator publishes each refusal of a robot's or operator's wish on the same topic and in the
same form as a charger."""

from dataclasses import dataclass, field
from pathlib import Path

from msgspec.structs import replace

from bridges.kinds.charger.refusals import ChargerRefusal, read
from bridges.kinds.charger_coordinator import KIND
from bridges.messages import topics
from bridges.messages.definitions import ChargerRequest, Duration
from bridges.runtime.clock import Clock
from bridges.runtime.graph_node import GraphNode
from bridges.settings.load import load
from tests.transports.memory import MemoryNetwork, MemoryTransport

SITE = load(Path("config/charger_coordinator.yaml")).section
WISH = ChargerRequest("charger_a", "tiny", "AMR03", Duration(60), "wish-1")


@dataclass
class Office:
    """The coordinator's node on a network, and an operator. `heard` has the refusals that the operator
    gets."""

    now: float = 0.0
    heard: list[ChargerRefusal | None] = field(default_factory=list)

    def __post_init__(self) -> None:
        network = MemoryNetwork()
        clock = Clock(lambda: self.now, lambda: 1e9 + self.now)
        self.node = GraphNode(KIND, SITE, MemoryTransport(network, "coordinator"), clock)
        self.node.subscribe()
        operator = MemoryTransport(network, "operator")
        self.asks = operator.publisher(topics.ADAPTER_CHARGER_REQUESTS).publish
        operator.subscribe(topics.CHARGER_REFUSALS, lambda status: self.heard.append(read(status)))

    def rounds(self, until: float) -> None:
        """Let the node work once each quarter of a second until the time `until`."""
        while self.now < until:
            self.node.round()
            self.now += 0.25


def refused(reason: str, charger: str = "charger_a", robot: str = "tiny/AMR03") -> ChargerRefusal:
    return ChargerRefusal(request_id="wish-1", charger=charger, robot=robot, reason=reason)


def test_a_wish_for_an_unsuitable_station_is_answered() -> None:
    office = Office()
    office.rounds(5.0)
    office.asks(WISH)
    office.rounds(6.0)
    assert office.heard == [refused("station does not suit the robot")]
    assert office.node.status()["last_refusal"]["reason"] == "station does not suit the robot"


def test_a_wish_of_an_unknown_robot_is_answered() -> None:
    office = Office()
    office.rounds(5.0)
    office.asks(replace(WISH, robot_name="AMR09", charger_name=""))
    office.rounds(6.0)
    reason = "robot not ours: tiny/AMR09 is in no fleet of the YAML"
    assert office.heard == [refused(reason, "any", "tiny/AMR09")]


def test_an_accepted_wish_is_not_answered() -> None:
    office = Office()
    office.rounds(5.0)
    office.asks(replace(WISH, charger_name="charger_b"))
    office.rounds(6.0)
    assert office.heard == []


def test_a_wish_is_answered_only_after_the_quiet_start() -> None:
    office = Office()
    office.asks(WISH)
    office.rounds(2.0)
    assert office.heard == []
    office.rounds(5.0)
    assert office.heard == [refused("station does not suit the robot")]

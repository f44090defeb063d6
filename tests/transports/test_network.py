"""A machine whose network comes, goes and changes, and ROS's environment variables for peers."""

from collections.abc import Iterator
from contextlib import suppress

import pytest

from bridges.messages import definitions as d
from bridges.messages.topics import DOOR_STATES, FIRE_ALARM_TRIGGER
from bridges.transports import addresses, cyclone
from bridges.transports.cyclone import LOOPBACK
from bridges.transports.transport import TransportError
from tests.transports import peer
from tests.transports.conftest import ROS2
from tests.transports.joining import joining
from tests.waiting import wait_until

INTERNAL = (
    "<Internal><MultipleReceiveThreads>false</MultipleReceiveThreads>"
    "<WriterLingerDuration>100 ms</WriterLingerDuration><MaxSampleSize>1048576 B</MaxSampleSize>"
    "<DefragReliableMaxSamples>1</DefragReliableMaxSamples>"
    "<PrimaryReorderMaxSamples>1</PrimaryReorderMaxSamples>"
    "<SecondaryReorderMaxSamples>1</SecondaryReorderMaxSamples></Internal>"
)
AUTO = (
    f"<CycloneDDS><Domain>{INTERNAL}<Discovery><SPDPInterval>2 s</SPDPInterval>"
    "<InitialLocatorPruneDelay>inf</InitialLocatorPruneDelay>"
    "<DiscoveredLocatorPruneDelay>inf</DiscoveredLocatorPruneDelay>"
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>{}</Discovery></Domain></CycloneDDS>"
)
ON_ROS = (
    f"<CycloneDDS><Domain>{INTERNAL}<Discovery><SPDPInterval>2 s</SPDPInterval></Discovery></Domain>"
    "</CycloneDDS>"
)
ALARM = FIRE_ALARM_TRIGGER.named("ping_fire_alarm_trigger")
PEERS = '<Peers><Peer address="10.0.0.5"/><Peer address="rmf.local"/></Peers>'


@pytest.mark.parametrize(
    ("environ", "wanted"),
    [
        ({}, AUTO.format("")),
        ({"ROS_STATIC_PEERS": "10.0.0.5;rmf.local"}, AUTO.format(PEERS)),
        ({"ROS_STATIC_PEERS": ";; 10.0.0.5; rmf.local ;"}, AUTO.format(PEERS)),
        (
            {"ROS_STATIC_PEERS": '"<&'},
            AUTO.format('<Peers><Peer address="&quot;&lt;&amp;"/></Peers>'),
        ),
        (
            {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_STATIC_PEERS": "10.0.0.5"},
            AUTO.format(
                '<Peers><Peer address="localhost"/><Peer address="10.0.0.5"/></Peers>'
            ).replace(
                "<Domain>", "<Domain><General><AllowMulticast>false</AllowMulticast></General>"
            ),
        ),
        ({"CYCLONEDDS_URI": "file:///c.xml"}, AUTO.format("") + ",file:///c.xml"),
        (
            {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT", "ROS_STATIC_PEERS": "10.0.0.5"},
            ON_ROS,
        ),
    ],
)
def test_ross_variables_become_cyclones_configuration(environ: dict[str, str], wanted: str) -> None:
    assert cyclone.configuration(environ) == wanted


def test_a_ros_node_has_our_settings_before_the_users_own_which_prevail() -> None:
    assert cyclone.for_ros({}) == ON_ROS
    assert cyclone.for_ros({"CYCLONEDDS_URI": "file:///c.xml"}) == f"{ON_ROS},file:///c.xml"


def test_on_loopback_a_node_has_the_same_settings() -> None:
    assert INTERNAL in LOOPBACK
    assert "<SPDPInterval>2 s</SPDPInterval>" in LOOPBACK


class Machine:
    """The network addresses of a machine, as the test sets them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._monkeypatch = monkeypatch
        self.addresses: addresses.Addresses = frozenset({(2, "10.0.0.7")})

    def goes_down(self) -> None:
        """Take the network away. Cyclone then finds no interface, Fast DDS no peer, and rclpy no
        middleware."""
        self._monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK.replace('"lo"', '"no-such-interface"'))
        self._monkeypatch.setenv("ROS_STATIC_PEERS", "no such host")
        self.addresses = frozenset()

    def comes_back(self) -> None:
        """Bring the network back. In these tests the network is the loopback interface."""
        self._monkeypatch.delenv("ROS_STATIC_PEERS", raising=False)
        self._monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Machine:
    """Return a machine with made-up addresses. Its nodes react to these addresses, but stay on
    loopback."""
    made = Machine(monkeypatch)
    monkeypatch.setattr(addresses, "addresses", lambda: made.addresses)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")  # Fast DDS reads this variable
    made.comes_back()
    return made


class Echoed:
    """A node under test, and a process that sends the node's messages back."""

    def __init__(self, transport: str, domain: int) -> None:
        self.domain = domain
        self.node = joining(transport, domain, loopback=False)("node")
        self.heard: list[d.Message] = []
        self.node.subscribe(DOOR_STATES.named("pong_door_states"), self.heard.append)
        self.node.subscribe(FIRE_ALARM_TRIGGER.named("pong_fire_alarm_trigger"), self.heard.append)
        self.states = self.node.publisher(DOOR_STATES.named("ping_door_states"))
        self.alarm = self.node.publisher(ALARM)

    def comes_back(self, number: int) -> bool:
        """Send the state with this number. Return whether that state has come back."""
        state = d.DoorState(d.Time(number), "ward")
        with suppress(TransportError):
            self.states.publish(state)
        return state in self.heard


@pytest.fixture(params=["dds", ROS2])
def echoed(request: pytest.FixtureRequest, domain: int, machine: Machine) -> Iterator[Echoed]:
    made = Echoed(request.param, domain)
    with peer.running("echo", domain):
        wait_until(lambda: made.comes_back(1), "the process is found")
        yield made
        made.node.close()


def test_another_address_is_joined_with_all_ends_and_what_was_retained_goes_out_again(
    echoed: Echoed, machine: Machine
) -> None:
    echoed.alarm.publish(d.Bool(True))
    wait_until(lambda: echoed.heard.count(d.Bool(True)) == 1, "the alarm is heard")
    machine.addresses = frozenset({(2, "10.0.0.8")})
    wait_until(lambda: echoed.comes_back(2), "states go there and back")
    before = echoed.heard.count(d.Bool(True))
    with peer.running("echo", echoed.domain):
        wait_until(
            lambda: echoed.heard.count(d.Bool(True)) > before,
            "a process that comes later hears the retained messages",
        )
    later = echoed.node.publisher(DOOR_STATES.named("ping_door_states"))
    wait_until(lambda: later.matched() > 0, "an end that is declared later is matched too")
    later.close()
    assert later.matched() == 0


def test_without_a_network_it_waits_says_so_once_and_is_back_when_the_network_is(
    echoed: Echoed,
    machine: Machine,
    caplog: pytest.LogCaptureFixture,
) -> None:
    machine.goes_down()
    wait_until(
        lambda: any("not_joined" in text for text in caplog.messages), "the node cannot join"
    )
    with pytest.raises(TransportError):
        echoed.states.publish(d.DoorState())
    assert echoed.states.matched() == 0
    meanwhile = echoed.node.publisher(DOOR_STATES.named("ping_door_states"))
    assert meanwhile.matched() == 0
    with pytest.raises(TransportError):
        meanwhile.publish(d.DoorState())
    machine.comes_back()
    wait_until(lambda: echoed.comes_back(2), "states go there and back")
    assert sum("not_joined" in text for text in caplog.messages) == 1


def test_an_alarm_that_is_raised_without_a_network_goes_out_when_there_is_one(
    echoed: Echoed, machine: Machine, caplog: pytest.LogCaptureFixture
) -> None:
    machine.goes_down()
    wait_until(
        lambda: any("not_joined" in text for text in caplog.messages), "the node cannot join"
    )
    declared_meanwhile = echoed.node.publisher(ALARM)
    with pytest.raises(TransportError):
        declared_meanwhile.publish(d.Bool(True))
    machine.comes_back()
    wait_until(lambda: d.Bool(True) in echoed.heard, "the alarm is heard")


def test_a_transport_can_be_closed_while_there_is_no_network(
    echoed: Echoed,
    machine: Machine,
    caplog: pytest.LogCaptureFixture,
) -> None:
    machine.goes_down()
    wait_until(
        lambda: any("not_joined" in text for text in caplog.messages), "the node cannot join"
    )
    echoed.states.close()
    echoed.node.close()
    with pytest.raises(TransportError):
        echoed.alarm.publish(d.Bool(True))


def test_loopback_and_interfaces_without_a_link_reach_no_other_machine() -> None:
    assert "127.0.0.1" not in {address for _, address in addresses.addresses()}

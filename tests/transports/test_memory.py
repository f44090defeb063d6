from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.topics import FIRE_ALARM_TRIGGER, LIFT_STATES, Qos
from tests.transports.memory import MemoryNetwork, MemoryTransport


def test_a_message_is_there_when_publish_returns() -> None:
    network = MemoryNetwork()
    received: list[tuple[str, d.LiftState]] = []
    for name in ("first", "second"):
        node = MemoryTransport(network, name)
        node.subscribe(LIFT_STATES, lambda state, name=name: received.append((name, state)))  # type: ignore[misc]
    state = d.LiftState(lift_name="Lift1")
    MemoryTransport(network, "lift").publisher(LIFT_STATES).publish(state)
    assert received == [("first", state), ("second", state)]


def test_nodes_on_two_networks_never_hear_each_other() -> None:
    received: list[d.LiftState] = []
    MemoryTransport(MemoryNetwork(), "here").subscribe(LIFT_STATES, received.append)
    MemoryTransport(MemoryNetwork(), "there").publisher(LIFT_STATES).publish(d.LiftState())
    assert received == []


def test_the_shallower_of_both_ends_says_how_much_a_late_joiner_gets() -> None:
    for publisher_keeps, late_wants in ((2, 5), (5, 2)):
        topic = replace(
            FIRE_ALARM_TRIGGER,
            publish=Qos("transient_local", publisher_keeps),
            subscribe=Qos("transient_local", late_wants),
        )
        network = MemoryNetwork()
        alarm = MemoryTransport(network, "alarm").publisher(topic)
        for on in (True, True, True, False, True):
            alarm.publish(d.Bool(on))
        received: list[d.Bool] = []
        MemoryTransport(network, "late").subscribe(topic, received.append)
        assert received == [d.Bool(False), d.Bool(True)]

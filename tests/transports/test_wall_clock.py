"""Steps of the wall clock. After a step backwards, `dds` and `ros2` join the graph again."""

import logging
import threading
from contextlib import suppress

import pytest

from bridges.messages import definitions as d
from bridges.messages.topics import DOOR_STATES, FIRE_ALARM_TRIGGER, LIFT_REQUESTS
from bridges.transports import threaded
from bridges.transports.threaded import WallClock, ahead_s
from bridges.transports.transport import TransportError
from tests.transports import peer
from tests.transports.conftest import ROS2
from tests.transports.joining import joining
from tests.waiting import wait_until

YEAR_S = 365.25 * 24 * 3600.0


@pytest.mark.parametrize(
    ("ahead", "found"),
    [
        pytest.param([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], id="a clock that does not step"),
        pytest.param([3600.0, 3600.0], [0.0, 0.0], id="set forward"),
        pytest.param([-3600.0, -3600.0], [3600.0, 0.0], id="set back, found once"),
        pytest.param(
            [10 * YEAR_S, 0.0, -10 * YEAR_S, 0.0, -2.0],
            [0.0, 10 * YEAR_S, 10 * YEAR_S, 0.0, 2.0],
            id="forth, back, back and forth by years, then back by seconds",
        ),
        pytest.param([-1.0, -1.0], [0.0, 0.0], id="a leap second"),
        pytest.param([-0.75, -1.5, -2.25], [0.0, 1.5, 0.0], id="small steps add up"),
        pytest.param([-0.75, 0.0, -0.75], [0.0, 0.0, 0.0], id="what comes back is forgotten"),
    ],
)
def test_a_clock_that_is_set_back_by_more_than_a_second_is_found_once(
    ahead: list[float], found: list[float]
) -> None:
    clock = WallClock(0.0)
    assert [clock.set_back_s(each) for each in ahead] == found


def test_the_clock_is_ahead_of_the_machines_start_by_years_and_runs_with_it() -> None:
    clock = WallClock(ahead_s())
    assert (ahead_s() > YEAR_S, clock.set_back_s(ahead_s())) == (True, 0.0)


@pytest.mark.parametrize("transport", [pytest.param("dds", marks=pytest.mark.dds), ROS2])
def test_a_node_whose_clock_is_set_back_joins_again_with_all_its_ends(
    transport: str,
    domain: int,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """On loopback the node's thread waits for messages without a time limit. So the clock's step must
    wake the thread."""
    caplog.set_level(logging.INFO)
    ahead = [0.0]
    monkeypatch.setattr(threaded, "ahead_s", lambda: ahead[-1])
    node, heard = joining(transport, domain)("node"), list[d.Message]()
    node.subscribe(DOOR_STATES.named("pong_door_states"), heard.append)
    node.subscribe(FIRE_ALARM_TRIGGER.named("pong_fire_alarm_trigger"), heard.append)
    states = node.publisher(DOOR_STATES.named("ping_door_states"))
    alarm = node.publisher(FIRE_ALARM_TRIGGER.named("ping_fire_alarm_trigger"))

    def comes_back(number: int) -> bool:
        state = d.DoorState(d.Time(number), "ward")
        with suppress(TransportError):  # the node cannot publish while it joins again
            states.publish(state)
        return state in heard

    with peer.running("echo", domain):
        wait_until(lambda: comes_back(1), "the process is found")
        alarm.publish(d.Bool(True))
        wait_until(lambda: d.Bool(True) in heard, "the alarm is heard")
        heard.clear()
        ahead.append(-10 * YEAR_S)
        wait_until(lambda: d.Bool(True) in heard, "a new participant sends the retained message")
        wait_until(lambda: comes_back(2), "states go there and back")
        node.close()
    assert [text for text in caplog.messages if "clock" in text] == [
        "clock_set_back node=node by_s=315576000.0"
    ]


@pytest.mark.parametrize("transport", [pytest.param("dds", marks=pytest.mark.dds), ROS2])
def test_a_node_that_joins_again_does_not_take_its_own_alarm_for_another_nodes(
    transport: str, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    ahead = [0.0]
    monkeypatch.setattr(threaded, "ahead_s", lambda: ahead[-1])
    node, other = joining(transport, domain)("node"), joining(transport, domain)("other")
    of_others, everything = list[d.Message](), list[d.Message]()
    node.subscribe(FIRE_ALARM_TRIGGER, of_others.append, others_only=True)
    node.subscribe(FIRE_ALARM_TRIGGER, everything.append)
    ours = node.publisher(FIRE_ALARM_TRIGGER)
    ours.publish(d.Bool(True))
    wait_until(lambda: everything == [d.Bool(True)], "the node has heard its own alarm")
    ahead.append(-10 * YEAR_S)
    wait_until(lambda: len(everything) == 2, "the node has joined again and heard its own alarm")
    other.publisher(FIRE_ALARM_TRIGGER).publish(d.Bool(False))
    wait_until(lambda: d.Bool(False) in of_others, "another node's message is heard")
    node.close()
    other.close()
    assert of_others == [d.Bool(False)]


@pytest.mark.parametrize("transport", [pytest.param("dds", marks=pytest.mark.dds), ROS2])
def test_a_supervisor_that_joins_again_repeats_its_alarm_but_no_request_to_a_lift(
    transport: str, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    ahead = {"supervisor-clock": 0.0}
    monkeypatch.setattr(
        threaded, "ahead_s", lambda: ahead.get(threading.current_thread().name, 0.0)
    )
    supervisor, lift = joining(transport, domain)("supervisor"), joining(transport, domain)("lift")
    asked, rang = list[d.LiftRequest](), list[d.Bool]()
    subscription = lift.subscribe(LIFT_REQUESTS, asked.append)
    lift.subscribe(FIRE_ALARM_TRIGGER, rang.append)
    requests = supervisor.publisher(LIFT_REQUESTS)
    alarm = supervisor.publisher(FIRE_ALARM_TRIGGER)
    wait_until(lambda: requests.matched() and subscription.matched(), "the lift hears requests")
    requests.publish(d.LiftRequest(session_id="a ride that ends"))
    alarm.publish(d.Bool(True))
    wait_until(lambda: asked and rang, "the lift hears the request and the alarm")
    ahead["supervisor-clock"] = -10 * YEAR_S
    wait_until(lambda: len(rang) == 2, "the supervisor has joined again and repeats its alarm")
    wait_until(lambda: requests.matched() and subscription.matched(), "the lift hears requests")
    requests.publish(d.LiftRequest(session_id="a new ride"))
    wait_until(lambda: asked[-1].session_id == "a new ride", "the lift hears the new request")
    supervisor.close()
    lift.close()
    assert [request.session_id for request in asked] == ["a ride that ends", "a new ride"]

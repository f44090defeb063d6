"""Keys, tokens, attachments and caches, as an independent program sees them (rmw_zenoh_reader.py).

That program follows the documents of rmw_zenoh and zenoh-bridge-ros2dds.
"""

import time
from collections.abc import Iterator
from itertools import count
from typing import Any

import pytest

from bridges.messages import definitions as d
from bridges.messages.cdr import encode
from bridges.messages.definitions import LiftState
from bridges.messages.topics import (
    ADAPTER_LIFT_REQUESTS,
    FIRE_ALARM_TRIGGER,
    LIFT_REQUESTS,
    LIFT_STATES,
)
from bridges.transports.zenoh import keys as zenoh_keys
from bridges.transports.zenoh.transport import ZenohTransport
from tests.transports import rmw_zenoh_reader
from tests.transports.domains import domain_of_this_run
from tests.transports.joining import ZENOH
from tests.transports.zenoh_programs import meeting, reading
from tests.waiting import wait_until

DOMAIN = domain_of_this_run()
STATE = (
    "rmf_lift_msgs::msg::dds_::LiftState_"
    "/RIHS01_ce0553cd08eeeb321bdae554efdb6d2ebb2be9755df2e34895cbef55b51f4c06"
)
REQUEST = (
    "rmf_lift_msgs::msg::dds_::LiftRequest_"
    "/RIHS01_e8f1e0aa4d172703d0d7840c1876448c6c5d75ab58955faf7de7dddc17c096ac"
)
ANY_TOKEN = f"@ros2_lv/{DOMAIN}/**"


@pytest.fixture
def node() -> Iterator[ZenohTransport]:
    made = ZenohTransport("lift_node", DOMAIN, loopback=True)
    yield made
    made.close()


@pytest.fixture
def bridged() -> Iterator[ZenohTransport]:
    made = ZenohTransport("lift_node", DOMAIN, loopback=True, settings=ZENOH["zenoh_ros2dds"])
    yield made
    made.close()


def session_of(tokens: list[str], at: int) -> str:
    """Return the session's id, which is the part with the number `at` in each token. All tokens must
    have the same id."""
    (session,) = {token.split("/")[at] for token in tokens}
    assert int(session, 16) > 0
    return session


# --- rmw_zenoh -----------------------------------------------------------------------------------


def test_a_node_and_its_ends_show_as_rmw_zenoh_shows_its_own(node: ZenohTransport) -> None:
    node.publisher(LIFT_STATES)
    node.subscribe(LIFT_REQUESTS, print)
    alarm = node.publisher(FIRE_ALARM_TRIGGER)
    with reading(meeting(DOMAIN), f"tokens {ANY_TOKEN}") as told:
        wait_until(lambda: len(told.values("token")) == 4, "all four tokens are seen")
        session = session_of(told.values("token"), 2)
        ours = f"@ros2_lv/{DOMAIN}/{session}/0"
        fire = (
            "std_msgs::msg::dds_::Bool_"
            "/RIHS01_feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9"
        )
        assert sorted(told.values("token")) == [
            f"{ours}/0/NN/%/%/lift_node",
            f"{ours}/1/MP/%/%/lift_node/%lift_states/{STATE}/::,100:,:,:,,",
            f"{ours}/2/MS/%/%/lift_node/%lift_requests/{REQUEST}/::,100:,:,:,,",
            f"{ours}/3/MP/%/%/lift_node/%fire_alarm_trigger/{fire}/:1:,100:,:,:,,",
        ]
        alarm.close()
        wait_until(lambda: len(told.values("token")) == 5, "one token is gone")
        last = {"token": f"{ours}/3/MP/%/%/lift_node/%fire_alarm_trigger/{fire}/:1:,100:,:,:,,"}
        assert told.lines[-1] == {**last, "is_there": False}
        node.close()
        wait_until(lambda: len(told.values("token")) == 8, "all tokens are gone")
    assert [line["is_there"] for line in told.lines] == [True] * 4 + [False] * 4


def test_a_sample_has_the_key_the_bytes_and_the_attachment_of_rmw_zenoh(
    node: ZenohTransport,
) -> None:
    began_at = time.time_ns()
    states = node.publisher(LIFT_STATES)
    key = f"{DOMAIN}/lift_states/{STATE}"
    with reading(meeting(DOMAIN), f"tokens {ANY_TOKEN}", f"samples {key}") as told:
        wait_until(lambda: len(told.values("token")) == 2, "node and publisher are seen")
        (token,) = [token for token in told.values("token") if "/MP/" in token]
        sent = count()

        def three_have_come() -> bool:
            states.publish(LiftState(lift_name=str(next(sent))))
            return len(told.values("sample")) >= 3

        wait_until(three_have_come, "three samples arrive")
    gid = rmw_zenoh_reader.gid(token).hex()
    numbers = told.values("number")
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert told.values("sample") == [
        encode(LiftState, LiftState(lift_name=str(number - 1))).hex() for number in numbers
    ]
    assert set(told.values("key")) == {key}
    assert set(told.values("attachment_bytes")) == {33}
    assert set(told.values("gid")) == {gid}
    sent_at = [began_at, *told.values("sent_ns"), time.time_ns()]
    assert sent_at == sorted(sent_at)


def test_the_first_sample_of_a_publisher_is_number_one() -> None:
    attachment = zenoh_keys.attachment(1, 2, bytes(range(16)))
    assert attachment.hex() == (
        "0100000000000000020000000000000010000102030405060708090a0b0c0d0e0f"
    )
    assert zenoh_keys.sender(attachment) == bytes(range(16))
    assert zenoh_keys.sender(attachment[:-1]) is None
    assert zenoh_keys.sender(attachment[:16] + b"\x0f" + attachment[17:]) is None


def test_what_we_retain_reaches_a_late_subscriber_of_rmw_zenoh_as_deep_as_it_wants(
    node: ZenohTransport,
) -> None:
    alarm = node.publisher(ADAPTER_LIFT_REQUESTS)
    for number in range(130):
        alarm.publish(d.LiftRequest(destination_floor=str(number)))
    key = f"{DOMAIN}/adapter_lift_requests/{REQUEST}"
    with reading(meeting(DOMAIN), f"history {key} 10", f"history {key} 1000") as told:
        wait_until(lambda: len(told.values("number")) == 110, "both subscribers get their history")
        alarm.publish(d.LiftRequest(destination_floor="new"))
        wait_until(
            lambda: len(told.values("number")) == 112, "both subscribers get the new message"
        )
    assert sorted(told.values("number")) == sorted([*range(121, 131), *range(31, 131), 131, 131])


def heard_from(
    node: ZenohTransport, topic: Any, key: str, token: str, message: Any, depth: str = ""
) -> list[Any]:
    """Return the messages that our subscription hears from another program.

    The other program publishes `message` under `key`. `token` describes the program's publisher.
    """
    received: list[Any] = []
    subscription = node.subscribe(topic, received.append)
    order = f"say {key} {token} {encode(type(message), message).hex()} {depth}".strip()
    with reading(meeting(DOMAIN), order) as told:
        wait_until(lambda: told.values("said"), "the program has spoken")
        wait_until(lambda: received, "the program is heard")
        wait_until(lambda: subscription.matched() == 1, "the program's publisher is counted")
    wait_until(lambda: subscription.matched() == 0, "the program has gone")
    return received


def test_a_publisher_of_rmw_zenoh_is_heard(node: ZenohTransport) -> None:
    request = d.LiftRequest("Lift1", d.Time(5, 6), "fleet/robot", 1, "L3", 2)
    key = f"{DOMAIN}/lift_requests/{REQUEST}"
    token = f"@ros2_lv/{DOMAIN}/SESSION/0/7/MP/%/%/rmf/%lift_requests/{REQUEST}/::,10:,:,:,,"
    assert heard_from(node, LIFT_REQUESTS, key, token, request) == [request]


def test_what_a_publisher_of_rmw_zenoh_retains_is_heard_however_late_it_arrives(
    node: ZenohTransport,
) -> None:
    request = d.LiftRequest("Lift1", d.Time(5, 6), "fleet/robot", 1, "L3", 2)
    name = "adapter_lift_requests"
    key = f"{DOMAIN}/{name}/{REQUEST}"
    token = f"@ros2_lv/{DOMAIN}/SESSION/0/7/MP/%/%/rmf/%{name}/{REQUEST}/:1:,10:,:,:,,"
    assert heard_from(node, ADAPTER_LIFT_REQUESTS, key, token, request, "10") == [request]


@pytest.mark.parametrize(
    "token",
    [
        "@ros2_lv/1/2/3/4/MP/%/%/node/%lift_states",
        "@ros2_lv/1/2/3/4/MP/%/%/node/%lift_states/type/hash/nothing",
        "@ros2_lv",
        "",
    ],
)
def test_a_token_that_says_nothing_is_passed_over(token: str) -> None:
    assert zenoh_keys.RmwZenoh(1, "session", "node").peer(token) is None
    assert zenoh_keys.Ros2Dds(1, "session", "node").peer(token) is None


# --- zenoh-bridge-ros2dds ------------------------------------------------------------------------


def test_a_node_and_its_ends_show_as_a_bridge_shows_a_domain(bridged: ZenohTransport) -> None:
    bridged.publisher(LIFT_STATES)
    bridged.subscribe(ADAPTER_LIFT_REQUESTS, print)
    with reading(meeting(DOMAIN), "tokens @/*/@ros2_lv/**") as told:
        wait_until(lambda: len(told.values("token")) == 3, "all three tokens are seen")
    session = session_of(told.values("token"), 1)
    state_hash, request_hash = STATE.split("/")[1], REQUEST.split("/")[1]
    assert sorted(told.values("token")) == [
        f"@/{session}/@ros2_lv",
        f"@/{session}/@ros2_lv/MP/lift_states/rmf_lift_msgs§msg§LiftState"
        f"/:1:0:0,100:typehash={state_hash};",
        f"@/{session}/@ros2_lv/MS/adapter_lift_requests/rmf_lift_msgs§msg§LiftRequest"
        f"/:1:1:0,100:typehash={request_hash};",
    ]


def test_a_topic_in_a_namespace_keeps_its_slashes_in_the_key_and_not_in_the_token() -> None:
    topic = LIFT_STATES.named("/site/lift_states")
    ros, dds = zenoh_keys.RmwZenoh(7, "5e", "node"), zenoh_keys.Ros2Dds(7, "5e", "node")
    assert ros.data(topic) == f"7/site/lift_states/{STATE}"
    assert "/%site%lift_states/" in ros.token("MP", topic, 1)
    assert dds.data(topic) == "site/lift_states"
    assert "/site§lift_states/" in dds.token("MP", topic, 1)


def test_what_a_bridge_brings_has_no_attachment_and_is_heard(bridged: ZenohTransport) -> None:
    state = LiftState(lift_name="Lift1")
    token = "@/SESSION/@ros2_lv/MP/lift_states/rmf_lift_msgs§msg§LiftState/:1:0:0,10"
    assert heard_from(bridged, LIFT_STATES, "lift_states", token, state) == [state]

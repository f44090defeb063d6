"""Requirements on every transport with a real wire, tested in one process.

The tests check threads, and publishers and subscriptions whose QoS does not match. After a node closes,
no thread and no file may remain.
"""

import os
import threading
from typing import Any

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.cdr import CdrError
from bridges.messages.topics import FIRE_ALARM_TRIGGER, LIFT_REQUESTS, LIFT_STATES, VOLATILE
from tests.transports import peer
from tests.transports.joining import Join
from tests.waiting import wait_until


def test_messages_arrive_on_the_thread_of_the_transport(join_any_wire: Join) -> None:
    threads: list[str] = []
    listener = join_any_wire("listener")
    listener.subscribe(LIFT_STATES, lambda _: threads.append(threading.current_thread().name))
    publisher = join_any_wire("speaker").publisher(LIFT_STATES)
    wait_until(lambda: threads or peer.sent(publisher, d.LiftState()), "a message arrives")
    assert {name.rpartition("-")[0] for name in threads} == {"listener"}


def test_nodes_that_come_and_go_leave_no_thread_no_file_and_no_complaint_behind(
    join_any_wire: Join, caplog: pytest.LogCaptureFixture
) -> None:
    def come_and_go() -> None:
        node = join_any_wire("guest")
        node.subscribe(LIFT_REQUESTS, print)
        node.publisher(LIFT_STATES).publish(d.LiftState())
        node.close()

    for _ in range(5):  # a library may keep the threads and files of its first use
        come_and_go()
    before = _threads_and_files()
    for _ in range(10):
        come_and_go()
    wait_until(lambda: _threads_and_files() <= before, "threads and files are as before")
    assert caplog.messages == []


def test_a_node_leaves_the_graph_at_the_end_of_a_process_that_can_start_no_thread(
    join_any_wire: Join, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python 3.12.0 and 3.12.1 start no thread in an atexit callback."""

    def start(thread: threading.Thread) -> None:
        raise RuntimeError("can't create new thread at interpreter shutdown")

    stays, leaves = join_any_wire("stays"), join_any_wire("leaves")
    subscription = stays.subscribe(LIFT_STATES, print)
    leaves.publisher(LIFT_STATES)
    wait_until(subscription.matched, "the publisher is found")
    monkeypatch.setattr(threading.Thread, "start", start)
    leaves.close()
    monkeypatch.undo()
    wait_until(lambda: subscription.matched() == 0, "the publisher has gone")


def test_a_peer_whose_durability_does_not_fit_is_named_once(
    join_any_wire: Join, caplog: pytest.LogCaptureFixture
) -> None:
    join_any_wire("listener").subscribe(FIRE_ALARM_TRIGGER, print)
    join_any_wire("stranger").publisher(replace(FIRE_ALARM_TRIGGER, publish=VOLATILE))
    wait_until(lambda: len(caplog.messages) == 2, "both ends log the misfit")
    assert sorted(caplog.messages) == [
        'misfit topic=fire_alarm_trigger reason="a publisher is not heard:'
        ' its durability does not fit ours"',
        'misfit topic=fire_alarm_trigger reason="a subscription is not served:'
        ' its durability does not fit ours"',
    ]


def _threads_and_files() -> tuple[int, int]:
    return len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd"))


WRITES = {"dds": "_write", "ros2": "_write", "zenoh": "_put"}
"""The method of a publisher that gives a message to the library."""


def join_again(node: Any) -> None:
    """Let a node leave the graph and join again, in its own thread."""
    if node.speaks == "zenoh":
        node._orders.put(node._join_anew)
    else:
        node._set_back = True
        node._wake()


def test_a_message_that_is_published_while_the_node_joins_again_stays_the_last_one_retained(
    join_any_wire: Join, monkeypatch: pytest.MonkeyPatch
) -> None:
    node: Any = join_any_wire("node")
    alarm = node.publisher(FIRE_ALARM_TRIGGER)
    alarm.publish(d.Bool(False))
    meanwhile = threading.Thread(target=alarm.publish, args=(d.Bool(True),))
    kind, name = type(alarm), WRITES[node.speaks]
    writes = getattr(kind, name)

    def write(publisher: Any, *arguments: object) -> None:
        if threading.current_thread() is node._thread and not meanwhile.ident:
            meanwhile.start()
            meanwhile.join(0.2)  # it has ended by then if nothing holds it back
        writes(publisher, *arguments)

    monkeypatch.setattr(kind, name, write)
    join_again(node)
    wait_until(lambda: meanwhile.ident and not meanwhile.is_alive(), "the message is published")
    heard: list[d.Bool] = []
    join_any_wire("late").subscribe(FIRE_ALARM_TRIGGER, heard.append)
    wait_until(lambda: len(heard) == 2, "a node that comes late hears what is retained")
    assert heard == [d.Bool(False), d.Bool(True)]


def test_a_message_that_cannot_be_put_into_bytes_does_not_keep_the_node_from_joining_again(
    join_any_wire: Join, caplog: pytest.LogCaptureFixture
) -> None:
    node, everything = join_any_wire("node"), list[d.Bool]()
    node.subscribe(FIRE_ALARM_TRIGGER, everything.append)
    alarm = node.publisher(FIRE_ALARM_TRIGGER)
    alarm.publish(d.Bool(True))
    with pytest.raises(CdrError):
        alarm.publish(d.DoorState())  # type: ignore[arg-type]
    wait_until(lambda: len(everything) == 1, "the alarm is heard")
    join_again(node)
    wait_until(lambda: len(everything) == 2, "the node has joined again and repeats its alarm")
    assert (everything, node.lives) == ([d.Bool(True)] * 2, True)
    assert caplog.messages == []


def test_what_another_node_retains_is_heard_once_although_the_node_joins_again(
    join_any_wire: Join,
) -> None:
    # The panel joins first: without a router, nodes on zenoh meet at the port of the first node.
    panel = join_any_wire("panel").publisher(FIRE_ALARM_TRIGGER)
    node, heard = join_any_wire("node"), list[d.Bool]()
    ears = node.subscribe(FIRE_ALARM_TRIGGER, heard.append)
    panel.publish(d.Bool(False))
    wait_until(lambda: heard == [d.Bool(False)], "the end of an old alarm is heard")
    own, repeated = FIRE_ALARM_TRIGGER.named("own_alarm"), list[d.Bool]()
    node.subscribe(own, repeated.append)
    node.publisher(own).publish(d.Bool(True))
    wait_until(lambda: len(repeated) == 1, "the node hears its own alarm")
    join_again(node)
    wait_until(lambda: len(repeated) == 2, "the node has joined again and repeats its alarm")
    wait_until(ears.matched, "the node has found the panel again")
    panel.publish(d.Bool(True))
    wait_until(lambda: d.Bool(True) in heard, "the new alarm is heard")
    late = list[d.Bool]()
    node.subscribe(FIRE_ALARM_TRIGGER, late.append)
    wait_until(lambda: len(late) == 2, "the retained messages have come again")
    assert heard == late == [d.Bool(False), d.Bool(True)]

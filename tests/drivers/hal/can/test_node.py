"""A CANopen node: valid answers, and the frames by which the bus knows that the node is alive."""

import struct
from collections.abc import Callable

import can
import pytest

from drivers.hal.can import CanBus, FrameFilter
from drivers.hal.can.canopen import CanOpenNode
from tests.drivers.hal.can.far_end import Reactive, data_frame, failure

NODE = 10
STATE = (0x2002, 0x0A, 2)
ENABLE = (0x2000, 1, 1)
Answer = Callable[[bytes], list[str]]


def value(request: bytes, number: int, command: int = 0x4B) -> str:
    """Return the reply to a read of a number with two octets (expedited transfer)."""
    return (bytes((command,)) + request[1:4] + struct.pack("<I", number)).hex()


class Node:
    """A far end that answers the requests to node 10. Each answer is a list of payloads in hexadecimal
    digits."""

    def __init__(self, far: Reactive) -> None:
        self.answer: Answer = lambda request: [value(request, 5)]
        self.asked: list[str] = []
        far.react = self._react

    def _react(self, message: can.Message) -> list[can.Message]:
        request = bytes(message.data)
        self.asked.append(request.hex())
        return [data_frame(0x580 + NODE, payload) for payload in self.answer(request)]


Side = tuple[CanOpenNode, Node, Reactive, CanBus]


@pytest.fixture
def side() -> Side:
    far = Reactive()
    bus = far.bus()
    bus.take()
    return CanOpenNode(bus, NODE, 0.5), Node(far), far, bus


NAME = "CANopen node 10 at can0"


def test_numbers_are_read_and_written_as_in_the_makers_frames(side: Side) -> None:
    ours, node, *_ = side
    assert ours.read(*STATE) == 5
    node.answer = lambda request: ["60" + request[1:4].hex() + "00000000"]
    ours.write(*ENABLE, 1)
    assert node.asked == ["4002200a00000000", "2f00200101000000"]


@pytest.mark.parametrize("command", [0x4B, 0x43, 0x42])
def test_a_number_may_come_in_four_octets_whose_rest_is_zero(side: Side, command: int) -> None:
    ours, node, *_ = side
    node.answer = lambda request: [value(request, 238, command)]
    assert ours.read(*STATE) == 238


def test_a_number_that_is_too_short_or_too_great_is_refused(side: Side) -> None:
    ours, node, *_ = side
    node.answer = lambda request: [value(request, 5, 0x4F)]
    assert failure(lambda: ours.read(*STATE)) == (
        f"{NAME}, read 0x2002:0A: 1 bytes (05) for a number of 2"
    )
    node.answer = lambda request: [value(request, 0x10005, 0x43)]
    assert failure(lambda: ours.read(*STATE)) == (
        f"{NAME}, read 0x2002:0A: 4 bytes (05 00 01 00) for a number of 2"
    )


def test_a_refusal_is_named_and_causes_no_pause(side: Side) -> None:
    ours, node, *_ = side
    node.answer = lambda request: ["80" + request[1:4].hex() + "00000206"]
    for _ in range(2):
        assert failure(lambda: ours.read(*STATE)) == (
            f"{NAME}, read 0x2002:0A: refused: Code 0x06020000, Object does not exist"
        )
    assert len(node.asked) == 2


def test_without_an_answer_there_is_no_number_and_the_node_pauses(side: Side) -> None:
    ours, node, far, _ = side
    node.answer = lambda request: []
    text = f"{NAME}, read 0x2002:0A: no reply within 0.05 s"
    assert [failure(lambda: ours.read(*STATE)) for _ in range(3)] == [text] * 3
    assert len(node.asked) == 1
    node.answer = lambda request: [value(request, 7)]
    far.now += 0.6
    assert ours.read(*STATE) == 7


@pytest.mark.parametrize(
    ("odd", "text"),
    [
        (lambda r: "4b0220050500", "a reply of 6 bytes"),
        (lambda r: "", "a reply of 0 bytes"),
        (lambda r: "4b02200505000000", "a reply about 0x2002:05"),
        (lambda r: "8000200100000206", "a reply about 0x2000:01"),
    ],
)
def test_a_reply_of_another_length_or_about_another_object_is_named_and_never_taken(
    side: Side, odd: Callable[[bytes], str], text: str
) -> None:
    ours, node, far, _ = side
    node.answer = lambda request: [odd(request)]
    assert failure(lambda: ours.read(*STATE)) == (
        f"{NAME}, read 0x2002:0A: no reply within 0.05 s, but {text}"
    )
    far.now += 1
    node.answer = lambda request: [odd(request), value(request, 9), odd(request)]
    assert ours.read(*STATE) == 9


def test_an_answer_of_another_type_is_refused(side: Side) -> None:
    ours, node, *_ = side
    node.answer = lambda request: ["60" + request[1:4].hex() + "05000000"]
    assert failure(lambda: ours.read(*STATE)) == (
        f"{NAME}, read 0x2002:0A: no SDO reply to the request (Unexpected response 0x60)"
    )


def test_a_write_is_done_only_when_the_node_says_so(side: Side) -> None:
    ours, node, *_ = side
    node.answer = lambda request: [value(request, 1)]
    assert failure(lambda: ours.write(*ENABLE, 1)) == (
        f"{NAME}, write 0x2000:01: no SDO reply to the request (Unexpected response 0x4B)"
    )


def test_a_late_answer_is_never_the_answer_to_the_next_question(side: Side) -> None:
    ours, node, far, _ = side
    node.answer = lambda request: []
    assert failure(lambda: ours.read(*STATE))
    far.now += 0.6
    far.say(0x580 + NODE, "4b02200a05000000")  # a late answer to an earlier request, with state 5
    node.answer = lambda request: [value(request, 238)]
    assert ours.read(*STATE) == 238


def test_a_node_that_owes_an_answer_is_asked_nothing(side: Side) -> None:
    ours, node, far, _ = side
    node.answer = lambda request: []
    assert failure(lambda: ours.read(*STATE))
    ours._sdo_pause.mended()  # end the pause, because the bus would send no request during the pause
    assert failure(lambda: ours.read(*STATE)) == (f"{NAME}, read 0x2002:0A: no reply within 0.05 s")
    assert len(node.asked) == 1
    far.now += 0.2
    node.answer = lambda request: [value(request, 1)]
    assert ours.read(*STATE) == 1


def test_a_switch_off_at_the_daemons_end_is_sent_in_spite_of_the_pause(side: Side) -> None:
    ours, node, _, bus = side
    node.answer = lambda request: []
    assert failure(lambda: ours.write(*ENABLE, 1))
    node.answer = lambda request: ["60" + request[1:4].hex() + "00000000"]
    assert failure(lambda: ours.write(*ENABLE, 0))
    bus.insist()
    ours.write(*ENABLE, 0)
    assert node.asked == ["2f00200101000000", "2f00200100000000"]


# ---- heartbeat


def test_a_node_whose_heartbeat_comes_in_time_is_alive(side: Side) -> None:
    ours, _, far, _ = side
    far.say(0x70A, "05")
    ours.alive()
    far.now += 0.55
    far.later = [data_frame(0x70A, "05")]
    ours.alive()
    assert ours.starts == 0


def test_a_heartbeat_that_stays_away_is_a_loss_and_its_return_ends_it(side: Side) -> None:
    ours, _, far, _ = side
    far.say(0x70A, "05")
    ours.alive()
    far.now += 0.55
    assert failure(ours.alive) == (
        f"{NAME}: no heartbeat within 0.5 s: no other frames come on the bus either: check power,"
        " cable, termination and bitrate"
    )
    far.say(0x70A, "05")
    assert failure(ours.alive) == ""


def test_a_node_that_was_lost_counts_as_restarted(side: Side) -> None:
    """While a node is lost, the node may restart. The bus may then miss the boot-up frame.

    So a node that returns must get all orders again.
    """
    ours, _, far, _ = side
    far.say(0x70A, "05")
    ours.alive()
    assert ours.starts == 0
    far.now += 0.55
    assert failure(ours.alive)
    far.say(0x70A, "05")
    ours.alive()
    assert ours.starts == 1


def test_another_nodes_heartbeat_does_not_count_and_is_named(side: Side) -> None:
    ours, _, far, _ = side
    far.say(0x70B, "05")
    far.say(0x70A, "05", extended=True)
    assert failure(ours.alive) == (
        f"{NAME}: no heartbeat within 0.5 s, but heartbeats of node 11: is 'node' right?"
    )


@pytest.mark.parametrize("payload", ["", "0500", "0505050505050505"])
def test_a_heartbeat_of_the_wrong_length_is_ignored(side: Side, payload: str) -> None:
    ours, _, far, _ = side
    far.say(0x70A, payload)
    assert failure(ours.alive) == (
        f"{NAME}: no heartbeat within 0.5 s, but one of {len(payload) // 2} bytes:"
        " is it a CANopen node?"
    )


@pytest.mark.parametrize(
    ("state", "text"),
    [("00", "starting"), ("04", "stopped"), ("7f", "pre-operational"), ("03", "in state 3")],
)
def test_a_node_that_is_not_operational_is_not_asked(side: Side, state: str, text: str) -> None:
    ours, _, far, _ = side
    far.say(0x70A, state)
    assert failure(ours.alive) == f"{NAME} is {text}, not operational: check the node"


def test_a_start_is_counted_and_ends_the_pause(side: Side) -> None:
    ours, node, far, _ = side
    node.answer = lambda request: []
    assert failure(lambda: ours.read(*STATE))
    far.say(0x70A, "00")
    far.say(0x70A, "05")
    ours.alive()
    assert ours.starts == 1


def test_a_node_without_a_heartbeat_is_alive_as_long_as_it_answers() -> None:
    far = Reactive()
    bus = far.bus()
    bus.take()
    ours = CanOpenNode(bus, NODE, None)
    ours.alive()
    heard: list[object] = []
    bus.listen([FrameFilter(1)], lambda frame, at: heard.append(frame))
    far.say(1)
    ours.alive()
    assert len(heard) == 1

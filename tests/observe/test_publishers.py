"""Two publishers of one device's states, and cases that look like two publishers but are not."""

from bridges.messages.heard import Heard, Sender
from bridges.observe.all_devices import PlainGraph
from bridges.observe.limits import MOST_SENDERS, SLOWEST_S
from bridges.observe.requesters import Moment
from tests.observe.story import LIFT, WALL

A, B, C = (Sender(f"/{name}") for name in "abc")


def publishers(
    *told: Sender | None, step_s: float = 0.5, after_s: float = 0.0
) -> tuple[Sender, ...]:
    """Let these senders publish the same state, one after the other. Return the publishers that the
    observer counts `after_s` seconds later."""
    graph, at = PlainGraph(), 0.0
    for at, sender in enumerate(told):
        graph.hear(Heard(at * step_s, WALL, "lift_states", LIFT, sender))
    now = at * step_s + after_s
    return graph.known["lift", "Lift1"].publishers(Moment(now, WALL))


def test_two_publishers_in_turn_are_two_even_with_equal_messages() -> None:
    assert publishers(A, B, A) == (B, A)
    assert publishers(*[A, B] * 40) == (A, B)
    assert publishers(*[A, A, A, A, B] * 8) == (A, B)
    assert publishers(*[A, B, C] * 8) == (A, B, C)


def test_a_restarted_node_or_a_rejoined_listener_is_no_second_publisher() -> None:
    assert publishers(A, A, A) == (A,)
    assert publishers(A, A, B) == (B,)
    assert publishers(A, B, C) == (C,)
    assert publishers(A, B, A, step_s=SLOWEST_S) == (A,)  # B has gone before A comes back


def test_two_publishers_become_one_after_the_other_has_gone() -> None:
    assert publishers(A, B, A, B, *[A] * 11) == (A,)
    assert publishers(A, B, A, after_s=SLOWEST_S + 1) == ()


def test_unknown_publishers_do_not_count() -> None:
    assert publishers(None, None) == ()


def test_invented_publishers_are_bounded_and_do_not_hide_a_second_publisher() -> None:
    made_up = [Sender() for _ in range(100)]
    shown = publishers(A, *made_up, A, *made_up, step_s=0.01)
    assert A in shown
    assert len(shown) == MOST_SENDERS

"""Floods of liveliness tokens, panics of the library, and events that must not disturb a session."""

import json
import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

import pytest
import zenoh

from bridges.messages import definitions as d
from bridges.messages.topics import FIRE_ALARM_TRIGGER, LIFT_REQUESTS, LIFT_STATES
from bridges.transports.transport import TransportError
from bridges.transports.zenoh import peers as zenoh_peers
from bridges.transports.zenoh.keys import Peer, RmwZenoh
from bridges.transports.zenoh.peers import Merged, Tokens
from bridges.transports.zenoh.transport import ZenohTransport
from tests.transports import peer
from tests.transports.zenoh_programs import meeting
from tests.waiting import wait_until


class Stranger:
    """A session of another program. The session declares tokens for publishers and subscriptions that
    do not exist."""

    def __init__(self, domain: int) -> None:
        config = zenoh.Config()
        config.insert_json5("mode", json.dumps("peer"))
        config.insert_json5("connect/endpoints", json.dumps([meeting(domain)]))
        config.insert_json5("listen/endpoints", json.dumps([]))
        config.insert_json5("scouting/multicast/enabled", "false")
        self.session = zenoh.open(config)
        self._domain = domain
        self._tokens: list[zenoh.LivelinessToken] = []

    def claims(
        self, kind: str, topic: str, type_text: str, numbers: range, qos: str = "::"
    ) -> None:
        """Declare one token for each number. Each token claims a publisher or subscription of the
        topic."""
        for number in numbers:
            ids = f"@ros2_lv/{self._domain}/{self.session.zid()}/0/{number}/{kind}"
            token = f"{ids}/%/%/stranger/%{topic}/{type_text}/{qos},10:,:,:,,"
            self._tokens.append(self.session.liveliness().declare_token(token))

    def drops(self, most: int) -> None:
        """Withdraw the first `most` tokens."""
        gone, self._tokens = self._tokens[:most], self._tokens[most:]
        for token in gone:
            token.undeclare()  # type: ignore[no-untyped-call]


@contextmanager
def stranger(domain: int) -> Iterator[Stranger]:
    made = Stranger(domain)
    yield made
    made.session.close()  # type: ignore[no-untyped-call]


@pytest.fixture
def node(domain: int) -> Iterator[ZenohTransport]:
    with closing(ZenohTransport("lift", domain, loopback=True)) as made:
        yield made


def type_text(node: ZenohTransport) -> str:
    return node._keys.type(LIFT_REQUESTS)


def test_an_order_that_is_given_often_waits_once_and_may_be_given_again_while_it_runs() -> None:
    waiting: list[Callable[[], None]] = []
    ran: list[int] = []
    order = Merged(waiting.append, lambda: ran.append(len(waiting)))
    for _ in range(5000):
        order()
    assert len(waiting) == 1
    waiting.pop()()
    order()
    waiting.pop()()
    assert ran == [0, 0]


def test_a_flood_of_tokens_is_walked_seldom_and_what_comes_in_it_is_heard(
    node: ZenohTransport, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    walks: list[int] = []
    settle = node._peers.settle

    def walk() -> bool:
        walks.append(1)
        return settle()

    monkeypatch.setattr(node._peers, "settle", walk)
    hears = node.subscribe(LIFT_REQUESTS, lambda request: None)
    held, goes_on = threading.Event(), threading.Event()

    def hold() -> None:
        held.set()
        goes_on.wait()

    with stranger(domain) as flood:
        node._orders.put(hold)
        wait_until(held.is_set, "our thread is busy")
        flood.claims("MP", "lift_requests", type_text(node), range(300))
        wait_until(lambda: hears.matched() == 300, "all publishers are counted")
        before = len(walks)
        goes_on.set()
        wait_until(lambda: len(walks) > before, "the tokens are walked")
        wait_until(node._orders.empty, "no order waits")
        assert len(walks) <= before + 2


def test_beyond_the_bound_ends_are_left_out_once_said_and_counted_when_there_is_room(
    node: ZenohTransport,
    domain: int,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(zenoh_peers, "MOST", 20)
    hears = node.subscribe(LIFT_REQUESTS, lambda request: None)

    def crowded() -> list[str]:
        return [text for text in caplog.messages if text.startswith("crowded")]

    with stranger(domain) as flood:
        for again in range(2):
            flood.claims(
                "MP", "lift_requests", type_text(node), range(100 * again, 100 * again + 25)
            )
            wait_until(
                lambda: hears.matched() == 20 and crowded(),
                "the permitted number is counted, and the log names the crowd",
            )
            flood.drops(20)
            wait_until(
                lambda: hears.matched() == 5,
                "the remaining publishers are counted, the late ones too",
            )
            flood.drops(5)
            wait_until(lambda: hears.matched() == 0, "no publisher is left")
    assert len(crowded()) == 1
    assert "most=20" in crowded()[0]


def test_a_token_longer_than_any_of_ros_is_nobodys(node: ZenohTransport, domain: int) -> None:
    hears = node.subscribe(LIFT_REQUESTS, lambda request: None)
    with stranger(domain) as far:
        far.claims("MP", "lift_requests", type_text(node), range(1), qos="x" * 2000 + "::")
        far.claims("MP", "lift_requests", type_text(node), range(1, 2))
        wait_until(lambda: hears.matched() == 1, "the publisher with the short token is counted")


def test_many_ends_that_do_not_fit_are_one_line(
    node: ZenohTransport, domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    node.subscribe(FIRE_ALARM_TRIGGER, lambda alarm: None)
    kind = node._keys.type(FIRE_ALARM_TRIGGER)
    with stranger(domain) as far:
        far.claims("MP", "fire_alarm_trigger", kind, range(50))
        place = node._ends[0].place
        assert place
        wait_until(lambda: len(place.unheard) == 50, "all publishers that do not fit are seen")
        wait_until(
            lambda: any("misfit" in text for text in caplog.messages), "the log names the misfit"
        )
    assert len([text for text in caplog.messages if "misfit" in text]) == 1


# --- panics --------------------------------------------------------------------------------------


class PanicException(BaseException):
    """A stand-in for the exception that pyo3 raises when Rust code panics."""


class Panics:
    """A stand-in for a publisher whose library panics at each call."""

    def put(self, *sample: object, **more: object) -> None:
        raise PanicException("called `Result::unwrap()` on an `Err` value")

    undeclare = put


def test_a_panic_of_the_library_is_a_message_that_was_not_sent(node: ZenohTransport) -> None:
    publisher = node.publisher(LIFT_STATES)
    held, publisher._end = publisher._end, Panics()  # type: ignore[assignment]
    with pytest.raises(TransportError, match="zenoh has panicked: called `Result::unwrap"):
        publisher.publish(d.LiftState())
    publisher._end = held
    publisher.publish(d.LiftState())


def test_a_panic_on_our_thread_is_logged_and_the_thread_lives(
    node: ZenohTransport, caplog: pytest.LogCaptureFixture
) -> None:
    done: list[int] = []
    for order in (Panics().put, lambda: done.append(1)):
        node._orders.put(order)
    wait_until(lambda: done, "the next order is obeyed")
    assert node.lives
    assert "reader_failed" in caplog.text


def test_what_is_no_panic_still_ends_what_it_ended(node: ZenohTransport) -> None:
    publisher = node.publisher(LIFT_STATES)

    class Ends(Panics):
        def put(self, *sample: object, **more: object) -> None:
            raise KeyboardInterrupt

    held, publisher._end = publisher._end, Ends()  # type: ignore[assignment]
    with pytest.raises(KeyboardInterrupt):
        publisher.publish(d.LiftState())
    publisher._end = held


def test_samples_bear_no_time_of_zenohs_clock_which_panics_before_1970(
    node: ZenohTransport, domain: int
) -> None:
    stamps: list[object] = []
    with stranger(domain) as far:
        key = node._keys.data(LIFT_STATES)
        far.session.declare_subscriber(key, lambda sample: stamps.append(sample.timestamp))
        publisher = node.publisher(LIFT_STATES)
        wait_until(lambda: stamps or peer.sent(publisher, d.LiftState()), "the sample arrives")
    assert set(stamps) == {None}


class BusyThread(RmwZenoh):
    """A reader of tokens that blocks zenoh's thread at the first token. The test sets `go_on` to let
    the thread continue."""

    def __init__(self, domain: int) -> None:
        super().__init__(domain, "", "lift")
        self.go_on = threading.Event()
        self.held = threading.Event()

    def peer(self, token: str) -> Peer | None:
        self.held.set()
        self.go_on.wait()
        return super().peer(token)


def test_a_token_is_counted_if_the_graph_has_it_although_its_departure_came_first(
    node: ZenohTransport, domain: int
) -> None:
    hears = node.subscribe(LIFT_REQUESTS, lambda request: None)
    keys, counted, gone = BusyThread(domain), set[str](), list[str]()
    assert node._session is not None
    with stranger(domain) as leaver:
        leaver.claims("MP", "lift_requests", type_text(node), range(5))
        wait_until(lambda: hears.matched() == 5, "the session knows the tokens")

        def part(token: str) -> None:
            counted.discard(token)
            gone.append(token)

        tokens = Tokens(
            node._session,
            keys,
            [keys.others("MP", LIFT_REQUESTS)],
            lambda token, peer: counted.add(token),
            part,
            node._orders.put,
        )
        wait_until(keys.held.is_set, "the first token has come")
        leaver.drops(5)
        wait_until(lambda: len(gone) == 5, "all tokens have gone before they came")
        leaver.claims("MP", "lift_requests", type_text(node), range(4, 6))
        keys.go_on.set()
        wait_until(lambda: len(counted) == 2, "the two tokens that the graph has are counted")
        wait_until(lambda: not tokens._doubtful, "the graph was asked for each doubtful token")
        assert {token.split("/")[4] for token in counted} == {"4", "5"}
        assert {token.split("/")[4] for token in gone} == {"0", "1", "2", "3", "4"}
        tokens.leave()

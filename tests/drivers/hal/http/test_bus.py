"""The `http` bus with real servers, which fail in every possible way."""

import contextlib
import itertools
import re
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drivers.hal import HalError
from drivers.hal.http import BUS, HttpBus, HttpSettings
from tests.depth import examples
from tests.drivers.hal.http.far_end import (
    Caller,
    Conversation,
    FarEnd,
    always,
    answer,
    once,
)

TIMEOUT_S = 0.3
"""The timeout (s) for a call that the test expects to fail."""


class Clock:
    """A clock that lets every pause of the bus end before the next call."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        self.now += 1000.0  # the longest pause ends within this time
        return self.now


def bus_to(port: int, timeout_s: float = 5.0, **more: Any) -> HttpBus:
    made = HttpSettings(api_base=f"127.0.0.1:{port}", timeout_s=timeout_s)
    return HttpBus(made, **{"clock": Clock()} | more)


def failure(talk: Conversation, timeout_s: float = 5.0) -> str:
    """Return the error text of a GET to a server with this conversation."""
    with FarEnd(talk) as far:
        bus = bus_to(far.port, timeout_s)
        with pytest.raises(HalError) as caught:
            bus.get_json("/state")
        bus.close()
        return str(caught.value).replace(f":{far.port}", "")


CHUNKED = b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
CHUNK_SIZES = [b"-1", b"-5", b"-" + b"f" * 16, b"-" + b"f" * 5000, b"f" * 5000, b"zz", b""]
"""Invalid sizes of a chunk."""

# ---- good answers


def test_an_answer_that_is_a_json_object_is_read() -> None:
    with FarEnd(always(answer(b'{"state": 5, "error_msg": "\xc3\xbc"}'))) as far:
        bus = bus_to(far.port)
        assert bus.get_json("/state") == {"state": 5, "error_msg": "ü"}
        bus.close()
    [request] = far.requests
    lines = request.decode().split("\r\n")
    assert lines[0] == "GET /state HTTP/1.1"
    assert "Accept-Encoding: identity" in lines


@pytest.mark.parametrize("sort", ["json; charset=utf-8", "vnd.maker+json", "JSON"])
def test_json_is_known_by_its_content_type(sort: str) -> None:
    with FarEnd(always(answer(sort=sort))) as far:
        bus = bus_to(far.port)
        assert bus.get_json("/state") == {"state": 0}
        bus.close()


def test_each_call_has_a_connection_of_its_own() -> None:
    with FarEnd(always(answer())) as far:
        bus = bus_to(far.port)
        assert [bus.get_json("/state") for _ in range(5)] == [{"state": 0}] * 5
        assert far.connections == 5
        bus.close()
    assert all(b"Connection: close" in request for request in far.requests)


def test_a_body_in_chunks_is_read() -> None:
    with FarEnd(always(CHUNKED, b"4\r\n{}  \r\n", b"0\r\n\r\n")) as far:
        bus = bus_to(far.port)
        assert [bus.get_json("/state") for _ in range(2)] == [{}, {}]
        bus.close()


def test_proxies_and_passwords_of_the_environment_are_not_used(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "netrc").write_text("machine 127.0.0.1 login a password b\n")
    monkeypatch.setenv("NETRC", str(tmp_path / "netrc"))
    for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY"):
        monkeypatch.setenv(name, "http://127.0.0.1:1")
    with FarEnd(always(answer())) as far:
        bus = bus_to(far.port)
        assert bus.get_json("/state") == {"state": 0}
        bus.close()
    assert b"Authorization" not in far.requests[0]


def test_a_command_carries_its_method_and_its_body_as_json() -> None:
    bodies = []

    def talk(caller: Caller) -> None:
        while caller.request():
            bodies.append(caller._sock.recv(64))
            caller.send(answer(status="204 No Content", body=b""))

    with FarEnd(talk) as far:
        bus = bus_to(far.port)
        bus.send("/output", "PUT", '{"enabled": true}')
        bus.close()
    lines = far.requests[0].decode().split("\r\n")
    assert lines[0] == "PUT /output HTTP/1.1"
    assert {"Content-Type: application/json", "Content-Length: 17"} <= set(lines)
    assert bodies == [b'{"enabled": true}']


def test_cookies_are_not_kept() -> None:
    with FarEnd(always(answer(headers="Set-Cookie: a=b\r\n"))) as far:
        bus = bus_to(far.port)
        bus.get_json("/state")
        bus.get_json("/state")
        bus.close()
    assert b"Cookie" not in far.requests[1]


# ---- replies that belong to another request


def _answers_twice(caller: Caller) -> None:
    """Answer each request twice: with the right reply, and then with the reply to the request
    before."""
    last = answer(b'{"state": 0}')
    for n in itertools.count(1):
        if not caller.request():
            return
        caller.send(now := answer(b'{"state": %d}' % n), last)
        last = now


def _answers_the_last_one_late(caller: Caller) -> None:
    """Answer the first request. After the second request send the first answer again, then the right
    one."""
    if caller.request():
        caller.send(answer(b'{"state": 1}'))
    if caller.request():
        caller.send(answer(b'{"state": 1}'), answer(b'{"state": 2}'))


@pytest.mark.parametrize("talk", [_answers_twice, _answers_the_last_one_late])
def test_a_second_reply_is_never_taken_for_the_next_requests(talk: Conversation) -> None:
    with FarEnd(talk, always(answer(b'{"state": 7}'))) as far:
        bus = bus_to(far.port)
        assert [bus.get_json("/state") for _ in range(3)] == [{"state": 1}, *[{"state": 7}] * 2]
        bus.close()


def test_a_server_that_hangs_up_at_once_is_not_dialled_twice() -> None:
    with FarEnd(once()) as far:
        bus = bus_to(far.port)
        with pytest.raises(HalError, match="no complete HTTP answer"):
            bus.get_json("/state")
        bus.close()
    assert far.connections == 1


# ---- POST


@pytest.mark.parametrize("status", ["200 OK", "202 Accepted"])
def test_a_post_succeeds_with_any_2xx(status: str) -> None:
    with FarEnd(once(answer(status=status))) as far:
        bus = bus_to(far.port)
        bus.send("/clear_error")
        bus.close()
    assert [r.split(b"\r\n")[0] for r in far.requests] == [b"POST /clear_error HTTP/1.1"]


def test_a_post_whose_answer_is_lost_fails_and_is_never_sent_again() -> None:
    with FarEnd(always(answer()), once(), always(answer())) as far:
        bus = bus_to(far.port)
        bus.get_json("/state")
        with pytest.raises(HalError, match="no complete HTTP answer"):
            bus.send("/clear_error")
        assert bus.get_json("/state") == {"state": 0}
        bus.close()
    assert [r.split(b" ")[0] for r in far.requests] == [b"GET", b"POST", b"GET"]


@pytest.mark.parametrize("status", ["302 Found", "404 Not Found", "500 Internal Server Error"])
def test_a_post_with_another_status_fails(status: str) -> None:
    with FarEnd(once(answer(status=status))) as far:
        bus = bus_to(far.port)
        with pytest.raises(HalError, match=f"answered status {status[:3]}"):
            bus.send("/clear_error")
        bus.close()


# ---- bytes that are no HTTP answer


@pytest.mark.parametrize(
    ("reply", "text"),
    [
        (answer(status="500 X"), "status 500: the controller's own software fails"),
        (answer(status="404 X"), "status 404: check api_base and the path, and give token_file"),
        (answer(status="401 X"), "status 401: check api_base and the path, and give token_file"),
        (answer(status="204 X", body=b""), "status 204: 200 is expected"),
        (
            answer(status="302 X", headers="Location: http://127.0.0.1:1/\r\n"),
            "status 302: redirects are not followed",
        ),
        (answer(status="302 X", headers="Location: \xff://[\r\n"), "status 302"),
        (answer(b'{"state": 5}  ')[:-2], "no complete HTTP answer"),
        (answer(b"<html>", sort="xhtml"), "answered application/xhtml instead of JSON"),
        (b"HTTP/1.1 200 OK\r\n\r\n{}", "answered no content type instead of JSON"),
        (answer(b""), "answered invalid JSON"),
        (answer(b'{"state": 0'), "answered invalid JSON"),
        (answer(b'{"state": NaN}'), "NaN is not JSON"),
        (answer(b'{"state": 0, "state": 5}'), "a key occurs twice"),
        (answer(b'{"state": ' + b"9" * 5000 + b"}"), "answered invalid JSON"),
        (answer(b"[" * 60_000), "answered invalid JSON"),
        (answer(b'{"state": "\xff"}'), "answered invalid JSON"),
        (answer(b"[5]"), r"JSON that is not an object: \[5\]"),
        (answer(b"5"), "JSON that is not an object: 5"),
        (answer(b"\x1f\x8b\x08", headers="Content-Encoding: gzip\r\n"), "invalid JSON"),
        (answer(b" " * 65_537), "answered more than 64 KiB"),
        (b"SSH-2.0-OpenSSH_9.2\r\n", "no complete HTTP answer"),
        (b"\x00\xff" * 40, "no complete HTTP answer"),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 99\r\n\r\n{}", "no complete HTTP answer"),
        (b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 200 + b"\r\n", "no complete HTTP answer"),
        (b"HTTP/1.1 200 OK\r\nX: " + b"y" * 70_000 + b"\r\n\r\n", "no complete HTTP answer"),
        (b"", "no complete HTTP answer"),
        *((CHUNKED + size + b"\r\n{}", "no complete HTTP answer") for size in CHUNK_SIZES),
        (CHUNKED + b"2\r\n{}\r\n-2\r\n{}\r\n0\r\n\r\n", "no complete HTTP answer"),
        (answer(headers="Content-Length: -5\r\n"), "no complete HTTP answer"),
    ],
)
def test_an_answer_that_is_not_a_json_object_is_an_error_that_says_what_to_look_at(
    reply: bytes, text: str
) -> None:
    assert re.search(text, failure(once(reply)))


@settings(max_examples=examples(150))
@given(
    st.binary(max_size=200),
    st.sampled_from([b"", b"HTTP/1.1 200 OK\r\n", answer(b"")[:-4], CHUNKED]),
)
@example(b"-5\r\n{}", CHUNKED)
def test_no_bytes_of_a_server_raise_anything_but_a_hal_error(noise: bytes, start: bytes) -> None:
    with FarEnd(once(start + noise)) as far:
        bus = bus_to(far.port)
        try:
            assert isinstance(bus.get_json("/state"), dict)
        except HalError:
            pass
        finally:
            bus.close()


# ---- servers that never finish (without a time limit of the call, each test here would hang)


def _says_nothing(caller: Caller) -> None:
    caller.request()
    caller.hold()


def _status_line_without_end(caller: Caller) -> None:
    caller.request()
    caller.send(b"HTTP/1.1 200 ")
    caller.for_ever(b"O")


def _headers_without_end(caller: Caller) -> None:
    caller.request()
    caller.send(b"HTTP/1.1 200 OK\r\nX: ")
    caller.for_ever(b"y")


def _continues_without_end(caller: Caller) -> None:
    caller.request()
    caller.for_ever(b"HTTP/1.1 100 Continue\r\n\r\n", every_s=0.0)


def _body_of_a_length_that_trickles(caller: Caller) -> None:
    caller.request()
    caller.send(
        b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: 60000\r\n\r\n"
    )
    caller.for_ever(b" ")


def _body_without_length_that_trickles(caller: Caller) -> None:
    caller.request()
    caller.send(b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n\r\n")
    caller.for_ever(b" ")


def _chunks_that_trickle(caller: Caller) -> None:
    caller.request()
    caller.send(
        b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    )
    caller.for_ever(b"1\r\n \r\n")


def _trailers_without_end(caller: Caller) -> None:
    caller.request()
    caller.send(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n")
    caller.for_ever(b"X: y\r\n")


@pytest.mark.parametrize(
    "talk",
    [
        _says_nothing,
        _status_line_without_end,
        _headers_without_end,
        _continues_without_end,
        _body_of_a_length_that_trickles,
        _body_without_length_that_trickles,
        _chunks_that_trickle,
        _trailers_without_end,
    ],
)
def test_a_server_that_never_ends_its_answer_is_left_at_the_deadline(talk: Conversation) -> None:
    text = failure(talk, TIMEOUT_S)
    assert text == (
        "http://127.0.0.1/state: no complete answer within 0.3 s: check power, cable and address"
    )


@pytest.mark.parametrize("talk", [_says_nothing, _headers_without_end])
def test_a_post_ends_at_the_deadline(talk: Conversation) -> None:
    with FarEnd(talk) as far:
        bus = bus_to(far.port, TIMEOUT_S)
        with pytest.raises(HalError, match=r"no complete answer within 0[.]3 s"):
            bus.send("/clear_error")
        bus.close()


def test_an_endless_body_is_cut_at_its_cap() -> None:
    def pours(caller: Caller) -> None:
        caller.request()
        caller.send(b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n\r\n")
        caller.for_ever(b" " * 65536, every_s=0.0)

    assert "answered more than 64 KiB" in failure(pours)


def test_after_each_of_these_failures_the_next_call_works() -> None:
    hostile = [_says_nothing, _headers_without_end, _body_without_length_that_trickles, once(b"?")]
    with FarEnd(*hostile, always(answer())) as far:
        bus = bus_to(far.port, TIMEOUT_S)
        for _ in hostile:
            with pytest.raises(HalError):
                bus.get_json("/state")
        assert bus.get_json("/state") == {"state": 0}
        bus.close()


# ---- connecting


def test_a_refused_connection_says_so() -> None:
    with socket.create_server(("127.0.0.1", 0)) as gone:
        port = gone.getsockname()[1]
    bus = bus_to(port)
    with pytest.raises(HalError) as caught:
        bus.get_json("/state")
    assert str(caught.value) == (
        f"127.0.0.1:{port} refuses the connection: is the controller's HTTP server running there?"
    )


@contextlib.contextmanager
def full_server() -> Iterator[Any]:
    """Yield the address of a server whose queue is full. The server neither accepts nor refuses more
    connections."""
    with contextlib.ExitStack() as opened:
        full = opened.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
        for _ in range(4):
            waiting = opened.enter_context(socket.socket())
            waiting.setblocking(False)
            waiting.connect_ex(full.getsockname())
        yield full.getsockname()


def test_a_connection_that_is_never_made_is_left_at_the_deadline() -> None:
    with full_server() as address:
        bus = bus_to(address[1], TIMEOUT_S)
        with pytest.raises(HalError, match=r"no complete answer within 0[.]3 s"):
            bus.get_json("/state")


def named(resolve: Any, timeout_s: float = 5.0) -> HttpBus:
    return HttpBus(HttpSettings(api_base="tpu.local", timeout_s=timeout_s), Clock(), resolve)


def tcp(*address: object) -> tuple[Any, ...]:
    return (socket.AF_INET, socket.SOCK_STREAM, 0, "", address)


def test_an_unknown_name_says_so() -> None:
    def unknown(*_: Any, **__: Any) -> Any:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    with pytest.raises(HalError) as caught:
        named(unknown).get_json("/state")
    assert str(caught.value) == "tpu.local is not known: check the name and the DNS server"


def test_a_name_without_an_address_is_an_error() -> None:
    with pytest.raises(HalError, match="cannot be reached: the name has no address"):
        named(lambda *_, **__: []).get_json("/state")


def test_an_address_that_cannot_be_reached_says_why() -> None:
    nowhere = (socket.AF_UNIX, socket.SOCK_STREAM, 0, "", "/nonexistent/socket")
    with pytest.raises(HalError, match=r"tpu[.]local:80 cannot be reached: No such file"):
        named(lambda *_, **__: [nowhere]).get_json("/state")


def test_the_second_address_is_tried_when_the_first_is_dead() -> None:
    with socket.create_server(("127.0.0.1", 0)) as gone:
        dead = gone.getsockname()
    with FarEnd(once(b"?"), always(answer())) as far:
        bus = named(lambda *_, **__: [tcp(*dead), tcp("127.0.0.1", far.port)])
        with pytest.raises(HalError, match="no complete HTTP answer"):
            bus.get_json("/state")
        assert bus.get_json("/state") == {"state": 0}
        bus.close()


def test_a_lookup_that_has_answered_does_not_keep_the_next_call_waiting() -> None:
    ended = threading.Event()

    class Lingering(list[Any]):
        """The results of a lookup. The lookup's thread lives until the test ends."""

    def resolve(*_: Any, **__: Any) -> Any:
        return []

    bus = named(resolve)
    dialler = bus._dialler
    look_up = dialler._look_up
    dialler._look_up = lambda answer: (look_up(answer), ended.wait())  # type: ignore[method-assign,assignment]
    for _ in range(2):
        with pytest.raises(HalError, match="the name has no address"):
            bus.get_json("/state")
    ended.set()


def test_an_address_that_is_silent_leaves_time_for_the_next() -> None:
    with full_server() as silent, FarEnd(always(answer())) as far:
        bus = named(lambda *_, **__: [tcp(*silent), tcp("127.0.0.1", far.port)], 2.0)
        assert bus.get_json("/state") == {"state": 0}
        bus.close()


def test_a_failure_to_connect_is_not_remembered_as_the_next_calls_reason() -> None:
    with FarEnd(once(b"?")) as far:
        addresses = iter([[], [tcp("127.0.0.1", far.port)]])
        bus = named(lambda *_, **__: next(addresses))
        with pytest.raises(HalError, match="the name has no address"):
            bus.get_json("/state")
        with pytest.raises(HalError, match="no complete HTTP answer"):
            bus.get_json("/state")
        bus.close()


@pytest.fixture
def dns() -> Iterator[threading.Event]:
    """Yield an event. The name server answers only after the test has set the event."""
    event = threading.Event()
    yield event
    event.set()


def test_a_name_server_that_does_not_answer_is_left_at_the_deadline(dns: threading.Event) -> None:
    asked = []
    with FarEnd(always(answer())) as far:

        def slow(*_: Any, **__: Any) -> Any:
            asked.append(threading.current_thread())
            dns.wait()
            return [tcp("127.0.0.1", far.port)]

        bus = named(slow, TIMEOUT_S)
        for _ in range(2):
            with pytest.raises(HalError, match=r"no complete answer within 0[.]3 s"):
                bus.get_json("/state")
        assert len(asked) == 1
        dns.set()
        asked[0].join()
        assert bus.get_json("/state") == {"state": 0}
        bus.close()


# ---- backoff


def test_after_a_failure_calls_fail_at_once_until_it_is_time_again() -> None:
    now = [0.0]
    with FarEnd(once(b"?")) as far:
        bus = bus_to(far.port, clock=lambda: now[0])
        tried_at = []
        while now[0] < 100.0:
            before = far.connections
            with pytest.raises(HalError, match="no complete HTTP answer"):
                bus.get_json("/state")
            if far.connections != before:
                tried_at.append(now[0])
            now[0] += 0.5
        assert tried_at == [0.0, 0.5, 1.5, 3.5, 7.5, 15.5, 31.5, 61.5, 91.5]
        far.conversations = [always(answer())]
        now[0] += 30.0
        assert bus.get_json("/state") == {"state": 0}
        far.conversations = [once(b"?")]
        bus.close()
        with pytest.raises(HalError):
            bus.get_json("/state")
        now[0] += 0.5
        far.conversations = [always(answer())]
        assert bus.get_json("/state") == {"state": 0}
        bus.close()


def test_a_wrong_answer_delays_only_its_own_path() -> None:
    now = [0.0]
    wrong = answer(b'{"x": NaN}')
    with FarEnd(always(wrong)) as far:
        bus = bus_to(far.port, clock=lambda: now[0])
        for _ in range(2):
            with pytest.raises(HalError, match="NaN is not JSON"):
                bus.get_json("/robots/1")
        assert far.connections == 1, "the second call fails at once"
        far.conversations = [always(answer())]
        assert bus.get_json("/robots/2") == {"state": 0}
        with pytest.raises(HalError, match="/robots/1 answered invalid JSON: NaN"):
            bus.get_json("/robots/1")
        now[0] += 0.5
        assert bus.get_json("/robots/1") == {"state": 0}
        bus.close()


def test_a_refused_command_delays_no_reading_and_few_paths_are_remembered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("drivers.hal.http.REMEMBERED_MAX", 2)
    with FarEnd(always(answer(status="500 No"))) as far:
        bus = bus_to(far.port, clock=lambda: 0.0)
        for number in (1, 2, 3, 3, 2):
            with pytest.raises(HalError, match="answered status 500"):
                bus.send(f"/go?id={number}")
        assert far.connections == 3
        with pytest.raises(HalError, match="answered status 500"):
            bus.send("/go?id=1")
        assert far.connections == 4
        far.conversations = [always(answer())]
        assert bus.get_json("/state") == {"state": 0}
        bus.close()


def test_an_off_whose_answer_is_lost_delays_no_other_off_while_readings_succeed() -> None:
    now = [0.0]
    with FarEnd(once(answer()), once(b"?"), always(answer())) as far:
        bus = bus_to(far.port, clock=lambda: now[0])
        assert bus.get_json("/state") == {"state": 0}
        with pytest.raises(HalError, match="no complete HTTP answer"):
            bus.send("/stop", body='{"robot": 1}', safe=True)
        bus.send("/stop", body='{"robot": 2}', safe=True)
        with pytest.raises(HalError, match="no complete HTTP answer"):
            bus.send("/stop", body='{"robot": 1}', safe=True)
        assert far.connections == 3
        now[0] += 0.5
        bus.send("/stop", body='{"robot": 1}', safe=True)
        bus.close()


def test_while_readings_fail_a_lost_off_delays_every_other_off() -> None:
    """The controller may be gone, and each attempt lasts as long as the timeout."""
    with FarEnd(once(b"?")) as far:
        bus = bus_to(far.port, clock=lambda: 0.0)
        with pytest.raises(HalError):
            bus.get_json("/state")
        for number in (1, 2, 3):
            with pytest.raises(HalError, match="no complete HTTP answer"):
                bus.send(f"/stop/{number}", safe=True)
        assert far.connections == 2
        bus.close()


def test_a_call_that_insists_is_not_held_back_by_the_pause_after_a_failure() -> None:
    with FarEnd(once(b"?"), always(answer())) as far:
        bus = bus_to(far.port, clock=lambda: 0.0)
        for _ in range(2):
            with pytest.raises(HalError, match="no complete HTTP answer"):
                bus.send("/stop")
        assert far.connections == 1
        bus.insist()
        bus.send("/stop")
        assert far.connections == 2
        bus.close()


def test_a_bus_is_opened_without_sending_anything_and_may_be_closed_twice() -> None:
    with FarEnd(always(answer())) as far:
        bus = BUS.open_bus(HttpSettings(api_base=f"127.0.0.1:{far.port}"))
        bus.on_edge(lambda: None)
        bus.close()
        bus.close()
        assert far.connections == 0

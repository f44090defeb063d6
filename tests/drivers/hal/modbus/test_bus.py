"""The Modbus bus on TCP: refused, broken and half-open connections, and frames of other requests."""

import socket

import pytest

from drivers.hal.modbus.tcp import Connection
from drivers.hal.points import HalError
from tests.drivers.hal.modbus.module import (
    Module,
    Time,
    bits_reply,
    bus_to,
    door,
    fails,
    frame,
    proven,
)
from tests.waiting import wait_until

IN0 = "unit 1 discrete input 0"


def test_unit_0_is_asked_as_any_other_and_no_other_unit_answers_for_it(module: Module) -> None:
    door(module, unit=0)
    bus = bus_to(module.port, timeout_s=0.3, retries=0)
    opened = "unit 0 discrete input 0"
    assert bus.lines({opened: None}, {}).read() == {opened: False}
    module.reply = lambda request: bits_reply(request, b"\1").replace(b"\0\2\1", b"\1\2\1")
    assert fails(bus, opened).endswith("no reply within 0.3 s, tried 1x")


def test_a_reply_numbered_0_says_what_the_gateway_must_do(module: Module) -> None:
    door(module)
    module.reply = lambda request: bytes(2) + module.answer(request)[2:]
    assert "the reply's transaction number is 0, not the request's number" in fails(
        bus_to(module.port), IN0
    )


def test_a_refused_connection_pauses_the_bus_and_asks_once_a_pause() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    clock = Time()
    bus = bus_to(port, clock)
    text = fails(bus, IN0)
    assert text.startswith(f"no Modbus TCP connection to 127.0.0.1:{port}: refused")
    with socket.create_server(("127.0.0.1", port)) as listener:
        listener.settimeout(0.05)
        assert fails(bus, "unit 2 coil 9") == text
        with pytest.raises(TimeoutError):
            listener.accept()


def test_a_bus_that_was_refused_works_when_its_pause_is_over(module: Module) -> None:
    door(module)
    port = module.port
    module.close()
    clock = Time()
    bus = bus_to(port, clock)
    fails(bus, IN0)
    back = Module()
    try:
        door(back)
        bus_again = bus_to(back.port, clock)
        clock.now = 0.5
        assert bus_again.lines({IN0: None}, {}).read() == {IN0: False}
    finally:
        back.close()


def test_a_silent_unit_gets_two_tries_and_then_one_after_each_of_ever_longer_pauses(
    module: Module,
) -> None:
    clock = Time()
    bus = proven(module, clock, timeout_s=1.0)
    module.reply = lambda request: b""
    assert fails(bus, IN0).endswith("read discrete input 0: no reply within 1 s, tried 2x")
    begun = [0.0]
    while clock.now < 130.0:
        clock.now += 0.25
        before = bus.calls
        assert "no reply within 1 s" in fails(bus, IN0)
        if bus.calls > before:
            begun.append(clock.now)
    assert begun == [0.0, 0.5, 1.5, 3.5, 7.5, 15.5, 31.5, 61.5, 91.5, 121.5]
    wait_until(lambda: len(module.asked) > len(begun), "the module has received the last request")
    assert len(module.asked) == 1 + len(begun)


def test_a_unit_that_has_never_answered_gets_one_try(module: Module) -> None:
    module.reply = lambda request: b""
    bus = bus_to(module.port, timeout_s=1.0)
    assert fails(bus, IN0).endswith("no reply within 1 s, tried 1x")
    wait_until(lambda: module.asked, "the module has received the request")
    assert len(module.asked) == 1


def test_switching_off_gets_its_tries_though_the_unit_has_never_answered(module: Module) -> None:
    module.reply = lambda request: b""
    bus = bus_to(module.port, timeout_s=1.0)
    with pytest.raises(HalError, match="tried 2x"):
        bus.lines({}, {"unit 1 coil 0": False}).make_safe()


def test_of_two_silent_units_one_is_tried_and_the_live_ones_have_their_turn(
    module: Module,
) -> None:
    door(module)
    clock = Time()
    bus = bus_to(module.port, clock, timeout_s=1.0)
    silent = ["unit 2 discrete input 0", "unit 3 discrete input 0"]
    for point in silent:
        fails(bus, point)
    wait_until(lambda: len(module.asked) == 2, "the module has received both requests")
    clock.now += 0.7
    module.asked.clear()
    for _ in range(2):
        for point in silent:
            fails(bus, point)
        assert bus.lines({IN0: None}, {}).read() == {IN0: False}
        clock.now += 0.1
    assert module.units_asked() == [2, 1, 3, 1]


def test_a_connection_that_ends_between_two_readings_is_made_again(module: Module) -> None:
    door(module)
    lines = bus_to(module.port).lines({IN0: None}, {})
    for _ in range(3):
        assert lines.read() == {IN0: False}
        module.hang_up()
    assert module.connections == 3


def test_a_server_that_hangs_up_on_each_request_is_a_failure(module: Module) -> None:
    module.reply = lambda request: None
    text = fails(bus_to(module.port), IN0)
    assert "read discrete input 0: the connection broke" in text


def test_a_half_open_connection_costs_one_try_and_no_more() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        text = fails(bus_to(listener.getsockname()[1], timeout_s=1.0), IN0)
    assert text.endswith("no reply within 1 s, tried 1x")


def test_a_reply_that_drips_ends_with_the_time_of_its_try(module: Module) -> None:
    def drip(request: bytes) -> bytes:
        return request[:4] + b"\x00\xff" + request[6:7] + b"\x02"

    bus = proven(module, timeout_s=1.0)
    module.reply = drip
    assert fails(bus, IN0).endswith("within 1 s, tried 2x")


def test_the_late_reply_of_an_earlier_request_answers_no_other(module: Module) -> None:
    door(module)
    module.inputs[1, 5] = True
    held: list[bytes] = []

    def one_behind(request: bytes) -> bytes:
        held.append(module.answer(request))
        return held[-2] if len(held) > 1 else b""

    bus = bus_to(module.port, timeout_s=1.0, retries=0)
    module.reply = one_behind
    fails(bus, "unit 1 discrete input 5")
    bus.insist()
    assert fails(bus, IN0).endswith("no reply within 1 s, tried 1x")


@pytest.mark.parametrize(
    ("what", "reply"),
    [
        ("another unit", lambda q: q[:6] + b"\x02" + bits_reply(q, b"\x01")[7:]),
        ("another transaction", lambda q: b"\x7f" + bits_reply(q, b"\x01")[1:]),
        ("another function", lambda q: frame(q, b"\x01\x01\x01")),
        ("a write's echo", lambda q: frame(q, b"\x05\x00\x00\xff\x00")),
        ("too many bits", lambda q: bits_reply(q, b"\x01\x01")),
        ("no bits", lambda q: bits_reply(q, b"")),
        ("a wrong byte count", lambda q: frame(q, b"\x02\x07\x01")),
        ("no exception code", lambda q: frame(q, b"\x82")),
        ("another function's exception", lambda q: frame(q, b"\x83\x02")),
        ("another protocol", lambda q: q[:2] + b"\x00\x01" + bits_reply(q, b"\x01")[4:]),
        ("an unknown function", lambda q: frame(q, b"\x63\x01\x01")),
        ("an empty frame", lambda q: q[:4] + b"\x00\x01" + q[6:7]),
        ("a frame of length nought", lambda q: q[:4] + b"\x00\x00" + q[6:7] + b"\x02\x01\x01"),
    ],
)
def test_a_reply_to_another_question_does_not_count_as_an_answer(
    module: Module, what: str, reply: object
) -> None:
    assert callable(reply)
    bus = proven(module, timeout_s=1.0)
    module.reply = reply
    assert fails(bus, IN0).endswith("tried 2x"), what


def test_closing_many_doors_on_a_dead_bus_costs_one_try(module: Module) -> None:
    for unit in range(1, 9):
        door(module, unit)
    bus = bus_to(module.port)
    doors = [bus.lines({}, {f"unit {unit} coil 0": False}) for unit in range(1, 9)]
    for lines in doors:
        lines.claim()
    module.close()
    assert isinstance(bus._wire, Connection)
    dialler = bus._wire._dialler
    dialled = dialler.dialled
    for lines in doors:
        lines.close()
    assert dialler.dialled == dialled + 1
    bus.close()
    bus.close()

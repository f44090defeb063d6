"""The Modbus bus against a module of our own, byte by byte: reading, writing, refusals, pauses."""

import socket

import pytest

from drivers.hal.modbus import EXCEPTIONS, ModbusBus
from drivers.hal.modbus_points import parse, ranges
from drivers.points import HalError
from tests.modbus.module import Module, Time, bits_reply, bus_to, frame

IN0, IN1, COIL = "unit 1 discrete input 0", "unit 1 discrete input 1", "unit 1 coil 0"


def door(module: Module, unit: int = 1) -> None:
    """Give this unit a door's two inputs and one coil."""
    module.units.add(unit)
    module.inputs.update({(unit, 0): False, (unit, 1): True})
    module.coils.update({(unit, 0): False})


def fails(bus: ModbusBus, point: str) -> str:
    """The text of the HalError that reading this point raises."""
    with pytest.raises(HalError) as caught:
        bus.lines({point: None}, {}).read()
    return str(caught.value)


def test_inputs_and_coils_are_read_as_the_module_has_them(module: Module) -> None:
    door(module)
    lines = bus_to(module.port).lines({IN0: None, IN1: None}, {COIL: False})
    assert lines.read() == {IN0: False, IN1: True}
    module.inputs.update({(1, 0): True, (1, 1): False})
    assert lines.read() == {IN0: True, IN1: False}
    assert lines.outputs() == {COIL: False}


def test_the_bytes_of_each_request_are_those_of_the_specification(module: Module) -> None:
    door(module)
    lines = bus_to(module.port).lines({IN0: None, IN1: None}, {COIL: False})
    lines.read()
    lines.write({COIL: True})
    lines.write({COIL: False})
    read_coil, read_inputs = "010100000001", "010200000002"
    on, off = "01050000ff00", "010500000000"
    wanted = [read_coil, read_inputs, on, read_coil, off, read_coil]
    assert [request[6:].hex() for request in module.asked] == wanted
    assert [request[2:6].hex() for request in module.asked] == ["00000006"] * 6


def test_sixteen_bits_come_in_the_order_of_the_specification(module: Module) -> None:
    module.reply = lambda request: bits_reply(request, bytes((0b0000_0101, 0b1000_0000)))
    bus = bus_to(module.port)
    for table in ("coil", "discrete input"):
        names = [f"unit 1 {table} {i}" for i in range(16)]
        read = bus.read(ranges(map(parse, names))[0])
        assert [str(point) for point, level in read.items() if level] == [
            f"unit 1 {table} {i}" for i in (0, 2, 15)
        ]


def test_bits_that_are_near_are_asked_for_together(module: Module) -> None:
    for address in range(30):
        module.inputs[1, address] = address in (0, 9, 20)
    points = [f"unit 1 discrete input {a}" for a in (20, 9, 0, 29)]
    read = bus_to(module.port).lines(dict.fromkeys(points), {}).read()
    assert read == dict(zip(points, (True, True, True, False), strict=True))
    assert [request[8:12].hex() for request in module.asked] == ["0000000a", "0014000a"]


def test_a_module_without_the_addresses_between_is_asked_without_them_from_then_on(
    module: Module,
) -> None:
    module.inputs.update({(1, 0): True, (1, 1): False, (1, 5): True})
    points = [f"unit 1 discrete input {a}" for a in (0, 1, 5)]
    lines = bus_to(module.port).lines(dict.fromkeys(points), {})
    assert lines.read() == dict(zip(points, (True, False, True), strict=True))
    assert lines.read() == dict(zip(points, (True, False, True), strict=True))
    asked = [request[8:12].hex() for request in module.asked]
    assert asked == ["00000006", *["00000002", "00050001"] * 2]


def test_an_address_that_is_missing_itself_is_refused_each_time(module: Module) -> None:
    bus = bus_to(module.port)
    where = f"modbus unit 1 at 127.0.0.1:{module.port}, read discrete input 7: exception 2, "
    for _ in range(2):
        assert fails(bus, "unit 1 discrete input 7").startswith(where)
    assert len(module.asked) == 2


@pytest.mark.parametrize("code", range(1, 13))
def test_an_exception_is_named(module: Module, code: int) -> None:
    module.reply = lambda request: frame(request, bytes((0x82, code)))
    text = fails(bus_to(module.port), IN0)
    named = EXCEPTIONS.get(code, "an exception that Modbus does not define")
    assert text.endswith(f"read discrete input 0: exception {code}, {named}")
    assert len(module.asked) == 1


def test_claiming_reads_before_it_writes_and_switches_off(module: Module) -> None:
    door(module)
    module.coils[1, 0] = True
    bus_to(module.port).lines({IN0: None}, {COIL: False}).claim()
    assert module.functions() == [1, 5, 1]
    assert module.coils == {(1, 0): False}


def test_nothing_is_written_to_coils_that_cannot_be_read(module: Module) -> None:
    door(module)
    module.reply = lambda request: (
        frame(request, b"\x81\x04") if request[7] == 1 else module.answer(request)
    )
    lines = bus_to(module.port).lines({IN0: None}, {COIL: False})
    with pytest.raises(HalError):
        lines.claim()
    lines.close()
    assert module.functions() == [1]


def test_an_input_that_cannot_be_read_keeps_no_output_on(module: Module) -> None:
    module.coils[1, 0] = True
    lines = bus_to(module.port).lines({"unit 2 discrete input 0": None}, {COIL: False})
    lines.claim()
    assert module.coils == {(1, 0): False}


def test_claimed_again_after_a_failure_the_outputs_stay_as_they_are(module: Module) -> None:
    door(module)
    lines = bus_to(module.port).lines({IN0: None}, {COIL: False})
    lines.claim()
    lines.write({COIL: True})
    module.hang_up()
    lines.claim()
    assert (module.coils[1, 0], module.functions().count(5)) == (True, 2)


def test_a_coil_that_does_not_take_its_level_is_a_failure(module: Module) -> None:
    door(module)
    module.reply = lambda request: (
        frame(request, request[7:12]) if request[7] == 5 else module.answer(request)
    )
    lines = bus_to(module.port).lines({IN0: None}, {COIL: False})
    with pytest.raises(HalError, match="unit 1 coil 0 reads 0 after 1 was written"):
        lines.write({COIL: True})


def test_a_module_that_restarts_with_its_coils_off_is_noticed_once(module: Module) -> None:
    door(module)
    lines = bus_to(module.port).lines({IN0: None}, {COIL: False})
    lines.claim()
    lines.write({COIL: True})
    module.coils[1, 0] = False
    with pytest.raises(HalError, match="the module has restarted, its watchdog has tripped"):
        lines.read()
    assert lines.read() == {IN0: False}


def test_closing_switches_off_even_while_the_bus_pauses(module: Module) -> None:
    door(module)
    bus = bus_to(module.port)
    lines = bus.lines({IN0: None}, {COIL: False})
    lines.claim()
    lines.write({COIL: True})
    module.reply = lambda request: frame(request, b"\x82\x06")
    with pytest.raises(HalError):
        lines.read()
    module.reply = module.answer
    lines.close()
    lines.close()
    assert module.coils[1, 0] is False


def test_a_refused_connection_pauses_the_bus_and_asks_once_a_pause() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    clock = Time()
    bus = bus_to(port, clock)
    text = fails(bus, IN0)
    assert text.startswith(f"no Modbus TCP connection to 127.0.0.1:{port}: it is refused")
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


def test_a_silent_unit_gets_two_tries_and_then_ever_longer_pauses(module: Module) -> None:
    module.reply = lambda request: b""
    clock = Time()
    bus = bus_to(module.port, clock, timeout_s=0.05)
    text = fails(bus, IN0)
    assert text.endswith("read discrete input 0: no reply within 0.05 s, tried 2x")
    begun = [0.0]
    while clock.now < 130.0:
        clock.now += 0.25
        before = len(module.asked)
        assert fails(bus, IN0) == text
        if len(module.asked) > before:
            begun.append(clock.now)
            assert len(module.asked) == before + 2
    assert begun == [0.0, 0.5, 1.5, 3.5, 7.5, 15.5, 31.5, 61.5, 91.5, 121.5]


def test_the_jitter_only_shortens_a_pause(module: Module) -> None:
    module.reply = lambda request: frame(request, b"\x82\x0b")
    clock = Time()
    bus = bus_to(module.port, clock)
    bus._units[1] = type(bus._link)(clock, lambda: 1.0)
    fails(bus, IN0)
    clock.now = 0.39
    fails(bus, IN0)
    assert len(module.asked) == 1
    clock.now = 0.4
    fails(bus, IN0)
    assert len(module.asked) == 2


def test_one_dead_unit_costs_the_other_nothing_but_its_tries(module: Module) -> None:
    door(module, unit=1)
    clock = Time()
    bus = bus_to(module.port, clock, timeout_s=0.3)
    alive = bus.lines({IN0: None}, {})
    for _ in range(30):
        clock.now += 0.1
        assert alive.read() == {IN0: False}
        fails(bus, "unit 2 discrete input 0")
    assert (module.units_asked().count(1), module.units_asked().count(2)) == (30, 2 * 3)


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


def test_a_half_open_connection_costs_its_tries_and_no_more() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        text = fails(bus_to(listener.getsockname()[1], timeout_s=0.05), IN0)
    assert text.endswith("no reply within 0.05 s, tried 2x")


def test_a_reply_that_drips_ends_with_the_time_of_its_try(module: Module) -> None:
    def drip(request: bytes) -> bytes:
        return request[:4] + b"\x00\xff" + request[6:7] + b"\x02"

    module.reply = drip
    assert fails(bus_to(module.port, timeout_s=0.05), IN0).endswith("0.05 s, tried 2x")


def test_the_late_reply_of_an_earlier_request_answers_no_other(module: Module) -> None:
    door(module)
    module.inputs[1, 5] = True
    held: list[bytes] = []

    def one_behind(request: bytes) -> bytes:
        held.append(module.answer(request))
        return held[-2] if len(held) > 1 else b""

    bus = bus_to(module.port, timeout_s=0.05, retries=0)
    module.reply = one_behind
    fails(bus, "unit 1 discrete input 5")
    bus.insist()
    assert fails(bus, IN0).endswith("no reply within 0.05 s, tried 1x")


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
def test_what_does_not_answer_the_question_is_no_answer(
    module: Module, what: str, reply: object
) -> None:
    assert callable(reply)
    module.reply = reply
    bus = bus_to(module.port, timeout_s=0.05)
    assert fails(bus, IN0).endswith("tried 2x"), what


@pytest.mark.parametrize(
    "pdu", [b"\x05\x00\x01\xff\x00", b"\x05\x00\x00\x00\x00", b"\x05\x00\x00\x12\x34", b"\x05\x00"]
)
def test_the_echo_of_another_write_is_no_answer(module: Module, pdu: bytes) -> None:
    door(module)
    module.reply = lambda request: (
        frame(request, pdu) if request[7] == 5 else module.answer(request)
    )
    lines = bus_to(module.port, timeout_s=0.05).lines({IN0: None}, {COIL: False})
    with pytest.raises(HalError, match="tried 2x"):
        lines.write({COIL: True})


def test_closing_many_doors_on_a_dead_bus_costs_one_try(module: Module) -> None:
    for unit in range(1, 9):
        door(module, unit)
    bus = bus_to(module.port)
    doors = [bus.lines({}, {f"unit {unit} coil 0": False}) for unit in range(1, 9)]
    for lines in doors:
        lines.claim()
    module.close()
    dialler = bus._connection._dialler
    dialled = dialler.dialled
    for lines in doors:
        lines.close()
    assert dialler.dialled == dialled + 1
    bus.close()
    bus.close()

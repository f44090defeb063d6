"""The contract of the Modbus bus. The tests run it against `module.py`, on TCP and on a serial line.

Stories about TCP alone are in `test_bus.py`. Stories about the serial line alone are in `test_rtu.py`.
"""

import pytest

from drivers.hal.modbus.points import parse, ranges
from drivers.hal.modbus.wire import EXCEPTIONS, UNDEFINED
from drivers.hal.points import HalError
from tests.drivers.hal.modbus.module import Module, Time, bits_reply, bus_to, door, fails, frame

IN0, IN1, COIL = "unit 1 discrete input 0", "unit 1 discrete input 1", "unit 1 coil 0"


def test_inputs_and_coils_are_read_as_the_module_has_them(either: Module) -> None:
    door(either)
    lines = bus_to(either.port).lines({IN0: None, IN1: None}, {COIL: False})
    assert lines.read() == {IN0: False, IN1: True}
    either.inputs.update({(1, 0): True, (1, 1): False})
    assert lines.read() == {IN0: True, IN1: False}
    assert lines.outputs() == {COIL: False}


def test_the_bytes_of_each_request_are_those_of_the_specification(either: Module) -> None:
    door(either)
    lines = bus_to(either.port).lines({IN0: None, IN1: None}, {COIL: False})
    lines.read()
    lines.write({COIL: True})
    lines.write({COIL: False})
    read_coil, read_inputs = "010100000001", "010200000002"
    on, off = "01050000ff00", "010500000000"
    wanted = [read_coil, read_inputs, on, read_coil, off, read_coil]
    assert [request[6:].hex() for request in either.asked] == wanted
    assert [request[2:6].hex() for request in either.asked] == ["00000006"] * 6


def test_sixteen_bits_come_in_the_order_of_the_specification(either: Module) -> None:
    either.reply = lambda request: bits_reply(request, bytes((0b0000_0101, 0b1000_0000)))
    bus = bus_to(either.port)
    for table in ("coil", "discrete input"):
        names = [f"unit 1 {table} {i}" for i in range(16)]
        read = bus.read(ranges(map(parse, names))[0])
        assert [str(point) for point, level in read.items() if level] == [
            f"unit 1 {table} {i}" for i in (0, 2, 15)
        ]


def test_bits_that_are_near_are_asked_for_together(either: Module) -> None:
    for address in range(30):
        either.inputs[1, address] = address in (0, 9, 20)
    points = [f"unit 1 discrete input {a}" for a in (20, 9, 0, 29)]
    read = bus_to(either.port).lines(dict.fromkeys(points), {}).read()
    assert read == dict(zip(points, (True, True, True, False), strict=True))
    assert [request[8:12].hex() for request in either.asked] == ["0000000a", "0014000a"]


def test_a_module_without_the_addresses_between_is_asked_without_them_from_then_on(
    either: Module,
) -> None:
    either.inputs.update({(1, 0): True, (1, 1): False, (1, 5): True})
    points = [f"unit 1 discrete input {a}" for a in (0, 1, 5)]
    lines = bus_to(either.port).lines(dict.fromkeys(points), {})
    assert lines.read() == dict(zip(points, (True, False, True), strict=True))
    assert lines.read() == dict(zip(points, (True, False, True), strict=True))
    asked = [request[8:12].hex() for request in either.asked]
    assert asked == ["00000006", *["00000002", "00050001"] * 2]


def test_an_address_that_is_missing_itself_is_refused_each_time(either: Module) -> None:
    bus = bus_to(either.port)
    where = f"modbus unit 1 at {either.where}, read discrete input 7: exception 2, "
    for _ in range(2):
        assert fails(bus, "unit 1 discrete input 7").startswith(where)
    assert len(either.asked) == 2


@pytest.mark.parametrize("code", [*range(13), 255])
def test_an_exception_is_named_on_tcp_and_on_a_line(either: Module, code: int) -> None:
    either.reply = lambda request: frame(request, bytes((0x82, code)))
    text = fails(bus_to(either.port), IN0)
    named = EXCEPTIONS.get(code, UNDEFINED)
    assert text.endswith(f"read discrete input 0: exception {code}, {named}")
    assert len(either.asked) == 1


def test_claiming_reads_before_it_writes_and_switches_off(either: Module) -> None:
    door(either)
    either.coils[1, 0] = True
    bus_to(either.port).lines({IN0: None}, {COIL: False}).claim()
    assert either.functions() == [1, 5, 1]
    assert either.coils == {(1, 0): False}


def test_nothing_is_written_to_coils_that_cannot_be_read(either: Module) -> None:
    door(either)
    either.reply = lambda request: (
        frame(request, b"\x81\x04") if request[7] == 1 else either.answer(request)
    )
    lines = bus_to(either.port).lines({IN0: None}, {COIL: False})
    with pytest.raises(HalError):
        lines.claim()
    lines.close()
    assert either.functions() == [1]


def test_an_input_that_cannot_be_read_keeps_no_output_on(either: Module) -> None:
    either.coils[1, 0] = True
    lines = bus_to(either.port).lines({"unit 2 discrete input 0": None}, {COIL: False})
    lines.claim()
    assert either.coils == {(1, 0): False}


def test_claimed_again_after_a_failure_the_outputs_stay_as_they_are(either: Module) -> None:
    door(either)
    lines = bus_to(either.port).lines({IN0: None}, {COIL: False})
    lines.claim()
    lines.write({COIL: True})
    either.hang_up()
    lines.claim()
    assert (either.coils[1, 0], either.functions().count(5)) == (True, 2)


def test_a_coil_that_does_not_take_its_level_is_a_failure(either: Module) -> None:
    door(either)
    either.reply = lambda request: (
        frame(request, request[7:12]) if request[7] == 5 else either.answer(request)
    )
    lines = bus_to(either.port).lines({IN0: None}, {COIL: False})
    with pytest.raises(HalError, match="unit 1 coil 0 reads 0 after 1 was written"):
        lines.write({COIL: True})


def test_a_module_that_restarts_with_its_coils_off_is_noticed_once(either: Module) -> None:
    door(either)
    lines = bus_to(either.port).lines({IN0: None}, {COIL: False})
    lines.claim()
    lines.write({COIL: True})
    either.coils[1, 0] = False
    with pytest.raises(HalError, match="the module has restarted, its watchdog has tripped"):
        lines.read()
    assert lines.read() == {IN0: False}


def test_closing_switches_off_even_while_the_bus_pauses(either: Module) -> None:
    door(either)
    bus = bus_to(either.port)
    lines = bus.lines({IN0: None}, {COIL: False})
    lines.claim()
    lines.write({COIL: True})
    either.reply = lambda request: frame(request, b"\x82\x06")
    with pytest.raises(HalError):
        lines.read()
    either.reply = either.answer
    lines.close()
    lines.close()
    assert either.coils[1, 0] is False


def test_the_jitter_only_shortens_a_pause(either: Module) -> None:
    either.reply = lambda request: frame(request, b"\x82\x0b")
    clock = Time()
    bus = bus_to(either.port, clock)
    bus._backoffs[1, False] = type(bus._link)(clock, lambda: 1.0)
    fails(bus, IN0)
    clock.now = 0.39
    fails(bus, IN0)
    assert len(either.asked) == 1
    clock.now = 0.4
    fails(bus, IN0)
    assert len(either.asked) == 2


def test_one_dead_unit_costs_the_other_its_tries_and_then_one_a_pause(either: Module) -> None:
    door(either, unit=1)
    clock = Time()
    bus = bus_to(either.port, clock, timeout_s=1.0)
    alive = bus.lines({IN0: None}, {})
    for _ in range(30):
        clock.now += 0.1
        assert alive.read() == {IN0: False}
        fails(bus, "unit 2 discrete input 0")
    assert either.units_asked().count(1) == 30
    assert either.units_asked().count(2) <= 2 + 1 + 1  # 2 tries at first, then 1 after each pause


@pytest.mark.parametrize(
    "pdu", [b"\x05\x00\x01\xff\x00", b"\x05\x00\x00\x00\x00", b"\x05\x00\x00\x12\x34", b"\x05\x00"]
)
def test_the_echo_of_another_write_does_not_count_as_an_answer(either: Module, pdu: bytes) -> None:
    door(either)
    either.reply = lambda request: (
        frame(request, pdu) if request[7] == 5 else either.answer(request)
    )
    lines = bus_to(either.port, timeout_s=1.0).lines({IN0: None}, {COIL: False})
    with pytest.raises(HalError, match="tried 2x"):
        lines.write({COIL: True})

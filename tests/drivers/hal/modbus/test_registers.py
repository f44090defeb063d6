"""Registers on the wire: requests byte by byte, and valid replies."""

import struct

import pytest

from drivers.hal.modbus.lines import ModbusLines
from drivers.hal.modbus.points import Point
from drivers.hal.modbus.registers import REGISTERS, TABLES, WRITABLE, at, place
from drivers.hal.modbus.wire import READS, WRITES
from drivers.hal.points import HalError
from tests.drivers.hal.modbus.module import Module, Time, bus_to, frame

H0, H1, H9 = (Point(1, "holding register", a) for a in (0, 1, 9))
I0, COIL = Point(1, "input register", 0), Point(1, "coil", 4)


def registers(module: Module, *words: int) -> None:
    """Let the module answer every read of registers with these words."""
    pdu = bytes((2 * len(words),)) + struct.pack(f">{len(words)}H", *words)
    module.reply = lambda request: frame(request, request[7:8] + pdu)


def test_neighbours_are_asked_for_together_and_nothing_besides(either: Module) -> None:
    either.reply = lambda request: frame(
        request, bytes((request[7], 2 * request[11], *(0x12, 0x34) * request[11]))
    )
    image = bus_to(either.port).cells([I0, H9, H1, H0])
    assert image == dict.fromkeys((H0, H1, H9, I0), 0x1234)
    asked = [request[6:].hex() for request in either.asked]
    assert asked == ["010300000002", "010300090001", "010400000001"]


def test_a_register_is_written_with_function_6(either: Module) -> None:
    either.reply = lambda request: frame(request, request[7:12])
    bus_to(either.port).write(H9, 0xABCD)
    assert [request[6:].hex() for request in either.asked] == ["01060009abcd"]


def test_a_coil_is_written_and_read_as_one(either: Module) -> None:
    either.coils[1, 4] = False
    bus = bus_to(either.port)
    bus.write(COIL, 1)
    assert bus.cells([COIL]) == {COIL: 1}
    assert [request[6:].hex() for request in either.asked] == ["01050004ff00", "010100040001"]


@pytest.mark.parametrize(
    "pdu",
    [
        "030400010002",  # two registers instead of one
        "0300",
        "03020001ff",  # one byte more than the byte count says
        "03030001ff",  # an odd number of bytes
        "04020001",  # a reply from another table
        "0602000900",
        "060009abcd",
    ],
)
def test_a_reply_to_something_else_gives_no_reading(module: Module, pdu: str) -> None:
    module.reply = lambda request: frame(request, bytes.fromhex(pdu))
    with pytest.raises(HalError, match=r"no Modbus reply to the request|no reply within"):
        bus_to(module.port, Time(), timeout_s=0.5, retries=0).cells([H0])


@pytest.mark.parametrize(
    "pdu", ["060009abce", "060009abcd00", "06000aabcd", "0600", "050009ff00", "0302abcd"]
)
def test_the_echo_of_another_write_does_not_count_as_a_success(module: Module, pdu: str) -> None:
    module.reply = lambda request: frame(request, bytes.fromhex(pdu))
    with pytest.raises(HalError):
        bus_to(module.port, Time(), timeout_s=0.5, retries=0).write(H9, 0xABCD)


def test_closing_what_was_never_claimed_sends_nothing(module: Module) -> None:
    ModbusLines(bus_to(module.port), {}, {"command": H9}, {"command": 0}).close()
    assert module.asked == []


def test_an_exception_is_named(module: Module) -> None:
    module.reply = lambda request: frame(request, bytes((0x83, 2)))
    with pytest.raises(
        HalError, match="read holding register 0: exception 2, illegal data address"
    ):
        bus_to(module.port).cells([H0])


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("holding register 0", ("holding register", 0)),
        ("Input_Register 0x1F", ("input register", 31)),
        ("coil 7", ("coil", 7)),
        ("discrete input 65535", ("discrete input", 65535)),
        ("holding register 0x9c41", ("holding register", 40001)),
    ],
)
def test_a_place_has_a_table_and_an_address(text: str, found: tuple[str, int]) -> None:
    assert place(text) == found


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("40001", "'40001': write 'coil 0' or"),
        ("register 5", "'register 5': write 'coil 0' or"),
        ("holding register", "'holding register': write 'coil 0' or"),
        ("holding register 65536", "address 65536 does not exist"),
        (
            "holding register 40011",
            "40011 looks like a manual's number, and these begin at 1",
        ),
    ],
)
def test_a_text_that_is_not_a_place_is_refused_with_an_example(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        place(text)


def test_a_base_moves_every_address() -> None:
    assert at(3, "input register 2", 100) == Point(3, "input register", 102)
    assert {*REGISTERS, *WRITABLE} <= {*TABLES}
    assert (set(READS), set(WRITES)) == (set(TABLES), set(WRITABLE))


def test_a_gap_that_a_unit_lacks_is_asked_for_once(module: Module) -> None:
    """Coils 0 and 5 exist, and the coils between them do not. The bus reads back each write."""
    module.coils.update({(1, 0): False, (1, 5): False})
    zero, five = "unit 1 coil 0", "unit 1 coil 5"
    lines = bus_to(module.port).lines({}, {zero: False, five: False})
    lines.claim()
    for on in (True, False, True):
        lines.write({zero: on, five: on})
        lines.read()
    merged = [request for request in module.asked if request[7] == 1 and request[11] == 6]
    assert len(merged) == 1

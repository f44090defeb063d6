"""The Modbus bus on a serial line: frames byte by byte, and every disturbance of a line."""

import os
import threading
from collections.abc import Callable

import pytest

from drivers.hal.modbus import ModbusBus
from drivers.hal.modbus.points import parse, ranges
from drivers.hal.points import HalError
from tests.drivers.hal.modbus.line import SerialModule, crc, rtu
from tests.drivers.hal.modbus.module import Module, Time, bits_reply, bus_to, door, fails, proven
from tests.waiting import at_last

IN0, COIL = "unit 1 discrete input 0", "unit 1 coil 0"
READ_IN0 = rtu("010200000001")
IS_0, IS_1 = rtu("01020100"), rtu("01020101")


def coils(bus: ModbusBus, count: int) -> list[int]:
    """Return the values of the first `count` coils of unit 1."""
    return list(bus.read(ranges(parse(f"unit 1 coil {i}") for i in range(count))[0]).values())


def test_the_frames_are_those_of_the_makers_manual(line: SerialModule) -> None:
    """Expect the frames in the manual of the Waveshare Modbus RTU Relay. They switch relay 0 on and
    off, and read the states of all relays."""
    said = {
        "01050000ff008c3a": "01050000ff008c3a",
        "010500000000cdca": "010500000000cdca",
        "0101000000083dcc": "010101005188",
    }
    line.on_wire = lambda frame: bytes.fromhex(said[frame.hex()])
    bus = bus_to(line.port)
    bus.write(parse(COIL), True)
    bus.write(parse(COIL), False)
    assert coils(bus, 8) == [False] * 8
    assert [frame.hex() for frame in line.frames] == list(said)


def test_sixteen_coils_come_lowest_address_in_the_lowest_bit(line: SerialModule) -> None:
    """Use the example of Modbus Application Protocol V1.1b3, 6.1, shortened to 16 coils (bytes CD
    6B)."""
    said = {"010100000010" + crc(bytes.fromhex("010100000010")).hex(): rtu("010102cd6b")}
    line.on_wire = lambda frame: said[frame.hex()]
    high = [i for i, level in enumerate(coils(bus_to(line.port), 16)) if level]
    assert high == [0, 2, 3, 6, 7, 8, 9, 11, 13, 14]


NO_ANSWER: dict[str, Callable[[bytes], bytes]] = {
    "a wrong CRC": lambda q: IS_1[:-1] + bytes((IS_1[-1] ^ 1,)),
    "half a frame": lambda q: IS_1[:3],
    "another unit": lambda q: rtu("02020101"),
    "another function": lambda q: rtu("01010101"),
    "too many bits": lambda q: rtu("0102020101"),
    "no bits": lambda q: rtu("010200"),
    "a byte count that lies": lambda q: rtu("01020501"),
    "another function's exception": lambda q: rtu("018302"),
    "its own request": lambda q: q,
    "a broadcast's number": lambda q: rtu("00020101"),
    "noise": lambda q: b"\x01\x02\xff" + bytes(range(40)),
    "an answer after noise": lambda q: b"\x00" + IS_1,
}


@pytest.mark.parametrize("what", NO_ANSWER)
def test_a_wrong_reply_is_refused_and_the_next_reading_is_right(
    line: SerialModule, what: str
) -> None:
    door(line)
    line.on_wire = NO_ANSWER[what]
    clock = Time()
    bus = bus_to(line.port, clock, timeout_s=0.05, retries=0)
    assert fails(bus, IN0).endswith("tried 1x"), what
    line.on_wire = None
    clock.now += 60.0
    lines = bus.lines({IN0: None}, {})
    bus.insist()
    assert at_last(lines.read, "the next reading succeeds", lambda: _later(clock)) == {IN0: False}


def _later(clock: Time) -> None:
    clock.now += 60.0


def test_one_broken_frame_is_asked_again_at_once(line: SerialModule) -> None:
    replies = iter([IS_1[:-1] + b"\x00", IS_0])
    bus = proven(line)
    line.on_wire = lambda frame: next(replies)
    assert bus.lines({IN0: None}, {}).read() == {IN0: False}
    assert line.frames[-2:] == [READ_IN0, READ_IN0]
    assert len(line.asked) == 2


def test_noise_after_a_reply_does_not_reach_the_next(line: SerialModule) -> None:
    line.on_wire = lambda frame: IS_0 + IS_1
    lines = bus_to(line.port).lines({IN0: None}, {})
    assert [lines.read() for _ in range(5)] == [{IN0: False}] * 5


def test_an_unsolicited_frame_is_thrown_away(line: SerialModule) -> None:
    door(line)
    lines = bus_to(line.port).lines({IN0: None}, {})
    lines.read()
    line.say(IS_1)
    assert lines.read() == {IN0: False}


def test_the_late_reply_of_another_unit_is_dropped_and_ours_is_waited_for(
    line: SerialModule,
) -> None:
    later = threading.Event()

    def both(frame: bytes) -> bytes:
        line.say(rtu("02020101"))
        later.wait(0.05)  # longer than the silence that separates two frames
        return IS_0

    line.on_wire = both
    assert bus_to(line.port, retries=0).lines({IN0: None}, {}).read() == {IN0: False}


def test_a_fault_says_which_other_unit_was_heard(line: SerialModule) -> None:
    other = rtu("02020101")
    line.on_wire = lambda frame: other
    text = fails(bus_to(line.port, timeout_s=1.0, retries=0), IN0)
    assert f"no reply within 1 s, but bytes of another unit: {other.hex(' ')}" in text


def test_the_late_reply_to_one_question_never_answers_another(line: SerialModule) -> None:
    """Simulate a unit that is one reply behind. Each reply looks valid, but it answers the previous
    request.

    The unit sends its last reply after the next request. If no request follows, the unit sends the
    reply a little later.
    """
    owed: list[bytes] = []

    def a_little_later() -> None:
        line.say(b"".join(owed))
        owed.clear()

    later = threading.Timer(0.36, a_little_later)

    def one_behind(frame: bytes) -> bytes:
        owed.append(IS_1 if frame[3] == 5 else IS_0)
        if len(line.asked) == 2:
            later.start()
        return owed.pop(0) if len(owed) > 1 else b""

    bus = proven(line, Time(), timeout_s=1.0, retries=1)
    line.on_wire = one_behind
    asked = "unit 1 discrete input 5"
    assert bus.lines({asked: None}, {}).read() == {asked: True}  # the second try succeeds
    assert bus._wire.owes(1)
    assert bus.lines({IN0: None}, {}).read() == {IN0: False}
    assert [request[9] for request in line.asked] == [5, 5, 0, 0]
    later.join()


def test_half_a_frame_is_not_waited_for_until_the_end(line: SerialModule) -> None:
    line.on_wire = lambda frame: IS_1[:4]
    text = fails(bus_to(line.port, timeout_s=5.0, retries=0), IN0)
    assert text.endswith("no Modbus reply to the request (01 02 01 01 is half a frame), tried 1x")


def test_a_unit_that_owes_a_reply_is_not_asked_until_it_cannot_come(line: SerialModule) -> None:
    line.on_wire = lambda frame: b""
    clock = Time()
    bus = bus_to(line.port, clock, timeout_s=0.5, retries=0)
    text = fails(bus, IN0)
    clock.now += 60.0
    assert fails(bus, "unit 1 discrete input 7") == text
    assert line.frames == [READ_IN0]


def test_an_adapter_that_echoes_is_understood_when_the_file_says_so(line: SerialModule) -> None:
    door(line)
    line.on_wire = lambda frame: frame + _answer(line, frame)
    lines = bus_to(line.port, ignore_echo=True).lines({IN0: None}, {COIL: False})
    lines.claim()
    lines.write({COIL: True})
    assert (lines.read(), lines.outputs()) == ({IN0: False}, {COIL: True})


def test_an_echo_alone_does_not_answer_even_a_write(line: SerialModule) -> None:
    line.on_wire = lambda frame: frame
    bus = bus_to(line.port, timeout_s=0.05, ignore_echo=True)
    with pytest.raises(HalError, match=r"no reply within 0\.05 s"):
        bus.write(parse(COIL), True)


def test_an_adapter_that_echoes_unannounced_is_named(line: SerialModule) -> None:
    door(line)
    line.on_wire = lambda frame: frame + _answer(line, frame)
    text = fails(bus_to(line.port, timeout_s=1.0), IN0)
    assert "the request itself came back; if the adapter echoes, write ignore_echo: true" in text


def test_a_second_echo_is_that_of_an_earlier_try_and_the_file_is_not_blamed(
    line: SerialModule,
) -> None:
    door(line)
    line.on_wire = lambda frame: frame + frame + _answer(line, frame)
    text = fails(bus_to(line.port, timeout_s=1.0, ignore_echo=True), IN0)
    assert "the adapter's echo came late" in text
    assert "ignore_echo" not in text


def test_an_adapter_that_does_not_echo_although_the_file_says_so_is_named(
    line: SerialModule,
) -> None:
    door(line)
    text = fails(bus_to(line.port, ignore_echo=True), IN0)
    assert "the first bytes are not the echo; does the adapter echo? see ignore_echo" in text


def test_a_port_that_vanishes_is_found_again_by_its_path(line: SerialModule) -> None:
    door(line)
    clock = Time()
    bus = bus_to(line.port, clock)
    lines = bus.lines({IN0: None}, {})
    assert lines.read() == {IN0: False}
    line.pull()
    text = f"no serial port {line.port}: the port is not there; is the adapter plugged in?"
    assert fails(bus, IN0).startswith(text)
    line.plug()
    assert fails(bus, "unit 2 coil 0").startswith(text)  # the bus pauses for every unit
    clock.now += 0.5
    assert lines.read() == {IN0: False}


def test_a_port_that_vanishes_and_is_back_at_once_costs_one_try(line: SerialModule) -> None:
    door(line)
    lines = bus_to(line.port).lines({IN0: None}, {})
    lines.read()
    line.hang_up()
    assert lines.read() == {IN0: False}


def test_a_port_that_another_program_has_open_is_left_alone(line: SerialModule) -> None:
    door(line)
    bus_to(line.port).lines({IN0: None}, {}).read()
    text = fails(bus_to(line.port), IN0)
    assert text == f"no serial port {line.port}: another program has it open"


@pytest.mark.parametrize(
    ("port", "text"),
    [
        ("/dev/null", "Inappropriate ioctl for device"),
        ("/dev/nowhere", "the port is not there; is the adapter plugged in? ls /dev/serial/by-id"),
        (os.path.dirname(__file__), "Is a directory"),
    ],
)
def test_a_path_that_is_not_a_serial_port_is_named(port: str, text: str) -> None:
    found = fails(bus_to(port), IN0)
    assert found.startswith(f"no serial port {port}: ")
    assert text in found


def test_a_line_that_is_never_silent_is_a_failure(line: SerialModule) -> None:
    enough = threading.Event()

    def chatter(frame: bytes) -> bytes:
        while not enough.wait(0.0005):
            line.say(b"\x55")
        return b""

    bus = proven(line, timeout_s=0.05)
    line.on_wire = chatter
    text = fails(bus, IN0)
    enough.set()
    assert text.endswith("tried 2x")


@pytest.mark.parametrize("unit", [0, 255])
def test_a_unit_that_a_line_cannot_have_is_never_asked(line: SerialModule, unit: int) -> None:
    text = fails(bus_to(line.port), f"unit {unit} discrete input 0")
    assert "units on a serial line are 1 to 247" in text
    assert line.frames == []


def _answer(module: Module, frame: bytes) -> bytes:
    request = b"\0\0\0\0\0\6" + frame[:-2]
    answer = module.answer(request)[6:]
    return answer + crc(answer)


def test_the_module_of_these_tests_speaks_as_the_specification_does() -> None:
    assert rtu("01050000ff00").hex() == "01050000ff008c3a"
    assert bits_reply(b"\0\0\0\0\0\6" + READ_IN0[:-2], b"\1")[6:] + crc(IS_1[:-2]) == IS_1

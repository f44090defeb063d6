"""Arbitrary replies on TCP and on a serial line. They may cause only HalErrors.

The driver must never report a closed door as open, or report a pulse that the module has not confirmed.
"""

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import msgspec
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from bridges.kinds.door.signals import DoorOutputs
from drivers import DriverError
from drivers.door.dry_contact import DryContactDoor, DryContactDoorSettings, create
from drivers.hal.modbus import ModbusBus
from drivers.hal.modbus.points import Point
from drivers.hal.points import HalError
from tests.depth import examples
from tests.drivers.hal.modbus.line import SerialModule, crc, rtu
from tests.drivers.hal.modbus.module import Module, Time, bits_reply, bus_to, frame
from tests.waiting import wait_until

DOOR = msgspec.convert(
    {
        "inputs": {
            "opened": {"point": "unit 1 discrete input 0", "active": "high"},
            "closed": {"point": "unit 1 discrete input 1", "active": "high"},
        },
        "outputs": {"hold_open": {"point": "unit 1 coil 0", "active": "high"}},
    },
    DryContactDoorSettings,
)

Spoil = Callable[[bytes, bytes], bytes | None]
"""A function that gets a request and the correct reply. It returns the bytes that the module sends."""


def _flipped(good: bytes, at: int, mask: int) -> bytes:
    at %= len(good)
    return good[:at] + bytes((good[at] ^ mask,)) + good[at + 1 :]


BYTES = st.binary(max_size=40)
SPOILS: st.SearchStrategy[Spoil] = st.one_of(
    BYTES.map(lambda junk: lambda request, good: junk),
    BYTES.map(lambda junk: lambda request, good: junk + good),
    BYTES.map(lambda pdu: lambda request, good: frame(request, pdu)),
    st.tuples(st.integers(0, 255), BYTES).map(
        lambda drawn: lambda request, good: frame(request, bytes((drawn[0],)) + drawn[1])
    ),
    st.integers(0, 12).map(lambda kept: lambda request, good: good[:kept]),
    st.tuples(st.integers(0, 20), st.integers(1, 255)).map(
        lambda drawn: lambda request, good: _flipped(good, *drawn)
    ),
    st.just(lambda request, good: good),
    st.just(lambda request, good: None),
)


@pytest.fixture(scope="module")
def one_module() -> Iterator[Module]:
    module = Module()
    yield module
    module.close()


class Spoiled:
    """A module's replies about a closed door on TCP. Each function in `spoils` spoils one reply.

    After the last function the module closes the connection.
    """

    def __init__(self, module: Module, spoils: list[Spoil]) -> None:
        module.inputs.update({(1, 0): False, (1, 1): True})
        module.coils.update({(1, 0): False})
        self._module = module
        self._spoils = iter(spoils)
        self.may_be_open = False

    def __call__(self, request: bytes) -> bytes | None:
        spoil = next(self._spoils, None)
        sent = spoil(request, self._module.answer(request)) if spoil else None
        says_open = (bits_reply(request, bytes((bits,))) for bits in range(1, 256, 2))
        if request[7] == 2 and sent and any(reply in sent for reply in says_open):
            self.may_be_open = True
        return sent


def _attempt(step: Callable[[], object], clock: Time) -> object:
    clock.now += 60.0
    try:
        return step()
    except DriverError:
        return None


@settings(
    max_examples=examples(250),
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(spoils=st.lists(SPOILS, min_size=1, max_size=6), hangs_up=st.booleans())
def test_no_bytes_at_all_break_the_driver_or_open_the_door(
    one_module: Module, spoils: list[Spoil], hangs_up: bool
) -> None:
    one_module.hangs_up = hangs_up
    spoiled = Spoiled(one_module, spoils)
    one_module.reply = spoiled
    clock = Time()
    bus = bus_to(one_module.port, clock, timeout_s=0.02, retries=0)
    door: DryContactDoor = create("door", DOOR, bus)
    _attempt(door.open, clock)
    for _ in range(2):
        sample = _attempt(door.read, clock)
        opened = getattr(sample, "opened", False)
        assert opened is False or spoiled.may_be_open
        _attempt(lambda: door.write(DoorOutputs(hold_open=True)), clock)
    _attempt(door.make_safe, clock)
    door.close()
    bus.close()


FRAMES = BYTES.map(lambda begin: begin[:30])
LINE_SPOILS: st.SearchStrategy[Spoil] = st.one_of(
    BYTES.map(lambda junk: lambda request, good: junk),
    BYTES.map(lambda junk: lambda request, good: junk + good),
    BYTES.map(lambda junk: lambda request, good: good + junk),
    FRAMES.map(lambda frame: lambda request, good: frame + crc(frame)),
    FRAMES.map(lambda rest: lambda request, good: request[:2] + rest + crc(request[:2] + rest)),
    FRAMES.map(lambda rest: lambda request, good: request[:1] + rest + crc(request[:1] + rest)),
    st.integers(0, 8).map(lambda kept: lambda request, good: good[:kept]),
    st.tuples(st.integers(0, 20), st.integers(1, 255)).map(
        lambda drawn: lambda request, good: _flipped(good, *drawn)
    ),
    st.just(lambda request, good: request + good),
    st.just(lambda request, good: good),
)
SAYS_OPEN = [rtu(f"010201{bits:02x}") for bits in range(1, 256, 2)]


@pytest.fixture(scope="module")
def one_line() -> Iterator[SerialModule]:
    line = SerialModule()
    yield line
    line.close()


class SpoiledLine:
    """A module's replies about a closed door on a serial line. The functions in `spoils` spoil the
    replies in turn, again and again."""

    def __init__(self, line: SerialModule, spoils: list[Spoil]) -> None:
        line.inputs.update({(1, 0): False, (1, 1): True})
        line.coils.update({(1, 0): False})
        self._line = line
        self._spoils = itertools.cycle(spoils)
        self.may_be_open = False

    def __call__(self, frame: bytes) -> bytes:
        good = self._line.answer(b"\0\0\0\0\0\6" + frame[:-2])[6:]
        sent = next(self._spoils)(frame, good + crc(good)) or b""
        if frame[1] == 2 and any(reply in sent for reply in SAYS_OPEN):
            self.may_be_open = True
        return sent


@settings(
    max_examples=examples(150),
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(spoils=st.lists(LINE_SPOILS, min_size=1, max_size=5), ignore_echo=st.booleans())
def test_no_bytes_on_a_line_break_the_driver_or_open_the_door(
    one_line: SerialModule, spoils: list[Spoil], ignore_echo: bool
) -> None:
    spoiled = SpoiledLine(one_line, spoils)
    one_line.on_wire = spoiled
    clock = Time()
    bus = bus_to(one_line.port, clock, timeout_s=0.01, retries=1, ignore_echo=ignore_echo)
    door: DryContactDoor = create("door", DOOR, bus)

    def step(work: Callable[[], object]) -> object:
        while bus._wire.owes(1):
            bus._wire.begin(1)
        return _attempt(work, clock)

    step(door.open)
    for _ in range(2):
        sample = step(door.read)
        assert getattr(sample, "opened", False) is False or spoiled.may_be_open
        step(lambda: door.write(DoorOutputs(hold_open=True)))
    step(door.make_safe)
    door.close()
    bus.close()


SORTS = pytest.mark.parametrize("sort", [Module, SerialModule])
PDUS = st.one_of(*(st.binary(max_size=8).map(b.__add__) for b in (b"", b"\3\2", b"\5")))


@contextmanager
def saying(sort: type[Module], pdu: bytes) -> Iterator[tuple[Module, ModbusBus]]:
    """Yield a module that answers every request with this PDU, and a bus to the module."""
    module = sort(lambda request: frame(request, pdu))
    bus = bus_to(module.port, timeout_s=0.02, retries=1)
    try:
        yield module, bus
    finally:
        bus.close()
        module.close()


@SORTS
@settings(max_examples=examples(150))
@given(pdu=PDUS)
@example(pdu=b"\3\2\xab\xcd")
@example(pdu=b"\3\2\xab\xcd" + crc(b"\1\3\2\xab\xcd")[:1])
def test_a_register_reads_as_what_was_sent_or_not_at_all(sort: type[Module], pdu: bytes) -> None:
    register = Point(1, "holding register", 0)
    with saying(sort, pdu) as (_, bus), suppress(HalError):
        assert bus.cells([register]) == {register: int.from_bytes(pdu[2:4], "big")}
        good = b"\x01\x03\x02" + pdu[2:4]
        if sort is Module:
            assert b"\x01" + pdu == good
        else:  # the driver may read a complete frame with its CRC, and ignore noise behind it
            assert (b"\x01" + pdu + crc(b"\x01" + pdu)).startswith(good + crc(good))


@SORTS
@settings(max_examples=examples(100))
@given(pdu=PDUS)
@example(pdu=bytes.fromhex("0502000007"))
def test_a_pulse_is_requested_once_and_only_its_echo_proves_it(
    sort: type[Module], pdu: bytes
) -> None:
    asked: list[bytes] = []

    def connected() -> bool:
        with saying(sort, pdu) as (module, bus):
            try:
                bus.flash(Point(1, "coil", 0x200), 0.7)
                assert pdu.hex() == "0502000007"
            except HalError as error:
                if "no Modbus TCP connection" in str(error):  # a busy machine may be too slow
                    return False
            wait_until(lambda: module.asked, "the module has received the request")
            asked.extend(module.asked)
        return True

    wait_until(connected, "the bus is connected")
    assert len(asked) == 1

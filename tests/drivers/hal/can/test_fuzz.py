"""Drivers and arbitrary frames. A driver raises only DriverErrors, and never reads noise as a
charge."""

from collections.abc import Callable

import can
import msgspec
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample
from drivers import DriverError
from drivers.charger import can_frames as charger_can_frames
from drivers.charger import canopen as charger_canopen
from tests.depth import examples
from tests.drivers.hal.can.far_end import Reactive

OFF, ON, LEFT = (ChargerOutputs(power, range_checks=1) for power in (False, True, None))
STATUS = 0x18FF50E5
SERIAL = 0x1FFD0001


def attempt(far: Reactive, step: Callable[[], object]) -> object:
    """Wait for all pauses, run the step, and return its result, or None after a DriverError."""
    far.now += 0.9
    try:
        return step()
    except DriverError:
        return None


def frame(frame_id: int, payload: bytes, extended: bool = False) -> can.Message:
    return can.Message(arbitration_id=frame_id, is_extended_id=extended, data=payload)


payloads = st.binary(max_size=8)
ids = st.one_of(
    st.sampled_from([0x58A, 0x70A, 0x60A, 0x58B, 0x000]).map(lambda i: (i, False)),
    st.sampled_from([STATUS, SERIAL, 0x1FFD1204, 0x1806E5F4]).map(lambda i: (i, True)),
    st.integers(0, 0x7FF).map(lambda i: (i, False)),
    st.integers(0, 0x1FFF_FFFF).map(lambda i: (i, True)),
)
data_frames = st.builds(lambda i, payload: frame(i[0], payload, i[1]), ids, payloads)
odd_frames = st.builds(
    lambda i, remote, dlc: can.Message(
        arbitration_id=i[0],
        is_extended_id=i[1],
        is_remote_frame=remote,
        is_error_frame=not remote,
        dlc=dlc,
        data=None if remote else bytes(dlc),
    ),
    ids,
    st.booleans(),
    st.integers(0, 8),
)
frames = st.lists(st.one_of(data_frames, data_frames, odd_frames), max_size=12)


# ---- makers' frames

WIFERION = msgspec.convert(
    {"profile": "wiferion", "setpoints": {"max_volts": 29.4, "volts": 29.2, "amps": 30}},
    charger_can_frames.FrameChargerSettings,
)


def says_charging(message: can.Message) -> bool:
    """Return whether this is a complete status frame whose number means charging."""
    plain = not (message.is_error_frame or message.is_remote_frame)
    status = message.arbitration_id == STATUS and message.is_extended_id and len(message.data) == 8
    return plain and status and message.data[7] & 0x0F in (1, 2, 3, 4, 5)


@settings(max_examples=examples(400))
@example([frame(STATUS, bytes(7) + b"\5", True), frame(SERIAL, bytes(8), True)])
@example([frame(STATUS, bytes(6) + b"\5", True), frame(SERIAL, bytes(8), True)])
@given(frames)
def test_no_frames_break_the_driver_of_makers_frames_or_fake_a_charge(
    sent: list[can.Message],
) -> None:
    far = Reactive()
    bus = far.bus()
    driver = charger_can_frames.create("c", WIFERION, bus)
    attempt(far, driver.open)
    attempt(far, bus.take)
    for message in sent:
        far.coming.append(message)
        far.coming.append(frame(SERIAL, bytes(8), True))
        sample = attempt(far, driver.read)
        for outputs in (ON, LEFT, OFF):
            attempt(far, lambda power=outputs: driver.write(power))  # type: ignore[misc]
        if isinstance(sample, ChargerSample) and sample.activity is Activity.CHARGING:
            assert any(map(says_charging, sent))
    attempt(far, driver.make_safe)
    driver.close()
    bus.close()


def test_every_number_of_a_status_frame_has_a_meaning() -> None:
    found: dict[Activity, set[int]] = {}
    for code in range(256):
        far = Reactive()
        bus = far.bus()
        driver = charger_can_frames.create("c", WIFERION, bus)
        bus.take()
        far.coming.append(frame(SERIAL, bytes(8), True))
        far.coming.append(frame(STATUS, bytes(7) + bytes((code,)), True))
        sample = driver.read()
        found.setdefault(sample.activity, set()).add(code & 0x0F)
        bus.close()
    assert found == {
        Activity.IDLE: {0, 7},
        Activity.CHARGING: {1, 2, 3, 4, 5},
        Activity.RELEASED: {6},
        Activity.ERROR: {8},
        Activity.UNKNOWN: set(range(9, 16)),
    }


# ---- CANopen

RCU = charger_canopen.CanOpenChargerSettings(node=10)
STATE_5 = bytes.fromhex("02200a0500")


def good(request: can.Message) -> can.Message:
    """Return the answer of a healthy and idle RCU, which answers 0 to every question."""
    asked = bytes(request.data)
    command = 0x4B if asked[0] == 0x40 else 0x60
    return frame(0x58A, bytes((command,)) + asked[1:4] + bytes(4))


spoils = st.one_of(
    st.just(lambda reply: [reply]),
    st.just(lambda reply: []),
    st.just(lambda reply: [frame(0x58A, bytes(reply.data)[:4] + b"\5\0\0\0")]),
    st.just(lambda reply: [frame(0x58A, b"\x4b\x02\x20\x07\5\0\0\0")]),
    st.just(lambda reply: [reply, reply]),
    frames.map(lambda others: lambda reply: others),
    frames.map(lambda others: lambda reply: [*others, reply]),
    payloads.map(lambda junk: lambda reply: [frame(0x58A, junk), reply]),
    payloads.map(lambda junk: lambda reply: [frame(0x58A, bytes(reply.data)[:4] + junk[:4])]),
    payloads.map(lambda junk: lambda reply: [frame(0x58A, junk[:1] + bytes(reply.data)[1:])]),
    st.integers(0, 7).map(lambda n: lambda reply: [frame(0x58A, bytes(reply.data)[:n])]),
)


@settings(max_examples=examples(400))
@given(st.lists(spoils, min_size=1, max_size=8), frames)
def test_no_answers_break_the_canopen_driver_or_fake_a_charge(
    spoiled: list[Callable[[can.Message], list[can.Message]]], between: list[can.Message]
) -> None:
    far, sent, turns = Reactive(), list[can.Message](), 0

    def react(request: can.Message) -> list[can.Message]:
        nonlocal turns
        turns += 1
        answers = spoiled[turns % len(spoiled)](good(request))
        sent.extend(answers)
        return answers

    far.react = react
    bus = far.bus()
    driver = charger_canopen.create("c", RCU, bus)
    attempt(far, driver.open)
    for message in [*between, frame(0x70A, b"\5"), frame(0x70A, b"\5")]:
        far.coming.append(message)
        far.coming.append(frame(0x70A, b"\5"))
        sample = attempt(far, driver.read)
        for outputs in (ON, LEFT, OFF):
            attempt(far, lambda power=outputs: driver.write(power))  # type: ignore[misc]
        if isinstance(sample, ChargerSample) and sample.activity is Activity.CHARGING:
            assert any(bytes(one.data)[1:6] == STATE_5 for one in sent)
    attempt(far, driver.make_safe)
    driver.close()
    bus.close()

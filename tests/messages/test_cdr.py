import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridges.messages import definitions as d
from bridges.messages.cdr import LONGEST, LONGEST_FLAT, CdrError, decode, encode
from tests.transports.values import MESSAGE_TYPES, repeatable, values

REQUEST = d.LiftRequest("Lift1", d.Time(5, 6), "fleet/robot", 1, "L3", 2)
REQUEST_BYTES = bytes.fromhex(
    "00010000"
    "06000000 4c696674 3100"  # "Lift1"
    "0000 05000000 06000000"  # aligned to 4
    "0c000000 666c6565 742f726f 626f7400"  # "fleet/robot"
    "01 000000 03000000 4c3300"
    "02"
)
MESSAGES = st.sampled_from(MESSAGE_TYPES).flatmap(values)


def _fleet(robots: int, places: int) -> d.FleetState:
    ahead = tuple(d.Location(level_name="Level 10 (north wing)", index=n) for n in range(places))
    robot = d.RobotState(
        name="hospital_delivery_robot_017",
        model="TinyRobot-Extended-2",
        task_id="compose.dispatch-17-0123456789abcdef0123456789abcdef",
        location=ahead[0],
        path=ahead,
    )
    return d.FleetState("hospital_fleet", (robot,) * robots)


def test_a_fleet_state_with_two_hundred_robots_is_read_but_a_longer_message_is_not() -> None:
    legal = _fleet(200, 50)
    sample = encode(d.FleetState, legal)
    assert len(sample) < 0.7 * LONGEST
    assert decode(d.FleetState, sample) == legal
    with pytest.raises(CdrError, match="bytes long"):
        decode(d.FleetState, encode(d.FleetState, _fleet(400, 50)))


def test_a_request_and_a_state_are_short() -> None:
    names = "x" * (LONGEST_FLAT - 100)
    assert decode(d.LiftRequest, encode(d.LiftRequest, d.LiftRequest(names))).lift_name == names
    with pytest.raises(CdrError, match="bytes long"):
        decode(d.LiftRequest, encode(d.LiftRequest, d.LiftRequest(names + "x" * 100)))


def test_a_request_has_exactly_these_bytes() -> None:
    assert encode(d.LiftRequest, REQUEST) == REQUEST_BYTES
    assert decode(d.LiftRequest, REQUEST_BYTES) == REQUEST


@repeatable
@given(MESSAGES)
def test_every_message_is_decoded_to_the_same_message(message: Any) -> None:
    assert decode(type(message), encode(type(message), message)) == message


@pytest.mark.dds
@pytest.mark.parametrize("message_type", MESSAGE_TYPES, ids=lambda kind: kind.__name__)
def test_cyclonedds_itself_writes_the_same_bytes(message_type: Any) -> None:
    from tests.transports import idl_types

    @repeatable
    @given(values(message_type))
    def check_written_alike(message: Any) -> None:
        theirs = idl_types.to_idl(message).serialize(use_version_2=False)
        assert encode(message_type, message) == theirs

    check_written_alike()


def test_the_other_byte_order_is_read_too() -> None:
    big = b"\x00\x00\x00\x00" + struct.pack(">iI", -5, 4_000_000_000)
    assert decode(d.Time, big) == d.Time(-5, 4_000_000_000)


@repeatable
@given(MESSAGES, st.data())
def test_a_truncated_sample_is_refused(message: Any, data: st.DataObject) -> None:
    sample = encode(type(message), message)
    length = data.draw(st.integers(0, len(sample) - 1))
    with pytest.raises(CdrError):
        decode(type(message), sample[:length])


@repeatable
@given(st.sampled_from(MESSAGE_TYPES), st.binary(max_size=80), st.booleans())
def test_any_bytes_become_a_message_or_are_refused(kind: Any, body: bytes, little: bool) -> None:
    try:
        message = decode(kind, bytes([0, little, 0, 0]) + body)
    except CdrError:
        return
    again = encode(kind, message)  # compare bytes, because NaN is not equal to NaN
    assert encode(kind, decode(kind, again)) == again


@pytest.mark.parametrize(
    ("kind", "sample", "refused"),
    [
        (d.Bool, b"", "not plain CDR: the sample begins with nothing"),
        (d.Bool, b"\0\x07\0\0\x01", "not plain CDR: the sample begins with 00 07 00 00"),
        (d.Bool, b"\0\x01\0\0\x02", "2 is not a bool"),
        (d.Bool, b"\0\x01\0\0\x01" + b"\0" * 4, "9 bytes, where Bool takes 5"),
        (d.ChargerCancel, b"\0\x01\0\0" + b"\x02\0\0\0\xff\0", "a string is not UTF-8"),
        (d.ChargerCancel, b"\0\x01\0\0" + b"\x00\0\0\0", "does not end with its only NUL"),
        (d.ChargerCancel, b"\0\x01\0\0" + b"\x03\0\0\0\0a\0", "does not end with its only NUL"),
        (d.ChargerCancel, b"\0\x01\0\0" + b"\x02\0\0\0ab", "does not end with its only NUL"),
        (d.ChargerCancel, b"\0\x01\0\0" + b"\xff\xff\xff\xffab\0", "with its only NUL"),
        (d.EmergencySignal, b"\0\x01\0\0" + b"\xff\xff\xff\xff\0", "a sequence of 4294967295"),
    ],
)
def test_the_refusal_names_the_mistake_in_a_sample(kind: Any, sample: bytes, refused: str) -> None:
    with pytest.raises(CdrError, match=refused):
        decode(kind, sample)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (d.LiftRequest, d.LiftRequest(request_type=256)),
        (d.LiftRequest, d.LiftRequest(lift_name=None)),  # type: ignore[arg-type]
        (d.Time, d.Time(2**31, 0)),
        (d.Time, d.Time(0, -1)),
        (d.Bool, d.Bool(1)),  # type: ignore[arg-type]
        (d.DoorState, d.LiftState()),
    ],
)
def test_values_that_do_not_fit_a_message_are_not_sent(kind: Any, message: Any) -> None:
    with pytest.raises(CdrError, match=f"cannot be sent as {kind.__name__}"):
        encode(kind, message)


def test_a_text_that_cannot_be_encoded_does_not_stop_the_state() -> None:
    sent = d.ChargerState(error_message="lost\0 \ud800")
    assert decode(d.ChargerState, encode(d.ChargerState, sent)) == d.ChargerState(
        error_message="lost? ?"
    )

"""Bad input from a broker or a device. Each sort has its own error, and the bus never trusts bad
input."""

import socket
import threading
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.hal import HalError
from drivers.hal.mqtt import MqttBus
from drivers.hal.mqtt.points import MqttPoint
from hal_fakes.mosquitto import Mosquitto
from tests.depth import examples
from tests.drivers.hal.mqtt.broker import RELAY, STATE, SWITCH, FarDevice, bus_to, hears, reason
from tests.waiting import wait_until


@pytest.fixture
def broker() -> Iterator[Mosquitto]:
    broker = Mosquitto()
    yield broker
    broker.close()


def point(**keys: Any) -> MqttPoint:
    return msgspec.convert({"topic": STATE, "stale_after_s": 5, **keys}, MqttPoint)


def fault(found: MqttPoint, payload: bytes) -> str:
    """Decode this payload with this point. Return the text of the error, or "" if decoding succeeds."""
    try:
        found.asserted(payload)
    except HalError as error:
        return str(error)
    return ""


# ---- payloads


@pytest.mark.parametrize(
    ("payload", "text"),
    [
        (b"1", "'payload' is 1, and true or false is expected"),
        (b'"true"', "'payload' is 'true', and true or false is expected"),
        (b"NaN", "'payload' is 'NaN', and true or false is expected"),
        (b"null", "'payload' is null, and true or false is expected"),
        (b"", "'payload' is '', and true or false is expected"),
        (b"[true]", "'payload' is [true], and true or false is expected"),
        (b"\xff\xfe\x00", "'payload' is '��\\x00', and true or false is expected"),
    ],
)
def test_a_payload_of_a_wrong_type_is_a_fault(payload: bytes, text: str) -> None:
    found = fault(point(), payload)
    assert found.replace("[True]", "[true]") == f"relay/state: {text}"


@pytest.mark.parametrize(
    ("payload", "text"),
    [
        (b"on", "is no JSON: "),
        (b'{"output": NaN}', "is no JSON: NaN is not JSON"),
        (b'{"output": true, "output": false}', "is no JSON: a key occurs twice in one object"),
        (b"[" * 100_000, "is no JSON: it is nested too deeply"),
        (b"true", "'payload' is true, and a JSON object is expected"),
        (b'{"other": true}', "the answer has no 'output'; it has other"),
        (b'{"output": 1}', "'output' is 1, and true or false is expected"),
        (b'{"output": null}', "'output' is null, and true or false is expected"),
    ],
)
def test_a_json_payload_without_the_field_is_a_fault(payload: bytes, text: str) -> None:
    assert fault(point(field="output"), payload).startswith(f"relay/state: {text}")


def test_a_word_that_is_neither_on_nor_off_is_a_fault() -> None:
    words = point(when=["ON", 1], when_not=["OFF", 0])
    assert [words.asserted(b) for b in (b"ON", b"1", b"OFF", b"0", b'"OFF"')] == [
        *(True, True),
        *(False, False, False),
    ]
    assert fault(words, b"on") == (
        "relay/state: 'payload' is 'on', and 'ON' or 1 or 'OFF' or 0 is expected"
    )
    assert fault(words, b"true").endswith(
        "'payload' is true, and 'ON' or 1 or 'OFF' or 0 is expected"
    )


@settings(max_examples=examples(300))
@given(st.binary(max_size=64) | st.text(max_size=64).map(str.encode))
def test_any_payload_is_a_level_or_a_fault(payload: bytes) -> None:
    for found in (point(), point(field="a.b"), point(when=["ON"], when_not=[0])):
        fault(found, payload)


# ---- sizes

TOO_LONG = "the broker sent a message of 10000013 bytes; the limit is 262144"


@pytest.mark.parametrize("version", ["5", "3.1.1"])
def test_a_payload_of_10_mb_is_never_a_fact_and_never_kept(broker: Mosquitto, version: str) -> None:
    device = FarDevice(broker.port)
    with bus_to(broker.port, version=version) as bus:
        bus.listen(STATE)
        link = bus.up()
        device.says(STATE, b"1" * 10_000_000)
        if version == "3.1.1":
            wait_until(lambda: link.failure, "the end of the connection")
            assert link.failure == TOO_LONG
        else:
            bus.listen("last")
            wait_until(lambda: _said(device, bus), "a live message")
            assert "no message has come on relay/state" in reason(bus, STATE)
            assert link.failure == "", "the broker has held the packet back"
    device.close()


def _said(device: FarDevice, bus: MqttBus) -> bool:
    device.says("last", "1")
    return not reason(bus, "last")


def test_a_payload_that_fits_into_a_packet_but_is_too_long_is_named(broker: Mosquitto) -> None:
    device = FarDevice(broker.port)
    with bus_to(broker.port) as bus:
        bus.listen(STATE)
        bus.up()
        device.says(STATE, b"1" * (256 * 1024 + 500))
        wait_until(lambda: "too long" in reason(bus, STATE), "the fault")
        assert reason(bus, STATE) == "the message on relay/state is too long: 262644 bytes"
    device.close()


def test_payloads_together_are_kept_up_to_a_limit(broker: Mosquitto) -> None:
    device = FarDevice(broker.port)
    with bus_to(broker.port) as bus:
        for n in range(40):
            bus.listen(f"long/{n}")
        bus.up()
        for n in range(40):
            device.says(f"long/{n}", b"1" * 200_000)
        wait_until(lambda: bus.heard("long/39"), "the last message")
        kept = sum(len(heard.payload) for n in range(40) if (heard := bus.heard(f"long/{n}")))
        assert kept <= 4 * 1024 * 1024 + 200_000
        assert "too long" in reason(bus, "long/39")
        device.says("long/0", b"")
        wait_until(lambda: reason(bus, "long/0") == "", "a short message")
        for n in range(30):
            device.says(f"long/{n}", b"")
        device.says("long/39", b"1")
        wait_until(lambda: reason(bus, "long/39") == "", "a short message after long ones")
    device.close()


def test_ten_thousand_topics_that_nobody_asked_for_leave_nothing(broker: Mosquitto) -> None:
    device = FarDevice(broker.port)
    with bus_to(broker.port) as bus:
        bus.listen(STATE)
        bus.up()
        for n in range(10_000):
            device.client.publish(f"relay/{n}", b"ON")
        device.says(STATE, "ON")
        assert hears(bus, STATE) == b"ON"
        assert list(bus._heard) == [STATE]
    device.close()


# ---- a server that is not an MQTT broker


@settings(max_examples=examples(40), deadline=None)
@given(st.binary(min_size=1, max_size=60))
def test_a_server_that_speaks_anything_is_an_error_by_its_name(noise: bytes) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def talk() -> None:
            caller, _ = server.accept()
            with caller:
                caller.recv(1000)
                caller.sendall(noise)

        thread = threading.Thread(target=talk)
        thread.start()
        with bus_to(server.getsockname()[1]) as bus, pytest.raises(HalError):
            bus.up()
        thread.join()


def test_an_old_session_that_the_broker_has_kept_is_refused() -> None:
    """The bus asks for a clean start. So a CONNACK with "session present" (MQTT 5.0, 3.2.2.1.1) is
    invalid."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def talk() -> None:
            caller, _ = server.accept()
            with caller:
                caller.recv(1000)
                caller.sendall(b"\x20\x03\x01\x00\x00")
                caller.recv(1000)

        thread = threading.Thread(target=talk)
        thread.start()
        with (
            bus_to(server.getsockname()[1]) as bus,
            pytest.raises(HalError, match="the broker has kept an old session"),
        ):
            bus.up()
        thread.join()


def test_a_broker_that_never_answers_is_an_error_within_the_timeout() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        bus_to(server.getsockname()[1], timeout_s=0.2) as bus,
        pytest.raises(HalError, match=r"the broker does not answer within 0\.2 s"),
    ):
        bus.up()


def test_a_retained_lie_moves_no_relay_and_is_not_told(broker: Mosquitto) -> None:
    device = FarDevice(broker.port, SWITCH)
    device.says(STATE, "ON", retain=True)
    with bus_to(broker.port, {"relay": RELAY}, timeout_s=0.3) as bus:
        lines = bus.lines({"relay": None}, {"relay": False})
        for step in (lines.claim, lines.read):
            with pytest.raises(HalError, match="there is a retained message, of unknown age: 'ON'"):
                step()
        assert [message[1] for message in device.taken] == [b"OFF"]
    device.close()

"""The `mqtt` bus with a real broker, which the tests kill, freeze and restart."""

import gc
import itertools
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from paho.mqtt.client import MQTTMessage

from drivers.hal import HalError
from drivers.hal.mqtt import MqttBus
from drivers.hal.mqtt.bus import open_bus
from drivers.hal.mqtt.link import Link
from hal_fakes.mosquitto import Mosquitto
from tests.drivers.hal.mqtt.broker import STATE, SWITCH, FarDevice, bus_to, hears, reason, settings
from tests.waiting import wait_until

VERSIONS = ["5", "3.1.1"]


@pytest.fixture
def broker() -> Iterator[Mosquitto]:
    broker = Mosquitto()
    yield broker
    broker.close()


@pytest.fixture
def device(broker: Mosquitto) -> Iterator[FarDevice]:
    device = FarDevice(broker.port, SWITCH)
    yield device
    device.close()


@pytest.fixture(params=VERSIONS)
def version(request: pytest.FixtureRequest) -> str:
    return str(request.param)


# ---- the lookup of the broker's name


def test_no_second_attempt_begins_during_a_slow_lookup_and_a_link_that_was_given_up_sends_nothing(
    broker: Mosquitto, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The broker would end the good connection, because both have the same client's id."""
    look_up, asked, answered = socket.getaddrinfo, list[object](), threading.Event()

    def lookup(host: object, *given: Any, **more: Any) -> Any:
        asked.append(host)
        answered.wait()
        return look_up("127.0.0.1", *given, **more)

    monkeypatch.setattr(socket, "getaddrinfo", lookup)
    clock = itertools.count(0.0, 60.0).__next__  # no pause is left at the next attempt
    names: dict[str, Any] = {"host": "broker.site", "client_id": "lift1", "timeout_s": 0.2}
    with bus_to(broker.port, clock=clock, **names) as bus:
        for text in ("does not answer within 0.2 s", "has not ended yet"):
            with pytest.raises(HalError, match=text):
                bus.up()
        first = bus._link
        assert first is not None
        answered.set()
        first.join()
        assert (first.up, first._client.is_connected(), asked) == (False, False, ["broker.site"])
        wait_until(lambda: _is_up(bus), "the next attempt reaches the broker")


def _is_up(bus: MqttBus) -> bool:
    try:
        return bus.up().up
    except HalError:
        return False


# ---- which messages the bus trusts


def test_a_live_message_is_a_fact_and_has_an_age(
    broker: Mosquitto, device: FarDevice, version: str
) -> None:
    now = itertools.count(100.0, 10.0)
    with bus_to(broker.port, version=version) as bus:
        bus.listen(STATE)
        bus.up()
        device.says(STATE, "ON")
        assert hears(bus, STATE) == b"ON"
        bus.now = lambda: next(now) + 1e6
        assert "more than stale_after_s (5 s)" in reason(bus, STATE, 5.0)


def test_a_retained_message_is_no_fact_until_a_live_one_comes(
    broker: Mosquitto, device: FarDevice, version: str
) -> None:
    device.says(STATE, "ON", retain=True)
    with bus_to(broker.port, version=version) as bus:
        bus.listen(STATE)
        bus.up()
        wait_until(lambda: bus.heard(STATE), "the retained message")
        assert reason(bus, STATE) == (
            "no message has come on relay/state since the connection began;"
            " there is a retained message, of unknown age: 'ON'"
        )
        device.says(STATE, "OFF", retain=True)
        assert hears(bus, STATE) == b"OFF"


def test_what_was_heard_before_the_broker_went_is_forgotten(
    broker: Mosquitto, device: FarDevice
) -> None:
    with bus_to(broker.port) as bus:
        bus.listen(STATE)
        bus.up()
        device.says(STATE, "ON")
        hears(bus, STATE)
        broker.kill()
        wait_until(lambda: "refuses the connection" in reason(bus, STATE), "the broker is missed")
        broker.start()
        bus.insist()
        wait_until(
            lambda: "since the connection began" in reason(bus, STATE),
            "a connection with nothing heard",
        )


def test_every_message_reaches_a_driver_that_takes_them(
    broker: Mosquitto, device: FarDevice
) -> None:
    taken: list[bytes] = []
    with bus_to(broker.port) as bus:
        bus.listen(STATE, lambda heard: taken.append(heard.payload))
        bus.up()
        said = [str(n).encode() for n in range(50)]
        for payload in said:
            device.says(STATE, payload)
        wait_until(lambda: len(taken) == 50, "all messages")
        assert taken == said


def test_a_changed_state_wakes_the_bus_and_a_repeated_one_does_not(
    broker: Mosquitto, device: FarDevice
) -> None:
    woken: list[None] = []
    with bus_to(broker.port) as bus:
        bus.on_edge(lambda: woken.append(None))
        for topic in (STATE, "last"):
            bus.listen(topic)
        bus.up()
        for payload in ("ON", "ON", "ON", "OFF"):
            device.says(STATE, payload)
        device.says("last", "")
        hears(bus, "last")
        assert len(woken) == 3


# ---- commands


def test_a_command_reaches_the_device_once_and_is_not_retained(
    broker: Mosquitto, device: FarDevice, version: str
) -> None:
    with bus_to(broker.port, version=version) as bus:
        bus.publish(SWITCH, "ON")
        bus.publish(SWITCH, "OFF", safe=True)
        wait_until(lambda: len(device.taken) == 2, "both commands")
    assert device.taken == [(SWITCH, b"ON", False), (SWITCH, b"OFF", False)]
    late = FarDevice(broker.port, SWITCH)
    late.says("nothing", "a mark")  # a retained command would arrive before this message
    wait_until(lambda: late.taken, "the mark")
    late.close()
    assert late.taken == [("nothing", b"a mark", False)]


def test_a_command_that_no_device_receives_is_an_error(broker: Mosquitto) -> None:
    with bus_to(broker.port) as bus, pytest.raises(HalError, match="no device listens there"):
        bus.publish("nobody/set", "ON")


RELAYS = 60
"""The number of devices for which the broker keeps a session.

The broker delivers a stored message only once. So each device can answer only one question of the test.
"""


def test_on_expires_for_a_device_that_returns_later_and_off_does_not(broker: Mosquitto) -> None:
    def relay(number: int) -> FarDevice:
        options: dict[str, Any] = {"client_id": f"relay {number}", "clean_session": False}
        return FarDevice(broker.port, SWITCH, **options)

    for number in range(RELAYS):
        relay(number).close()
    with bus_to(broker.port) as bus:
        bus.publish(SWITCH, "ON", expires_s=1)
        bus.publish(SWITCH, "OFF", safe=True)
    returning = iter(range(RELAYS))

    def expired() -> bool:
        device = relay(next(returning))
        wait_until(lambda: (SWITCH, b"OFF", False) in device.taken, "the command to switch off")
        device.close()
        return (SWITCH, b"ON", False) not in device.taken

    wait_until(expired, "the broker has dropped 'on'")


def test_no_command_of_an_earlier_connection_is_sent_again(
    broker: Mosquitto, device: FarDevice, version: str
) -> None:
    with bus_to(broker.port, version=version, timeout_s=0.3) as bus:
        bus.up()
        broker.freeze()
        with pytest.raises(HalError, match="does not confirm"):
            bus.publish(SWITCH, "ON")
        broker.kill()
        broker.start()
        later = FarDevice(broker.port, SWITCH)
        bus.insist()
        wait_until(lambda: _sent(bus, "OFF"), "the command to the new broker")
        wait_until(lambda: later.taken, "a command")
        later.close()
        assert later.taken == [(SWITCH, b"OFF", False)]


def _sent(bus: MqttBus, payload: str) -> bool:
    try:
        bus.publish(SWITCH, payload)
    except HalError:
        return False
    return True


# ---- the connection


def test_a_lost_broker_costs_one_attempt_and_then_fails_at_once(broker: Mosquitto) -> None:
    with bus_to(broker.port, clock=lambda: 0.0) as bus:
        broker.kill()
        for _ in range(3):
            with pytest.raises(HalError, match="refuses the connection: is the broker running"):
                bus.up()
        assert bus.calls == 1


def test_the_backoff_of_a_failed_reading_does_not_delay_switching_off(broker: Mosquitto) -> None:
    broker.kill()
    with bus_to(broker.port, clock=lambda: 0.0) as bus:
        with pytest.raises(HalError):
            bus.up()
        broker.start()
        with pytest.raises(HalError):
            bus.up()
        assert bus.up(safe=True).up


def test_a_frozen_broker_is_noticed_by_its_silence(broker: Mosquitto) -> None:
    with bus_to(broker.port, keepalive_s=1) as bus:
        bus.listen(STATE)
        link = bus.up()
        broker.freeze()
        wait_until(lambda: link.failure, "the broker's silence")


def test_what_an_ended_connection_still_delivers_is_dropped() -> None:
    taken: list[str] = []
    link = Link(settings(1883), [], lambda topic, payload, retained: taken.append(topic))
    message = MQTTMessage(topic=STATE.encode())
    link._on_message(None, None, message)
    link.close()
    link._on_message(None, None, message)
    assert taken == [STATE]


def test_a_flapping_broker_leaves_no_file_open(broker: Mosquitto) -> None:
    """The garbage collector may come only after the last free descriptor is in use."""

    def answers() -> bool:
        bus.insist()
        try:
            return bus.up() is not None
        except HalError:
            return False

    def files() -> int:
        return len(os.listdir("/proc/self/fd"))

    gc.disable()
    try:
        with bus_to(broker.port) as bus:
            assert answers()
            before = files()
            for _ in range(5):
                broker.kill()
                wait_until(lambda: not answers(), "the broker is missed")
                broker.start()
                wait_until(answers, "the broker is back")
            wait_until(lambda: files() == before, "no file of an earlier connection is open")
    finally:
        gc.enable()


def test_a_connection_is_without_delay(broker: Mosquitto) -> None:
    with bus_to(broker.port) as bus:
        sock = bus.up()._client.socket()
        assert isinstance(sock, socket.socket)
        assert sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_another_client_with_our_id_is_named(broker: Mosquitto) -> None:
    with (
        bus_to(broker.port, client_id="lift") as bus,
        bus_to(broker.port, client_id="lift") as other,
    ):
        link = bus.up()
        other.up()
        wait_until(lambda: link.failure, "the end of the first connection")
        assert link.failure in (
            "the broker has closed the connection: does another client have the id lift?",
            "the broker has ended the connection: session taken over",
        )


def test_without_paho_the_error_names_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "paho", None)
    with pytest.raises(HalError, match=r"paho-mqtt: run \.venv/bin/pip install"):
        open_bus(settings(1883))


def test_no_daemon_on_another_bus_loads_paho() -> None:
    program = (
        "import sys\n"
        "from pathlib import Path\n"
        "from bridges.settings.load import load\n"
        "for name in ('door_modbus', 'door_mqtt'):\n"
        "    config = load(Path(f'config/{name}.yaml'))\n"
        "    for bus in config.buses:\n"
        "        config.bus_type(bus).open_bus(config.buses[bus])\n"
        "assert not any(m.partition('.')[0] == 'paho' for m in sys.modules), 'loaded'\n"
    )
    root = Path(__file__).parents[4]
    subprocess.run([sys.executable, "-c", program], check=True, cwd=root)


def test_a_bus_has_a_limit_of_topics() -> None:
    bus_settings = settings(1883)
    with bus_to(bus_settings.port or 0) as bus:
        for n in range(512):
            bus.listen(f"topic/{n}")
        with pytest.raises(HalError, match="at most 512 topics"):
            bus.listen("topic/512")

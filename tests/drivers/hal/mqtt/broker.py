"""Tools for tests of the `mqtt` bus: a broker, a bus, and a device's client."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion

from drivers.hal import HalError
from drivers.hal.mqtt import MqttBus, MqttSettings
from hal_fakes.mosquitto import end
from tests.waiting import wait_until

STATE, SWITCH = "relay/state", "relay/set"
RELAY = {
    "topic": STATE,
    "when": ["ON"],
    "when_not": ["OFF"],
    "stale_after_s": 60,
    "command": {"topic": SWITCH, "payload_on": "ON", "payload_off": "OFF"},
    "switches_off_after_s": 60,
}


def settings(port: int, points: dict[str, Any] | None = None, **more: Any) -> MqttSettings:
    """Return the settings of a bus to a broker on this port."""
    plain = {"type": "mqtt", "host": "127.0.0.1", "port": port, "points": points or {}, **more}
    return msgspec.convert(plain, MqttSettings)


@contextmanager
def bus_to(
    port: int,
    points: dict[str, Any] | None = None,
    clock: Callable[[], float] = time.monotonic,
    **more: Any,
) -> Iterator[MqttBus]:
    """Yield a bus to a broker on this port."""
    bus = MqttBus(settings(port, points, **more), clock)
    try:
        yield bus
    finally:
        bus.close()


class FarDevice:
    """An MQTT client that plays a device. `taken` has (topic, payload, retained) of each received
    message."""

    def __init__(self, port: int, *topics: str, **options: Any) -> None:
        self.taken: list[tuple[str, bytes, bool]] = []
        self.ready = threading.Event()
        self.client = paho.Client(CallbackAPIVersion.VERSION2, **options)
        self.client.on_message = lambda _, __, m: self.taken.append(
            (m.topic, bytes(m.payload), m.retain)
        )
        self.client.on_subscribe = lambda *_: self.ready.set()
        self.client.connect("127.0.0.1", port)
        self.client.loop_start()
        self.client.subscribe([(topic, 1) for topic in (*topics, "nothing")])
        assert self.ready.wait(30)

    def says(self, topic: str, payload: bytes | str, retain: bool = False) -> None:
        """Publish a message, and wait until the broker has received it."""
        info = self.client.publish(topic, payload, qos=1, retain=retain)
        info.wait_for_publish(30)

    def close(self) -> None:
        """Disconnect from the broker."""
        self.client.disconnect()
        end(self.client)


def reason(bus: MqttBus, topic: str, stale_after_s: float = 60.0) -> str:
    """Return why the bus does not trust the topic's last message, or "" if the bus trusts it."""
    try:
        bus.fresh(topic, stale_after_s)
    except HalError as error:
        return str(error)
    return ""


def hears(bus: MqttBus, topic: str) -> bytes:
    """Wait until the bus trusts the topic's last message, and return the payload of that message."""
    wait_until(lambda: not reason(bus, topic), f"a live message on {topic}")
    return bus.fresh(topic, 60.0).payload

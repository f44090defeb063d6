"""The far side of an `mqtt` bus: a real broker on 127.0.0.1, and the devices that publish there.

One real MQTT client plays all devices. The devices publish a changed state at once. A device with the
YAML's `ask` also publishes its states when the daemon asks. A device without `ask` publishes its states
three times in each `stale_after_s`. A relay with a timer switches itself off. The order `fail DEVICE
unit|server MODE` lets one device (`unit`) or the broker (`server`) fail:

|        | off    | stuck              | slow           | garbage         | wrong               |
| unit   | silent | repeats its states | obeys too late | publishes noise | publishes `?`       |
| server | killed | frozen             | answers late   | is no broker    | has old states only |
"""

import contextlib
import json
import random
import socket
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, Protocol

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion

from drivers.hal.mqtt import MqttSettings
from drivers.hal.mqtt.points import MqttPoint
from drivers.hal.points import HalError
from hal_fakes.fake import Outside
from hal_fakes.json_answers import put
from hal_fakes.mosquitto import Mosquitto, end
from hal_fakes.plants.plant import FailureMode, Plant
from hal_fakes.vda5050 import FakeVdaRobot
from hal_fakes.vda_site import VdaSite
from hal_fakes.wiring import PlantWiring

PARTS: Final = ("server", "unit")
LOOK_S: Final = 0.02
READY_S: Final = 15.0
NEVER: Final = float("inf")


class MqttStation(Protocol):
    """A device with a plant behind it.

    `asks` gives for each topic the message that makes the device publish. `commands` gives for each
    topic and message the signal, and whether the message asserts the signal.
    """

    plant: Plant
    asks: Mapping[str, str]
    commands: Mapping[tuple[str, str], tuple[str, bool]]

    def obey(self, signal: str, asserted: bool) -> None:
        """Obey a command for this signal."""

    def echo(self, signal: str) -> str | None:
        """Return the topic on which the device publishes after each command for this signal, even if
        nothing changed."""

    def tick(self) -> None:
        """Switch off every relay whose timer has run out. The site calls `tick` often."""

    def states(self) -> dict[str, bytes]:
        """Return the payload of each state, by its topic."""


def serve(
    settings: MqttSettings, stations: Sequence[PlantWiring | MqttStation | FakeVdaRobot]
) -> "MqttSite | VdaSite":
    """Serve the devices of this bus behind a broker of their own."""
    robots = [each for each in stations if isinstance(each, FakeVdaRobot)]
    if robots:
        return VdaSite(settings, robots)
    return MqttSite(settings, [each for each in stations if not isinstance(each, FakeVdaRobot)])


class MqttDevice:
    """One device as a station. It has contacts, and relays that publish their states."""

    def __init__(self, wiring: PlantWiring, points: Mapping[str, MqttPoint]) -> None:
        self.plant = wiring.plant
        self._wiring = wiring
        self._points = {n: points[n] for n in (*wiring.inputs, *wiring.outputs)}
        self.asks: Mapping[str, str] = {
            p.ask.topic: p.ask.payload for p in self._points.values() if p.ask
        }
        self.commands: Mapping[tuple[str, str], tuple[str, bool]] = {
            (command.topic, payload): (name, on)
            for name in wiring.outputs
            if (command := self._points[name].command)
            for payload, on in ((command.payload_on, True), (command.payload_off, False))
        }
        self._on = dict.fromkeys(wiring.outputs, False)
        self._off_at = dict.fromkeys(wiring.outputs, NEVER)

    def obey(self, signal: str, asserted: bool) -> None:
        """Switch a relay, and restart its timer."""
        now, off_s = time.monotonic(), self._points[signal].switches_off_after_s
        self._on[signal] = asserted
        self._off_at[signal] = now + off_s if asserted and off_s else NEVER
        self._wiring.drive(signal, asserted, now)

    def echo(self, signal: str) -> str | None:
        """Return the relay's state topic."""
        return self._points[signal].topic

    def tick(self) -> None:
        """Switch off the relays whose timers have run out."""
        for name, at in self._off_at.items():
            if time.monotonic() >= at:
                self.obey(name, False)

    def states(self) -> dict[str, bytes]:
        """Return the payload of each state, by its topic."""
        levels = {**self._wiring.levels(time.monotonic()), **self._on}
        groups: dict[tuple[str, str], list[tuple[MqttPoint, bool]]] = {}
        for name, point in self._points.items():
            if point.topic is not None:
                place = (point.topic, point.field or "")
                groups.setdefault(place, []).append((point, levels[name]))
        said: dict[str, dict[str, object]] = {}
        whole: dict[str, bytes] = {}
        wrong = self.plant.failures.get("unit") == "wrong"
        for (topic, field), group in groups.items():
            value = ["?"] if wrong else _value(group)
            if field:
                put(said.setdefault(topic, {}), field, value)
            else:
                whole[topic] = plain(value)
        return whole | {topic: json.dumps(value).encode() for topic, value in said.items()}


class MqttSite:
    """A broker with its devices. `replace` has the settings with which the real bus finds the
    broker."""

    def __init__(
        self, settings: MqttSettings, stations: Sequence[PlantWiring | MqttStation]
    ) -> None:
        points = settings.wholes()
        self._devices: list[MqttStation] = [
            MqttDevice(station, points) if isinstance(station, PlantWiring) else station
            for station in stations
        ]
        ages = [p.stale_after_s for p in points.values() if p.stale_after_s]
        self._period_s = min(ages, default=0.3) / 3
        self._slow_s = 2 * max(ages, default=1.0) + settings.timeout_s
        self._noise = random.Random("mqtt")
        self._last: dict[str, bytes] = {}
        self._mode: FailureMode | None = None
        self._failing = contextlib.ExitStack()
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._broker = Mosquitto()
        self._client = self._attached()
        self.replace = self._broker.replace
        self._thread = threading.Thread(target=self._run, name="mqtt-site", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the devices and the broker. The caller may call `close` twice."""
        if self._closed.is_set():
            return
        self._closed.set()
        self._thread.join()
        self._failing.close()
        self._detach()
        self._broker.close()

    def _run(self) -> None:
        next_at = 0.0
        while not self._closed.wait(LOOK_S):
            self._fail_as_ordered()
            due = time.monotonic() >= next_at
            if due:
                next_at = time.monotonic() + self._period_s
            for device in self._devices:
                with self._lock:
                    device.tick()
                self._publish(device, everything=due and not device.asks)

    def _attached(self) -> paho.Client:
        """Connect the devices, and listen for commands. Raises HalError."""
        client, ready = paho.Client(CallbackAPIVersion.VERSION2), threading.Event()
        client.on_message = self._take
        client.on_subscribe = lambda *_: ready.set()
        client.connect("127.0.0.1", self._broker.port)
        topics = {topic for d in self._devices for topic, _ in d.commands} | {
            topic for d in self._devices for topic in d.asks
        }
        client.loop_start()
        client.subscribe([(topic, 1) for topic in sorted(topics)] or "nothing")
        if not ready.wait(READY_S):
            raise HalError("the devices cannot reach their broker")
        return client

    def _detach(self) -> None:
        self._client.disconnect()
        end(self._client)

    def _take(self, client: object, _: object, message: paho.MQTTMessage) -> None:
        topic, payload = message.topic, message.payload.decode()
        for device in self._devices:
            mode = device.plant.failures.get("unit")
            if mode == "off":
                continue
            if mode == "slow":
                self._closed.wait(self._slow_s)
            if found := device.commands.get((topic, payload)):
                with self._lock:
                    device.obey(*found)
                self._publish(device, topic=device.echo(found[0]))
            if device.asks.get(topic) == payload:
                self._publish(device, everything=True)

    def _publish(
        self, device: MqttStation, everything: bool = False, topic: str | None = None
    ) -> None:
        mode = device.plant.failures.get("unit")
        if mode == "off" or self._mode == "wrong":
            return
        with self._lock:
            for at, payload in device.states().items():
                if mode == "stuck":
                    payload = self._last.get(at, payload)
                if everything or at == topic or self._last.get(at) != payload:
                    self._last[at] = payload
                    sent = self._noise.randbytes(20) if mode == "garbage" else payload
                    self._client.publish(at, sent)

    def _fail_as_ordered(self) -> None:
        modes = (device.plant.failures.get("server") for device in self._devices)
        mode = next((mode for mode in modes if mode), None)
        if mode == self._mode:
            return
        self._failing.close()
        self._mode = mode
        if mode is not None:
            self._failing.enter_context(getattr(self, f"_{mode}")())

    @contextlib.contextmanager
    def _off(self) -> Iterator[None]:
        self._detach()
        self._broker.kill()
        yield
        self._broker.start()
        self._client = self._attached()

    @contextlib.contextmanager
    def _stuck(self) -> Iterator[None]:
        self._broker.freeze()
        yield
        self._broker.thaw()

    @contextlib.contextmanager
    def _slow(self) -> Iterator[None]:
        """Let the broker work for short moments, with long rests between them."""
        over = threading.Event()

        def rest() -> None:
            while not over.is_set():
                self._broker.freeze()
                over.wait(self._slow_s)
                self._broker.thaw()
                over.wait(LOOK_S)

        thread = threading.Thread(target=rest)
        thread.start()
        yield
        over.set()
        thread.join()

    @contextlib.contextmanager
    def _garbage(self) -> Iterator[None]:
        """Replace the broker by a server that speaks another protocol."""
        with self._off(), socket.create_server(("127.0.0.1", self._broker.port)) as server:
            threading.Thread(target=self._talk, args=(server,), daemon=True).start()
            yield
            with contextlib.suppress(OSError):
                server.shutdown(socket.SHUT_RDWR)

    def _talk(self, server: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while True:
                caller, _ = server.accept()
                with caller:
                    caller.sendall(self._noise.randbytes(200))

    @contextlib.contextmanager
    def _wrong(self) -> Iterator[None]:
        """Restart the broker with only the retained states. The devices stay away."""
        self._detach()
        self._broker.kill()
        self._broker.start()
        self._client = self._attached()
        for device in self._devices:
            for topic, payload in device.states().items():
                self._client.publish(topic, payload, retain=True)
        yield


def _value(group: Sequence[tuple[MqttPoint, bool]]) -> object:
    """Return the value of a field that several points read. The value has the right meaning for each of
    these points."""
    points = [point for point, _ in group]
    asserted = [point for point, on in group if on]
    if not points[0].when:
        return bool(asserted)
    if asserted:
        return asserted[0].when[0]
    return next(v for v in points[0].when_not if all(v in point.when_not for point in points))


def plain(value: object) -> bytes:
    """Encode a payload. A text stays as it is. Any other value becomes JSON."""
    return value.encode() if isinstance(value, str) else json.dumps(value).encode()


FAKE = Outside(serve, parts=PARTS)

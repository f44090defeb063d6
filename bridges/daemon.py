"""The daemon: one device YAML in service. Opens the transport and the buses, starts a loop for each
bus, tells systemd how it is, and on SIGTERM or SIGINT switches every output off and leaves RMF's graph.
"""

import importlib
import logging
import os
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from types import FrameType
from typing import Any

import msgspec

from bridges import __version__
from bridges.kind import Kind
from bridges.log import pairs
from bridges.loop import Loop
from bridges.node import RESET, Clock, Node
from bridges.notify import notify, watchdog_s
from bridges.rmf.choose import open_transport
from bridges.rmf.definitions import Message
from bridges.rmf.topics import Topic
from bridges.rmf.transport import Publisher, Transport, TransportError
from bridges.runtime import RuntimeDirectory
from bridges.settings import Config
from drivers import DriverError
from drivers.hal import Bus

log = logging.getLogger(__name__)

STOP_WITHIN_S = 5.0
STATUS_EVERY_S = 1.0
CLOCK = Clock(time.monotonic, time.time)
OpenBus = Callable[[str, Any], Bus]


def open_bus(name: str, settings: Any) -> Bus:
    """The real bus that the YAML names."""
    hal = importlib.import_module(type(settings).__module__)
    bus: Bus = hal.open_bus(settings)
    return bus


class Daemon:
    """Everything that one `rmf-bridge run` holds. `simulated` is shown wherever the state is."""

    def __init__(
        self,
        config: Config,
        runtime: RuntimeDirectory,
        *,
        open_bus: OpenBus = open_bus,
        localhost: bool = False,
        simulated: bool = False,
    ) -> None:
        self._config = config
        self._runtime = runtime
        self._simulated = simulated
        self._kind: Kind = importlib.import_module(f"bridges.{config.kind}").KIND
        self._driver = importlib.import_module(f"drivers.{config.kind}_{config.driver}")
        self._strangers: Counter[str] = Counter()
        self._publishers: dict[str, Publisher[Any]] = {}
        self._stop = threading.Event()
        self._loops: list[Loop] = []
        node_name = f"rmf_bridge_{config.path.stem}"
        self._transport: Transport = open_transport(config.rmf, node_name, localhost=localhost)
        for topic in self._topics():
            self._publishers[topic.name] = self._transport.publisher(self._named(topic))
        if not simulated:
            runtime.claim(config.text)  # before anything is: `outputs-off` goes by it
        self._loops = [self._loop(name, open_bus) for name in config.buses]
        self._by_device = {node.name: loop for loop in self._loops for node in loop.nodes}

    def serve(self) -> int:
        """Run until a signal, and return the exit code: 0 when every output is off and verified."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._on_signal)
        signal.signal(signal.SIGUSR1, self._on_reset)
        self._subscribe()
        for loop in self._loops:
            loop.start()
        log.info(pairs("serving", file=self._config.path, kind=self._config.kind, **self._about()))
        try:
            self._watch()
        finally:
            safe = self._shut_down()
        return 0 if safe else 1

    def _watch(self) -> None:
        """Tell systemd that we are ready, and each time that every loop has finished scans."""
        period_s = min(STATUS_EVERY_S, (watchdog_s() or 10.0) / 3)
        told_ready = False
        fed = [-1] * len(self._loops)
        while not self._stop.wait(0.02 if not told_ready else period_s):
            if not all(loop.alive for loop in self._loops):
                raise SystemExit(70)  # a defect of ours, logged by its thread; systemd restarts us
            if not told_ready and all(loop.ready for loop in self._loops):
                notify("READY=1")
                log.info(pairs("ready", file=self._config.path))
                told_ready = True
            scans = [loop.scans for loop in self._loops]
            if all(now > before for now, before in zip(scans, fed, strict=True)):
                notify("WATCHDOG=1")
                fed = scans
            if told_ready:
                self._runtime.write_status(self._status())

    def _shut_down(self) -> bool:
        notify("STOPPING=1")
        deadline = time.monotonic() + STOP_WITHIN_S
        safe = [loop.stop(max(0.1, deadline - time.monotonic())) for loop in self._loops]
        self._transport.close()
        if all(safe):
            self._runtime.released()
        log.info(pairs("stopped", outputs_off=all(safe)))
        return all(safe)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self._stop.set()

    def _on_reset(self, number: int, frame: FrameType | None) -> None:
        """`rmf-bridge reset`: an operator says that it is safe to go on."""
        for device, loop in self._by_device.items():
            loop.inbox.put((device, *RESET))

    def _topics(self) -> list[Topic[Any]]:
        alarms = {t for d in self._config.devices.values() for t in self._kind.alarm_topics(d)}
        return [self._kind.states, *alarms]

    def _named(self, topic: Topic[Any]) -> Topic[Any]:
        """The topic under the site's own name for it."""
        return topic.named(self._config.rmf.topics.get(topic.name, topic.name))

    def _loop(self, bus_name: str, open_bus: OpenBus) -> Loop:
        settings = self._config.buses[bus_name]
        bus = open_bus(bus_name, settings)
        nodes = [
            self._node(name, device, bus)
            for name, device in self._config.devices.items()
            if self._config.bus_of(name) == bus_name
        ]
        return Loop(bus_name, bus, nodes, settings.scan_s, CLOCK)

    def _node(self, name: str, device: Any, bus: Bus) -> Node:
        debounce: Mapping[str, float] = getattr(self._driver, "debounce", lambda _: {})(device)
        limits = self._kind.limits(device, debounce)
        driver = self._driver.create(name, device, bus)
        return Node(name, self._kind, device, limits, driver, self._publish, CLOCK)

    def _subscribe(self) -> None:
        for topic in self._kind.requests:
            self._transport.subscribe(self._named(topic), self._to_inbox(topic))
        states = self._kind.states
        self._transport.subscribe(self._named(states), self._to_inbox(states), others_only=True)

    def _to_inbox(self, topic: Topic[Any]) -> Callable[[Any], None]:
        """A callback for the transport's thread. Other nodes' states are not ours to count."""

        def put(message: Any) -> None:
            device = self._kind.device_name(message)
            loop = self._by_device.get(device)
            if loop is not None:
                loop.inbox.put((device, topic, message))
            elif topic != self._kind.states:
                self._count_stranger(device)

        return put

    def _count_stranger(self, device: str) -> None:
        if not self._strangers:
            log.info(pairs("not_ours", kind=self._kind.name, name=device))
        self._strangers["requests"] += 1

    def _publish(self, topic: Topic[Any], message: Message) -> None:
        try:
            self._publishers[topic.name].publish(message)
        except TransportError as error:
            log.error(pairs("not_published", topic=topic.name, reason=error))

    def _about(self) -> dict[str, Any]:
        about = {"version": __version__, "node": self._transport.name, "pid": os.getpid()}
        return about | ({"SIMULATED": "no hardware moves"} if self._simulated else {})

    def _status(self) -> bytes:
        return msgspec.json.encode(
            {
                "simulated": self._simulated,
                "file": str(self._config.path),
                **self._about(),
                "requests_for_others": self._strangers["requests"],
                "samples_dropped": dict(self._transport.dropped),
                "messages_dropped": sum(loop.inbox.dropped for loop in self._loops),
                "devices": {n.name: n.status() for loop in self._loops for n in loop.nodes},
            }
        )


def outputs_off(config: Config, timeout_s: float) -> bool:
    """Switch off every output that a file names, from a fresh process; True when verified.

    Bounded: a bus that does not answer is given up after `timeout_s` (s) in all.
    """
    driver = importlib.import_module(f"drivers.{config.kind}_{config.driver}")
    results: dict[str, bool] = {}
    threads = [
        threading.Thread(target=_bus_off, args=(config, name, driver, results), daemon=True)
        for name in config.buses
    ]
    deadline = time.monotonic() + timeout_s
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(max(0.0, deadline - time.monotonic()))
    return len(results) == len(config.devices) and all(results.values())


def _bus_off(config: Config, bus_name: str, driver: Any, results: dict[str, bool]) -> None:
    bus = open_bus(bus_name, config.buses[bus_name])
    for name, device in config.devices.items():
        if config.bus_of(name) == bus_name:
            results[name] = _device_off(name, driver.create(name, device, bus))
    bus.close()


def _device_off(name: str, driver: Any) -> bool:
    try:
        driver.open()
        driver.make_safe()
    except DriverError as error:
        log.error(pairs("outputs_not_off", device=name, reason=error))
        return False
    finally:
        driver.close()
    log.info(pairs("outputs_off", device=name))
    return True

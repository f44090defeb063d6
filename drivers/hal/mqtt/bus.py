"""The broker as a bus. It has the messages that devices have published, and sends messages to the
devices.

A driver whose signals are not contacts uses these calls:

    bus.listen(topic)                  in the constructor, for each topic that the driver reads
    bus.fresh(topic, stale_after_s)    in `read`: the last message, or a HalError if it is not valid
    bus.heard(topic)                   the last message of any age; None without a message
    bus.publish(topic, payload)        in `write`; with `safe=True` for a message that switches off
    bus.up()                           in `open`: a HalError if there is no broker

A message is valid only if it came live in this connection, and is not older than `stale_after_s`.

A reading never waits for a message. The connection has a thread of its own, which receives the
messages. A changed payload wakes the bus's thread for a scan. With `listen(topic, take)` the
connection's thread calls `take` for each message. This is for a driver that must not miss a message.

- A retained message is not valid, because it reports an earlier state of unknown age.
- All devices of the bus share one connection. If the connection fails, every device fails, and the bus
  backs off for 0.5 to 30 s. A silent device does not delay the other devices, because no call waits for
  it.
- Every connection starts with a clean session and without the messages of earlier connections. The bus
  may have missed an important message while the broker was away, so the earlier messages may be wrong.
- A message to a device is never retained, and is sent once. "On" expires at the broker (MQTT 5), so
  that it never reaches a device that comes back later.
"""

import math
import random
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import msgspec

from bridges.system.machine_time import machine_s
from drivers.hal import Bus, HalError
from drivers.hal.backoff import Backoff
from drivers.hal.mqtt.lines import MqttLines
from drivers.hal.mqtt.settings import MqttSettings
from drivers.hal.mqtt.topics import PAYLOAD_MAX, TOPICS_MAX, Ask, Availability, Qos
from drivers.hal.points import Clearing, Pull

if TYPE_CHECKING:
    from drivers.hal.mqtt.link import Link

EXPIRES_S: Final = 2
"""The time (s) after which the broker drops an "on" that it could not deliver."""
KEPT_MAX: Final = 4 * 1024 * 1024
"""The maximum length (bytes) of all kept payloads together. When this length is reached, the bus keeps
no further payload."""


class Heard(msgspec.Struct, frozen=True):
    """The last message of a topic. `at` is in monotonic seconds. For a retained message `at` is None.

    `length` is the payload's length in bytes. If a payload is too long, the bus keeps only its length.
    """

    payload: bytes
    at: float | None
    length: int


def open_bus(settings: MqttSettings) -> "MqttBus":
    """Make the bus. Raises HalError if paho is not installed."""
    if find_spec("paho") is None:
        raise HalError(
            "MQTT needs the Python package paho-mqtt: run .venv/bin/pip install '.[mqtt]' in the git"
            " clone"
        )
    return MqttBus(settings)


class MqttBus(Bus):
    """One broker. It is also a bus with points (`drivers.hal.points.PointsBus`). `now` is the bus's
    clock, which tests replace."""

    def __init__(
        self,
        settings: MqttSettings,
        clock: Callable[[], float] = machine_s,
        jitter: Callable[[], float] = random.random,
    ) -> None:
        self.now = clock
        self.settings = settings
        self.points = settings.wholes()
        self._backoff, self._safe_backoff = (Backoff(clock, jitter) for _ in range(2))
        self._link: Link | None = None
        self._heard: dict[str, Heard] = {}
        self._kept = 0
        self._takers: dict[str, Callable[[Heard], None] | None] = {}
        self._asked: dict[Ask, float] = {}
        self._wake: Callable[[], None] = lambda: None

    def canonical(self, point: str) -> str:
        """Return the point's name unchanged, because a name has only one spelling."""
        return point

    def lines(
        self,
        inputs: Mapping[str, Pull | None],
        outputs: Mapping[str, bool],
        unread: Collection[str] = (),
        clearing: Mapping[str, Clearing] = MappingProxyType({}),
    ) -> MqttLines:
        """Return the lines of these points, and listen to their topics. The last two parameters concern
        only Modbus modules."""
        found = {name: self.points[name] for name in (*inputs, *outputs)}
        for point in found.values():
            for place in (point, point.availability):
                if place and place.topic:
                    self.listen(place.topic)
        return MqttLines(self, {n: found[n] for n in inputs}, {n: found[n] for n in outputs})

    def listen(self, topic: str, take: Callable[[Heard], None] | None = None) -> None:
        """Subscribe to this topic, now and in each later connection.

        Another thread calls `take` for each message. `take` must be quick and must not raise. Raises
        HalError if the bus already listens to TOPICS_MAX topics.
        """
        if len(self._takers) >= TOPICS_MAX and topic not in self._takers:
            raise HalError(f"a bus listens to at most {TOPICS_MAX} topics: define a second bus")
        self._takers[topic] = take or self._takers.get(topic)
        if self._link is not None and self._link.up:
            self._link.subscribe([topic])

    def up(self, safe: bool = False) -> "Link":
        """Return the connection, and make one if there is none. Raises HalError if no connection is
        possible.

        After a failure, a backoff (a pause before the next attempt) begins. Calls during the backoff
        raise HalError at once. `safe` means that the caller will switch an output off. Such a call does
        not wait for the backoff of a failed reading.
        """
        if self._link is not None and self._link.up:
            return self._link
        backoff = self._safe_backoff if safe else self._backoff
        backoff.check()
        try:
            with self._call():
                link = self._connected()
        except HalError as error:
            raise backoff.failed(str(error)) from None
        for each in (self._backoff, self._safe_backoff):
            each.mended()
        return link

    def heard(self, topic: str) -> Heard | None:
        """Return the topic's last message in this connection. Return None without a message. Raises
        HalError."""
        if reason := self.up().refused.get(topic):
            raise HalError(f"the broker refuses the subscription to {topic}: {reason}")
        return self._heard.get(topic)

    def fresh(self, topic: str, stale_after_s: float = math.inf) -> Heard:
        """Return the topic's last message if it came live in this connection and is not stale.
        Otherwise raise HalError."""
        found = self.heard(topic)
        if found is None or found.at is None:
            was = (
                f"; there is a retained message, of unknown age: {_shown(found.payload)}"
                if found
                else ""
            )
            raise HalError(f"no message has come on {topic} since the connection began{was}")
        age_s = self.now() - found.at
        if age_s > stale_after_s:
            raise HalError(
                f"the last message on {topic} is {age_s:.1f} s old, more than stale_after_s"
                f" ({stale_after_s:g} s): check the device's power and network"
            )
        if len(found.payload) != found.length:
            raise HalError(f"the message on {topic} is too long: {found.length} bytes")
        return found

    def believed(self, topic: str, stale_after_s: float, notices: Availability | None) -> Heard:
        """Return the topic's last message if it came live in this connection and is not stale.
        Otherwise raise HalError.

        If the device has gone offline since the message, raise HalError too. A retained notice that the
        device is offline does not count.
        """
        found = self.fresh(topic, stale_after_s)
        if notices is None or (notice := self.heard(notices.topic)) is None or notice.at is None:
            return found
        gone = notice.payload.decode(errors="replace") in notices.offline
        if gone and notice.at >= (found.at or 0.0):
            raise HalError(f"{notices.topic} says that the device is offline")
        return found

    def publish(
        self,
        topic: str,
        payload: str | bytes,
        qos: Qos = 1,
        safe: bool = False,
        expires_s: int | None = EXPIRES_S,
    ) -> None:
        """Send a message that the broker does not retain. Send it once. With `qos` 1, wait for the
        broker's confirmation.

        `safe` means that the message switches an output off. Such a message never expires. It does not
        wait for the backoff (the pause before a new connection) of a failed reading.

        Raises HalError if the connection or the confirmation fails. After an error it is unknown
        whether the device has received the message.
        """
        data = payload.encode() if isinstance(payload, str) else payload
        link = self.up(safe)
        with self._call():
            link.publish(topic, data, qos, None if safe else expires_s)

    def ask(self, asks: Iterable[Ask]) -> None:
        """Send these messages, which make devices publish their states. Send each message at most once
        in half a scan, even if several devices request it.

        The broker must confirm each message within `timeout_s`, otherwise the connection ends. A broker
        that was frozen (for example a suspended machine) would deliver old states as if they were live.
        Raises HalError.
        """
        now, rest_s = self.now(), self.settings.scan_s / 2
        for one in asks:
            if now - self._asked.get(one, -math.inf) >= rest_s:
                self._asked[one] = now
                self.publish(one.topic, one.payload)

    def await_first(self, topics: Iterable[str], asks: Iterable[Ask]) -> None:
        """Wait at most `timeout_s` until the devices have published on each of these topics. Raises
        HalError."""

        def all_live() -> bool:
            found = [self._heard.get(topic) for topic in topics]
            return all(heard and heard.at is not None for heard in found)

        self.ask(asks)
        self.wait(all_live, self.settings.timeout_s)

    def wait(self, done: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until `done()` is true, for at most `timeout_s`. Call `done` again after each message.
        Return whether `done()` became true.

        Raises HalError without a connection.
        """
        link = self.up()
        with link.changed:
            found = link.changed.wait_for(lambda: bool(link.failure) or done(), timeout_s)
        self.calls += 1
        return found

    def topics(self) -> Iterable[str]:
        """Return the topics that the bus listens to."""
        return tuple(self._takers)

    def survey(self, listen_s: float) -> tuple[Mapping[str, str], bool]:
        """Listen to every topic of the broker on a second connection, for people who look for devices.

        Return `live` or `retained` for each topic. Also return False if the broker has more topics than
        TOPICS_MAX, so that some are missing. Raises HalError.
        """
        from drivers.hal.mqtt.link import Link

        found: dict[str, str] = {}

        def take(topic: str, payload: bytes, retained: bool) -> None:
            if len(found) < TOPICS_MAX:
                found[topic] = "retained" if retained else "live"

        settings = msgspec.structs.replace(self.settings, client_id=None)
        link = Link(settings, ["#"], take)
        link.start()
        with link.changed:
            link.changed.wait_for(lambda: link.up or link.failure, settings.timeout_s)
            link.changed.wait_for(lambda: link.failure, listen_s if link.up else 0.0)
        failure = link.failure or link.refused.get("#") or ("" if link.up else "no answer")
        link.close()
        if failure:
            raise HalError(failure)
        return found, len(found) < TOPICS_MAX

    def on_edge(self, wake: Callable[[], None]) -> None:
        """Let the connection's thread call `wake` when a topic's payload changes, and when the
        connection ends."""
        self._wake = wake

    def insist(self) -> None:
        """Let the next attempt to connect skip the backoff."""
        for backoff in (self._backoff, self._safe_backoff):
            backoff.insist()

    def close(self) -> None:
        """End the connection."""
        link, self._link = self._link, None
        if link is not None:
            link.on_end = lambda: None
            link.close()

    @contextmanager
    def _call(self) -> Iterator[None]:
        """Run one call to the broker: a connection, or a message that the broker must confirm. Count it
        and measure its time."""
        began, failed = self.now(), True
        try:
            yield
            failed = False
        finally:
            self.calls += 1
            where = f"{self.settings.host}:{self.settings.port}"
            self.units.ended(where, self.now() - began, failed=failed)

    def _connected(self) -> "Link":
        """Make a connection within `timeout_s`. Raises HalError."""
        from drivers.hal.mqtt.link import Link

        old = self._link
        if old is not None and old.is_alive() and old.connecting:
            raise HalError("the last attempt to reach the broker has not ended yet")
        self._heard.clear()
        self._kept = 0
        link = Link(self.settings, self._takers, self._take)
        link.on_end = self._lost
        self._link = link
        link.start()
        with link.changed:
            ended = link.changed.wait_for(lambda: link.up or link.failure, self.settings.timeout_s)
        if not ended:
            link.close(f"the broker does not answer within {self.settings.timeout_s:g} s")
        if link.failure:
            raise HalError(link.failure)
        return link

    def _take(self, topic: str, payload: bytes, retained: bool) -> None:
        link, before = self._link, self._heard.get(topic)
        if topic not in self._takers or link is None:
            return
        kept = b"" if len(payload) > PAYLOAD_MAX or self._kept > KEPT_MAX else payload
        self._kept += len(kept) - (len(before.payload) if before else 0)
        found = self._heard[topic] = Heard(kept, None if retained else self.now(), len(payload))
        if take := self._takers[topic]:
            take(found)
        with link.changed:
            link.changed.notify_all()
        if before is None or before.payload != payload or before.at is None:
            self._wake()

    def _lost(self) -> None:
        self._wake()


def _shown(payload: bytes) -> str:
    return repr(payload[:40].decode(errors="replace"))

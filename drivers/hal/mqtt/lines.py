"""One device's contacts and relays behind a broker (`drivers.hal.points.Lines`).

The claim switches every relay off. A relay's published state must follow each command within
`answers_within_s`. If the state contradicts the command later, there are three possible causes. The
device has restarted, its timer has run out, or somebody else switches the relay too
(`drivers/hal/rivals.py`). Every relay that should go off gets its message, even if another relay fails.
"""

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Final

from drivers.hal import HalError
from drivers.hal.every import Every
from drivers.hal.mqtt.points import MqttPoint
from drivers.hal.rivals import Rivals

if TYPE_CHECKING:
    from drivers.hal.mqtt.bus import MqttBus


WAIT_S: Final = 0.5
"""The longest wait (s) for a state in one call. systemd's watchdog counts ended calls, so a call must
be short."""


class MqttLines:
    """The points of one device, by name."""

    def __init__(
        self, bus: "MqttBus", inputs: Mapping[str, MqttPoint], outputs: Mapping[str, MqttPoint]
    ) -> None:
        self._bus = bus
        self._inputs = inputs
        self._outputs = outputs
        self._asks = {p.ask for p in (*inputs.values(), *outputs.values()) if p.ask}
        self._set: dict[str, bool] = {}
        self._since: dict[str, float] = {}
        self._claimed = False
        self._touched = False
        self._rivals = Rivals(bus.now)

    def claim(self) -> None:
        """Check each state. In the first claim, also switch every relay off, and give the device time
        to publish its first states.

        Raises HalError for a state that is not live and recent. A claim after a failure only reads. For
        example, a lost confirmation must not release a door that RMF holds.
        """
        points = (*self._inputs.values(), *self._outputs.values())
        if not self._claimed:
            self.write(dict.fromkeys(self._outputs, False))
            self._claimed = True
            self._bus.await_first({p.topic for p in points if p.topic}, self._asks)
        self._bus.ask(self._asks)
        for point in points:
            if point.topic:
                self._state(point)

    def read(self) -> dict[str, bool]:
        """Read every contact. Raises HalError if a contact's topic has no live state. Also raises
        HalError if a relay's state contradicts the relay's last command."""
        self._bus.ask(self._asks)
        found = {name: self._state(point) for name, point in self._inputs.items()}
        for name, level in self._set.items():
            self._verify(name, level)
        return found

    def write(self, levels: Mapping[str, bool]) -> None:
        """Switch these relays. Switch relays off before others are switched on. Raises HalError. After
        an error the states of these relays are unknown."""
        self._touched = self._touched or bool(levels)
        every = Every()
        for name in sorted(levels, key=lambda name: levels[name]):
            self._set.pop(name, None)
            if levels[name] and every.failure:
                continue
            with every.one():
                if levels[name]:
                    self._rivals.check([name])
                self._since[name] = self._bus.now()  # before the send, because answers are fast
                self._send(name, levels[name])
                self._set[name] = levels[name]
        every.check()

    def renew(self, names: Iterable[str]) -> None:
        """Restart the timers of these relays, which must be on already. Raises HalError."""
        for name in names:
            if self._outputs[name].switches_off_after_s is not None:
                self._rivals.check([name])
                self._send(name, True)

    def outputs(self) -> dict[str, int] | None:
        """Wait until each relay's state follows its last command. Return the states that can be
        read."""
        readable = {n: p for n, p in self._outputs.items() if p.topic}
        self._bus.ask(self._asks)
        within_s = max((p.answers_within_s for p in readable.values()), default=0.0)
        for _ in range(math.ceil(within_s / WAIT_S)):
            if self._bus.wait(lambda: all(map(self._follows, readable)), WAIT_S):
                break
        for name in readable:
            if self._said(name) is None:
                raise HalError(f"'{name}' publishes no state after it was switched")
        return {name: bool(self._said(name)) for name in readable}

    def close(self) -> None:
        """If this device ever switched a relay, try once to switch every relay off. Does not raise."""
        if not self._touched:
            return
        self._bus.insist()
        unheard = Every()  # nobody reads these failures, because the daemon ends
        for name in self._outputs:
            with unheard.one():
                self._send(name, False)

    def _send(self, name: str, on: bool) -> None:
        command = self._outputs[name].command
        assert command  # `unfit` has refused an output without a command
        payload = command.payload_on if on else command.payload_off
        self._bus.publish(command.topic, payload, command.qos, safe=not on)

    def _state(self, point: MqttPoint) -> bool:
        """Return the state. Raises HalError if the state is not live and recent."""
        assert point.topic
        assert point.stale_after_s
        found = self._bus.believed(point.topic, point.stale_after_s, point.availability)
        return point.asserted(found.payload)

    def _verify(self, name: str, level: bool) -> None:
        """Raise HalError if this relay's state contradicts `level`, although `answers_within_s` has
        passed since the command."""
        point = self._outputs[name]
        if point.topic is None:
            return
        waiting = self._bus.now() - self._since[name] <= point.answers_within_s
        said = self._said(name)
        if waiting and said in (None, not level):
            return
        state = self._state(point)
        if said is None:
            raise HalError(
                f"'{name}' publishes no state within answers_within_s after it was switched"
            )
        if state == level:
            return
        self._rivals.contradicted(name)
        self._set.pop(name)
        self._rivals.check([name])
        raise HalError(
            f"'{name}' is {_word(not level)} after it was switched {_word(level)}: the device has"
            " restarted, its timer has run out, or somebody else switches it"
        )

    def _said(self, name: str) -> bool | None:
        """Return the relay's state if this state came after the relay's last command. Otherwise return
        None."""
        point = self._outputs[name]
        assert point.topic
        found = self._bus.heard(point.topic)
        if found is None or found.at is None or found.at < self._since.get(name, 0.0):
            return None
        return point.asserted(found.payload)

    def _follows(self, name: str) -> bool:
        try:
            return self._said(name) == self._set.get(name, False)
        except HalError:
            return False


def _word(on: bool) -> str:
    return "on" if on else "off"

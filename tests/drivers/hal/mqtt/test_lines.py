"""A device's contacts and relays behind a real broker. The bus claims, reads, writes and releases them,
and renews each relay's switch-off timer."""

import itertools
from collections.abc import Iterator
from typing import Any

import pytest

from drivers import DriverError
from drivers.hal import HalError
from drivers.hal.mqtt import MqttBus
from drivers.hal.points import Points, Wire
from hal_fakes.mosquitto import Mosquitto
from tests.drivers.hal.mqtt.broker import RELAY, STATE, SWITCH, FarDevice, bus_to
from tests.waiting import wait_until

WIRE = Wire("hold", "out", "relay", "high")
CONTACT = Wire("closed", "in", "contact", "high")
POINTS: dict[str, Any] = {
    "other": {
        "command": {"topic": "other/set", "payload_on": "ON", "payload_off": "OFF"},
        "without_timer": "a lamp",
    },
    "relay": {**RELAY, "answers_within_s": 1},
    "contact": {
        "topic": "contact/state",
        "stale_after_s": 60,
        "availability": {"topic": "contact/online", "offline": ["false"]},
    },
}


class Site:
    """A relay that obeys commands and publishes its state.

    If `obeys` is false, the relay ignores commands.
    """

    def __init__(self, broker: Mosquitto, bus: MqttBus) -> None:
        self.now = 0.0
        self.bus = bus
        ticks = itertools.count()
        bus.now = lambda: self.now + 1e-6 * next(ticks)
        self.device = FarDevice(broker.port, SWITCH)
        self.obeys = True
        self.answer = b""
        self.points = Points([WIRE, CONTACT], bus)
        taken = self.device.client.on_message

        def obey(client: Any, data: Any, message: Any) -> None:
            assert taken
            taken(client, data, message)
            if self.obeys or self.answer:
                client.publish(STATE, self.answer or message.payload)

        self.device.client.on_message = obey

    def commands(self) -> list[bytes]:
        """Return the payload of every command that the relay has received."""
        return [payload for _, payload, _ in self.device.taken]

    def contact(self, closed: bool) -> None:
        self.device.says("contact/state", "true" if closed else "false")

    def until_read(self) -> dict[str, bool]:
        """Wait until the device's states have arrived. Return the reading of the contact."""
        found: list[dict[str, bool]] = []

        def read() -> bool:
            try:
                found.append(self.points.read())
            except HalError:
                return False
            return True

        wait_until(read, "a reading")
        return found[0]

    def hears(self, state: bytes) -> None:
        """Wait until the relay has published this state and the bus has received it."""

        def heard() -> bool:
            found = self.bus.heard(STATE)
            return found is not None and found.payload == state

        wait_until(heard, "the relay's state")

    def until_it_fails(self, text: str) -> None:
        """Read until a reading fails with an error that contains this text."""

        def fails() -> bool:
            try:
                self.points.read()
            except DriverError as error:
                return text in str(error)
            return False

        wait_until(fails, text)


@pytest.fixture
def site() -> Iterator[Site]:
    broker = Mosquitto()
    with bus_to(broker.port, POINTS) as bus:
        site = Site(broker, bus)
        site.contact(closed=True)
        yield site
        site.device.close()
    broker.close()


def opened(site: Site) -> Site:
    """Close the contact, claim the relay, and return the site."""
    bus = site.bus
    bus.up()
    site.contact(closed=True)
    site.points.open()
    return site


def test_a_claim_switches_off_once_and_a_later_claim_leaves_a_held_door_alone(site: Site) -> None:
    opened(site).until_read()
    site.points.write({"hold": True})
    site.points.open()
    site.points.write({"hold": True})
    wait_until(lambda: len(site.commands()) >= 3, "the commands")
    assert site.commands()[:2] == [b"OFF", b"ON"]
    assert b"OFF" not in site.commands()[1:]


def test_on_is_sent_again_in_each_scan_and_off_is_sent_once(site: Site) -> None:
    opened(site)
    for _ in range(3):
        site.until_read()
        site.points.write({"hold": True})
    for _ in range(3):
        site.until_read()
        site.points.write({"hold": False})
    wait_until(lambda: len(site.commands()) == 5, "the commands")
    assert site.commands() == [b"OFF", b"ON", b"ON", b"ON", b"OFF"]


def test_a_relay_that_does_not_follow_is_a_fault(site: Site) -> None:
    opened(site).until_read()
    site.obeys = False
    site.points.write({"hold": True})
    assert site.points.read() == {"closed": True}
    site.now = 1.5
    site.until_it_fails("'relay' publishes no state within answers_within_s after it was switched")


def test_a_relay_that_goes_off_by_itself_is_a_fault_and_then_another_master(site: Site) -> None:
    opened(site).until_read()
    site.points.write({"hold": True})
    site.hears(b"ON")
    site.now = 2.0
    site.device.says(STATE, "OFF")
    site.until_it_fails("'relay' is off after it was switched on: the device has restarted")
    site.points.write({"hold": True})
    site.hears(b"ON")
    site.now = 4.0
    site.device.says(STATE, "OFF")
    site.until_it_fails("another master writes relay too")
    with pytest.raises(DriverError, match="another master writes relay too"):
        site.points.write({"hold": True})
    site.points.write({"hold": False})


def test_switching_off_is_verified(site: Site) -> None:
    opened(site).until_read()
    site.points.write({"hold": True})
    site.points.make_safe()
    assert site.commands()[-1] == b"OFF"
    site.obeys = False
    with pytest.raises(DriverError, match="'relay' publishes no state after it was switched"):
        site.points.make_safe()


def test_a_relay_that_stays_on_is_told(site: Site) -> None:
    opened(site).until_read()
    site.obeys = False
    site.answer = b"ON"
    with pytest.raises(DriverError, match="still on after being switched off: hold"):
        site.points.make_safe()


def test_closing_switches_off_what_was_ever_switched(site: Site) -> None:
    opened(site)
    site.points.write({"hold": True})
    site.points.close()
    wait_until(lambda: site.commands()[-1] == b"OFF", "the last command")


def test_a_device_that_says_that_it_is_offline_is_a_fault_until_it_speaks_again(site: Site) -> None:
    opened(site).until_read()
    site.now = 1.0
    site.device.says("contact/online", "false")
    site.until_it_fails("contact/online says that the device is offline")
    site.now = 2.0
    site.contact(closed=False)
    assert site.until_read() == {"closed": False}


def test_off_reaches_each_relay_although_another_relay_fails(site: Site) -> None:
    both = Points([Wire("other", "out", "other", "high"), WIRE], site.bus)
    with pytest.raises(HalError, match="other/set: no device listens there"):
        both.open()
    with pytest.raises(HalError, match="other/set: no device listens there"):
        both.write({"other": True, "hold": True})
    wait_until(lambda: site.commands() == [b"OFF"], "the relay's command")


def test_a_frozen_broker_ends_the_reading_before_its_old_states_come() -> None:
    broker = Mosquitto()
    asked = {"topic": "a/state", "stale_after_s": 60, "ask": {"topic": "a/ask"}}
    device = FarDevice(broker.port, "a/ask")
    with bus_to(broker.port, {"contact": asked}, timeout_s=0.2) as bus:
        points = Points([CONTACT], bus)
        bus.up()
        device.says("a/state", "true")
        wait_until(lambda: bus.heard("a/state"), "the state")
        assert points.read() == {"closed": True}
        broker.freeze()
        device.client.publish("a/state", "false")

        def fails() -> bool:
            try:
                points.read()
            except HalError as error:
                return "does not confirm a message within 0.2 s" in str(error)
            return False

        wait_until(fails, "the broker's silence")
        broker.thaw()
        bus.insist()
        bus.up()
        assert bus.heard("a/state") is None
    device.close()
    broker.close()


def test_a_device_that_is_asked_and_does_not_listen_is_named(site: Site) -> None:
    asked = {"topic": "b/state", "stale_after_s": 60, "ask": {"topic": "b/ask"}}
    with bus_to(site.bus.settings.port or 0, {"contact": asked}) as bus:
        points = Points([CONTACT], bus)
        with pytest.raises(HalError, match="b/ask: no device listens there"):
            points.read()


def test_a_silent_device_delays_no_other(site: Site) -> None:
    """Expect that each reading fails at once, because the device's last state is too old.

    The bus sends the silent device no request, because waiting for it would delay the other devices.
    """
    opened(site).until_read()
    other = Points([Wire("closed", "in", "contact", "high")], site.bus)
    site.now = 100.0
    before = site.bus.calls
    for points in (site.points, other):
        with pytest.raises(HalError, match=r"is 100\.0 s old, more than stale_after_s \(60 s\)"):
            points.read()
    assert site.bus.calls == before

"""A charging station behind a real broker: readings from its topics, and a power command that stays in
force."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.kinds.charger.signals import Activity, ChargerOutputs, ChargerSample
from bridges.settings.load import load
from drivers import DriverError
from drivers.charger.mqtt import DRIVER, MqttChargerSettings
from drivers.hal.mqtt import MqttBus, MqttSettings
from hal_fakes.mqtt import MqttSite
from hal_fakes.mqtt_charger import FAKE, FakeMqttCharger
from hal_fakes.plants.plant import FailureMode
from hal_fakes.realtime import RealTime
from tests.settings.reading import problems_of
from tests.waiting import wait_until

EXAMPLE = Path(__file__).parents[3] / "config" / "charger_mqtt.yaml"
ON, OFF = ChargerOutputs(power=True), ChargerOutputs(power=False)


class Pad:
    """The station of the example file, with its driver and a real broker."""

    def __init__(self) -> None:
        config = load(EXAMPLE)
        settings = msgspec.structs.replace(
            config.devices["charger_b"],
            topics={
                name: msgspec.structs.replace(state, stale_after_s=1.0)
                for name, state in config.devices["charger_b"].topics.items()
            },
        )
        assert isinstance(settings, MqttChargerSettings)
        self.world = RealTime({"charger_b": FAKE.plant("charger_b", settings, ())})
        self.plant = self.world.plants["charger_b"]
        self.site = MqttSite(config.buses["building"], [FakeMqttCharger(self.plant, settings)])
        plain: dict[str, Any] = {"type": "mqtt", "timeout_s": 0.5, **self.site.replace}
        self.bus = MqttBus(msgspec.convert(plain, MqttSettings))
        self.driver = DRIVER.create("charger_b", settings, self.bus)

    def close(self) -> None:
        self.driver.close()
        self.bus.close()
        self.site.close()
        self.world.close()

    def reads(self, wanted: Callable[[ChargerSample], bool], what: str) -> ChargerSample:
        """Read until a reading satisfies `wanted`, and return that reading."""
        found: list[ChargerSample] = []

        def read() -> bool:
            self.bus.insist()
            try:
                found.append(self.driver.read())
            except DriverError:
                return False
            return wanted(found[-1])

        wait_until(read, what)
        return found[-1]

    def power(self) -> list[object]:
        return [edge.value for edge in self.plant.edges if edge.signal == "power"]


@pytest.fixture
def pad() -> Iterator[Pad]:
    pad = Pad()
    yield pad
    pad.close()


def test_opening_waits_for_the_first_states_and_commands_nothing(pad: Pad) -> None:
    pad.driver.open()
    assert pad.driver.read().activity is Activity.IDLE
    assert pad.power() == []


def test_a_robot_is_known_and_charged_until_the_power_is_off(pad: Pad) -> None:
    pad.driver.open()
    pad.plant.press("tiny/AMR01", True, 0.0)
    found = pad.reads(lambda s: s.measured.receiver_id == "A41F", "the receiver")
    assert found.activity is Activity.IDLE

    def powered(sample: ChargerSample) -> bool:
        pad.driver.write(ON)
        return sample.activity is Activity.CHARGING

    assert (pad.reads(powered, "a charge").measured.volts or 0) > 0
    pad.driver.make_safe()
    pad.reads(lambda s: s.activity is not Activity.CHARGING, "the end of the charge")
    assert pad.power() == [True, False]


@pytest.mark.parametrize(
    ("part", "mode"),
    [
        *(("unit", mode) for mode in ("off", "garbage", "wrong")),
        *(("server", mode) for mode in ("off", "stuck", "garbage", "wrong")),
    ],
)
def test_every_failure_is_a_driver_error(pad: Pad, part: str, mode: FailureMode) -> None:
    pad.driver.open()
    pad.plant.fail(part, mode)

    def fails() -> bool:
        pad.bus.insist()
        try:
            pad.driver.read()
        except DriverError:
            return True
        return False

    wait_until(fails, f"{part} {mode}")
    pad.plant.fail(part, None)
    pad.reads(lambda s: s.activity is Activity.IDLE, "the station is back")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            "state: status.state",
            "state: stauts.state",
            "stauts.state must begin with the name of a topic in topics: unknown topic 'stauts':"
            " did you mean 'status'? known here: status, fault",
        ),
        ("topic: tpu/b/fault ", "topic: tpu/b/status ", "is the topic of fault too"),
        (
            "error_text: fault",
            "error_text: fualt",
            "fualt must begin with the name of a topic in topics: unknown topic 'fualt':"
            " did you mean 'fault'? known here: status, fault",
        ),
        (
            "stop: {topic: tpu/b/set,",
            "stop: {topic: tpu/b/status,",
            "tpu/b/status is a state topic: the daemon would read the command as a state",
        ),
        (
            'stop: {topic: tpu/b/set, payload: "OFF"}',
            'stop: {topic: tpu/b/set, payload: "ON"}',
            "same",
        ),
        ("topic: tpu/b/fault ", "topic: tpu/+/fault ", "without the wildcards # and +"),
    ],
)
def test_a_mistake_in_the_topics_is_found(tmp_path: Path, old: str, new: str, problem: str) -> None:
    text = EXAMPLE.read_text()
    assert old in text
    found = problems_of(tmp_path / "charger.yaml", text.replace(old, new, 1))
    assert any(problem in each for each in found), found

"""A charging station behind an MQTT broker. It publishes its plant's state on the YAML's topics."""

import json
from collections.abc import Mapping

from drivers.charger.json_station import StationCommand
from drivers.charger.mqtt import MqttChargerSettings
from hal_fakes.fake import Fake
from hal_fakes.http_charger import FakeJsonCharger, build
from hal_fakes.mqtt import PARTS, plain
from hal_fakes.plants.plant import Plant

EFFECTS: dict[StationCommand, tuple[str, bool]] = {
    "start": ("power", True),
    "stop": ("power", False),
    "range_check": ("range_check", True),
    "clear_error": ("clear_error", True),
}
"""The plant's signal for each command, and whether the command asserts the signal."""


class FakeMqttCharger(FakeJsonCharger):
    """A station (`hal_fakes.mqtt.MqttStation`)."""

    def __init__(self, plant: Plant, settings: MqttChargerSettings) -> None:
        super().__init__(plant, settings)
        self._topics = {name: state.topic for name, state in settings.topics.items()}
        asks = (state.ask for state in settings.topics.values())
        self.asks: Mapping[str, str] = {ask.topic: ask.payload for ask in asks if ask}
        self.commands: Mapping[tuple[str, str], tuple[str, bool]] = {
            (message.topic, message.payload): does
            for name, does in EFFECTS.items()
            if (message := settings.command(name))
        }

    def echo(self, signal: str) -> str | None:
        """Return None, because the station publishes a state only when the state changes."""
        return None

    def states(self) -> dict[str, bytes]:
        """Return the payload of each state, by its topic."""
        said = json.loads(self.body(self.reading()))
        if self.plant.failures.get("unit") == "wrong":
            said = {name: ["?"] for name in self._topics}
        return {topic: plain(said.get(name)) for name, topic in self._topics.items()}


FAKE = Fake[MqttChargerSettings](
    plant=lambda name, settings, wires: build(name, settings, PARTS),
    station=lambda plant, settings: FakeMqttCharger(plant, settings),
)

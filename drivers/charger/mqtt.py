"""A charging station behind an MQTT broker. The station publishes its states as JSON or as plain
values.

`topics` gives each state topic a name. The path of a field begins with this name, as in
`status.charger.state`. If the payload is a plain value, the path is the name alone. The YAML gives the
meanings of the fields with the same keys as for a station on HTTP. A reading succeeds only if every
topic has a live message that is not stale.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Final

import msgspec

from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from bridges.yaml.spelling import unknown
from drivers.charger import json_station, rules
from drivers.charger.http_fields import Fields
from drivers.charger.json_station import POWER, JsonCharger, JsonChargerSettings, StationCommand
from drivers.driver_type import DriverType
from drivers.hal.mqtt import MqttBus, MqttSettings
from drivers.hal.mqtt.points import decoded
from drivers.hal.mqtt.topics import Message, StateTopic
from drivers.json_fields import JsonFlag, JsonNumber

Key = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^[A-Za-z_][A-Za-z0-9_-]{0,63}$(?!\n)",
        extra={"pattern": "a short name without dots (status)"},
    ),
]
COMMANDS: Final[Sequence[StationCommand]] = ("start", "stop", "range_check", "clear_error")


class MqttChargerSettings(
    JsonChargerSettings, frozen=True, kw_only=True, forbid_unknown_fields=True
):
    """One station and its topics."""

    topics: Annotated[
        dict[Key, StateTopic],
        msgspec.Meta(min_length=1, max_length=32),
        tells("name -> a state topic. The path of each of its fields begins with this name."),
    ]
    start: Annotated[Message | None, tells("switches the power on for the robot on the pad.")] = (
        None
    )
    stop: Annotated[Message | None, tells("switches the power off.")] = None
    range_check: Annotated[
        Message | None,
        tells("orders a check of the robot's position, if the station needs an order."),
    ] = None
    clear_error: Annotated[Message | None, tells("clears the station's error.")] = None

    def problems(self) -> Remarks:
        """Yield problems that involve more than one field."""
        yield from super().problems()
        states = {topic.topic: name for name, topic in self.topics.items()}
        for name, topic in self.topics.items():
            if states[topic.topic] != name:
                yield ("topics", name, "topic"), f"is the topic of {states[topic.topic]} too"
        for command in COMMANDS:
            message = self.command(command)
            if message and message.topic in states:
                text = (
                    f"{message.topic} is a state topic: the daemon would read the command as a"
                    " state"
                )
                yield (command, "topic"), text
        if self.start and self.start == self.stop:
            yield ("stop",), "is the same message as start"
        for path, field in _fields(self):
            if field.split(".")[0] not in self.topics:
                text = unknown("topic", field.split(".")[0], self.topics)
                yield path, f"{field} must begin with the name of a topic in topics: {text}"


def _fields(settings: MqttChargerSettings) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield each field that the driver reads, with its path in the YAML. With the default of
    `error_text` the station has no such text."""
    for name in settings.fields.__struct_fields__:
        place = getattr(settings.fields, name)
        if isinstance(place, JsonFlag | JsonNumber):
            yield ("fields", name), place.field
        elif (
            (name == "error_text" and place != Fields().error_text)
            or (name == "receiver_id" and place)
            or (name == "state" and settings.codes)
        ):
            yield ("fields", name), place
    for name, number in settings.fields.temperatures.items():
        yield ("fields", "temperatures", name), number.field
    for path, field in rules.places(settings.rules):
        yield ("rules", *path), field
    for path, field in settings.errors.places():
        yield ("errors", *path), field


def claims(settings: MqttChargerSettings) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each command of the station with its path in the YAML. No other charger may send these
    commands."""
    for name in COMMANDS:
        if message := settings.command(name):
            yield f"the command {message.topic} {message.payload}".rstrip(), (name, "topic")


def describe(settings: MqttChargerSettings, bus: MqttSettings) -> list[tuple[str, str]]:
    """Return the rows that `check` prints instead of a wiring table. Each row is a subject and its
    meaning."""
    rows = [
        (f"topic {name}", f"{state.topic}, unknown after {state.stale_after_s:g} s")
        for name, state in settings.topics.items()
    ]
    for name in COMMANDS:
        if message := settings.command(name):
            text = f"{message.topic} {message.payload or '(empty)'}"
            often = f", {json_station.how_often(settings)}" if name == "clear_error" else ""
            rows.append((name.replace("_", " "), text + often))
    return [*rows, *json_station.power_off(settings, bus.scan_s), *json_station.rows(settings)]


class MqttStation:
    """Access to a station by MQTT messages (`drivers.charger.json_station.JsonStation`)."""

    def __init__(self, settings: MqttChargerSettings, bus: MqttBus) -> None:
        self._settings = settings
        self._bus = bus
        self._asks = {state.ask for state in settings.topics.values() if state.ask}
        for state in settings.topics.values():
            for place in (state, state.availability):
                if place:
                    bus.listen(place.topic)

    def await_first(self) -> None:
        """Wait until the station has had time to publish its first states. Raises HalError if no broker
        is connected."""
        topics = [state.topic for state in self._settings.topics.values()]
        self._bus.await_first(topics, self._asks)

    def answer(self) -> Mapping[str, object]:
        """Return the last message on each topic. The keys are the topics' names in the YAML."""
        self._bus.ask(self._asks)
        return {
            name: decoded(
                self._bus.believed(state.topic, state.stale_after_s, state.availability).payload
            )
            for name, state in self._settings.topics.items()
        }

    def send(self, name: StationCommand, safe: bool = False) -> None:
        """Send this command once, if the station has it."""
        if message := self._settings.command(name):
            self._bus.publish(message.topic, message.payload, message.qos, safe)


class MqttCharger(JsonCharger):
    """The driver of one station (`drivers.Driver`)."""

    def __init__(self, settings: MqttChargerSettings, station: MqttStation) -> None:
        super().__init__(settings, station)
        self._first = station

    def open(self) -> None:
        """Wait for the station's first states. Send nothing, because a restart must not end a
        charge."""
        self._first.await_first()


def create(name: str, settings: MqttChargerSettings, bus: MqttBus) -> MqttCharger:
    """Make the station's driver on its bus. The driver sends nothing before `open`."""
    return MqttCharger(settings, MqttStation(settings, bus))


DRIVER = DriverType(
    settings=MqttChargerSettings,
    buses=("mqtt",),
    create=create,
    describe=describe,
    claims=claims,
    warnings=json_station.warnings,
    unwired=lambda settings: (POWER,) if settings.start else (),
    fake="hal_fakes.mqtt_charger",
)

"""MQTT: contacts and relays behind a broker, and topics for drivers of their own.

    settings.py  the bus in the YAML
    points.py    one contact or relay in the YAML
    topics.py    topics and messages in the YAML
    makes.py     the topics of well-known makes, for `profile`
    bus.py       one broker for the drivers: listening, publishing, ages, backoff
    lines.py     one device's contacts and relays: claim, read, write, read back, renew, release
    link.py      one connection through paho-mqtt

Only link.py imports paho-mqtt.
"""

from drivers.hal import BusType
from drivers.hal.mqtt.bus import Heard, MqttBus, open_bus
from drivers.hal.mqtt.settings import (
    MqttSettings,
    claims,
    needs,
    place,
    tables,
    unfit,
    warnings,
    where,
    wire_problems,
)

__all__ = ["BUS", "Heard", "MqttBus", "MqttSettings"]

BUS = BusType(
    settings=MqttSettings,
    open_bus=open_bus,
    fake="hal_fakes.mqtt",
    where=where,
    needs=needs,
    warnings=warnings,
    wire_problems=wire_problems,
    unfit=unfit,
    place=place,
    tables=tables,
    claims=claims,
)

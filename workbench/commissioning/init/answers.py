"""The user's answers, from which `init` drafts a YAML."""

from collections.abc import Mapping
from typing import Final, Literal

import msgspec

Kind = Literal["lift", "door", "charger", "alarm", "dispenser", "ingestor", "fleet"]
Wiring = Literal["gpio", "modbus", "rs485", "http", "can", "mqtt", "gateway"]
Encoding = Literal["binary", "gray", "one_hot"]
Level = Literal["high", "low"]

LIFT_INPUTS: Final = (
    *("fire_alarm", "code_blue", "earthquake", "emergency", "out_of_service", "manual_mode"),
    *("overload", "agv_mode", "door_opened", "door_closed", "stopped"),
)
"""Possible inputs of a lift."""
OFFERED: Final = ("fire_alarm", "agv_mode", "door_opened", "door_closed", "stopped")


class Impossible(Exception):
    """An error if answers contradict each other. The error's text gives the reason and the remedy."""


class DraftAnswers(msgspec.Struct, frozen=True, kw_only=True):
    """The device to be connected, as the integrator describes it.

    - `address`: host, serial port or CAN interface; "" for the usual address.
    - `floors`: RMF's names of the floors, from the lowest floor up.
    - `signals`: a lift's inputs.
    - `contacts`: the level of a closed contact on the header. A wire to 3.3 V gives high, and a wire to
      ground gives low.
    - `relays`: the level that switches relays on.
    - `fleet_config`, `graph`: RMF's files of a fleet.
    - `places`: a gateway's answers, with the names in `gateway.py`.
    """

    kind: Kind
    name: str
    wiring: Wiring
    address: str = ""
    unit: int = 1
    domain_id: int = 0
    floors: tuple[str, ...] = ("L1", "L2", "L3")
    signals: tuple[str, ...] = OFFERED
    encoding: Encoding = "binary"
    contacts: Level = "high"
    relays: Level = "high"
    fleet_config: str = "config.yaml"
    graph: str = "nav_graph.yaml"
    places: Mapping[str, str] = {}

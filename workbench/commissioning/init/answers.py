"""The answers that a draft is made from."""

from typing import Final, Literal

import msgspec

Kind = Literal["lift", "door", "charger"]
Wiring = Literal["gpio", "modbus", "rs485", "http", "can"]
Encoding = Literal["binary", "gray", "one_hot"]
Level = Literal["high", "low"]

LIFT_INPUTS: Final = (
    *("fire_alarm", "code_blue", "earthquake", "emergency", "out_of_service", "manual_mode"),
    *("overload", "agv_mode", "door_opened", "door_closed", "stopped"),
)
"""The inputs that a lift may have."""
OFFERED: Final = ("fire_alarm", "agv_mode", "door_opened", "door_closed", "stopped")


class Impossible(Exception):
    """These answers do not go together. The text says why and what to do."""


class DraftAnswers(msgspec.Struct, frozen=True, kw_only=True):
    """What stands in front of the integrator.

    `address`: host, serial port or CAN interface; "" for the usual one. `floors`: RMF's names, from
    below. `signals`: a lift's inputs. `contacts`: the level of a closed contact on the header: high
    where it leads to 3.3 V, low where it leads to ground. `relays`: the level that switches them on.
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

"""The far side of a `can` bus, across processes: controllers behind an slcan adapter on a pty.

How the bus fails is in `hal_fakes/can/side.py`, how a CANopen receiver does in `canopen_rcu.py`, and a
charger with frames of its own in `frame_charger.py`.
"""

from collections.abc import Mapping
from typing import Any, Final

from hal_fakes.can.canopen_rcu import CanOpenRcu
from hal_fakes.can.frame_charger import FrameCharger
from hal_fakes.can.side import CanSide, Station
from hal_fakes.can.slcan_port import SlcanPort
from hal_fakes.plants.plant import Plant
from hal_fakes.wiring import devices_on

SLOWNESS: Final = 1.5
"""How many of the client's time limits a slow answer takes."""


def serve(settings: Any, plants: Mapping[str, Plant], config: Any, bus_name: str) -> CanSide:
    """Serve the chargers of this bus on a pseudo-terminal."""
    slow_s = SLOWNESS * settings.timeout_s
    stations = [
        station(plants[name], device, slow_s)
        for name, device in devices_on(config, bus_name).items()
    ]
    place = settings.slcan
    known = {name: getattr(place, name) for name in place.__struct_fields__} if place else {}
    return CanSide(SlcanPort(known), stations, slow_s)


def station(plant: Plant, settings: Any, slow_s: float) -> Station:
    """The controller that a device's settings speak of."""
    if hasattr(settings, "node"):
        return CanOpenRcu(plant, settings.node, slow_s)
    return FrameCharger(plant, settings)

"""The checks in turn: functions in `guest/`."""

from typing import Final

LIFT: Final = ("install.package", "install.lift")
DEATHS: Final = (
    "deaths.kill_9",
    "deaths.hang",
    "deaths.crash",
    "deaths.out_of_memory",
    "deaths.clean_stop",
    "deaths.two_on_one_pin",
)
SERVICES: Final = ("wires.door_service", "wires.charger_service")
WIRES: Final = (
    "wires.door",
    "wires.door_killed",
    "wires.adapter_pulled",
    "wires.charge",
    "wires.charger_killed",
    "wires.interface_down",
    "wires.bus_off",
)
WORLD: Final = ("install.wrong_yaml", "install.recorder")
PARTS: Final = {
    "": (*LIFT, *DEATHS, *SERVICES, *WIRES, *WORLD),
    "deaths": (*LIFT, *DEATHS),
    "wires": ("install.package", *SERVICES, *WIRES),
    "world": ("install.package", *WORLD),
}
"""The whole, and its parts, each with what it needs."""

"""The checks in turn: functions in `guest/`, and what the host does to the machine between them."""

from typing import Final

REBOOT: Final = "deaths: reboot"
CUT: Final = "deaths: power cut"
LIFT: Final = ("install.package", "install.lift")
DEATHS: Final = (
    "deaths.kill_9",
    "deaths.hang",
    "deaths.crash",
    "deaths.out_of_memory",
    "deaths.clean_stop",
    "deaths.two_on_one_pin",
    "deaths.energised",
    CUT,
    "deaths.off_at_boot",
    "deaths.equipment",
    "deaths.energised",
    REBOOT,
    "deaths.off_at_boot",
    "deaths.equipment",
    "deaths.active_low",
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
WORLD: Final = (
    "install.wrong_yaml",
    "rides.ride",
    "install.supervisors",
    "install.recorder",
    "install.page",
    "install.security",
    "figures.memory",
    "figures.empty",
    "world.edited_yaml",
    "world.labels",
    "world.clock",
    "world.full_run",
    "world.read_only_root",
    "world.network",
    "install.upgrade",
    "world.said",
)
PARTS: Final = {
    "": (*LIFT, *DEATHS, *SERVICES, *WIRES, *WORLD),
    "deaths": (*LIFT, *DEATHS),
    "wires": ("install.package", *SERVICES, *WIRES),
    "world": (*LIFT, *SERVICES, *WORLD),
}
"""The whole, and its parts, each with what it needs."""

"""The checks, in turn: functions in `guest/`, and what the host does to the machine between them."""

from typing import Final

REBOOT: Final = "deaths: reboot"
CUT: Final = "deaths: power cut"
FIRST: Final = ("install.package", "install.lift")
"""What the others need."""
ORDER: Final = (
    *FIRST,
    "install.wrong_yaml",
    "rides.ride",
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
    "deaths.active_low",
    "wires.door_service",
    "wires.door",
    "wires.door_killed",
    "wires.adapter_pulled",
    "wires.charger_service",
    "wires.charge",
    "wires.charger_killed",
    "wires.interface_down",
    "wires.bus_off",
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

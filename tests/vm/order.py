"""The checks, in turn: functions in `guest/`, and what the host does to the machine between them."""

from typing import Final

REBOOT: Final = "reboot"
CUT: Final = "power cut"
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
    "install.door",
    "install.charger",
    "rides.door",
    "deaths.door_killed",
    "rides.adapter_pulled",
    "rides.charge",
    "deaths.charger_killed",
    "rides.interface_down",
    "rides.bus_off",
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

"""The checks in turn: functions in `guest/`, and what the host does to the machine between them."""

from typing import Final

CUT: Final = "power cut"
REBOOT: Final = "reboot"
LIFT: Final = ("install.package", "install.lift")
PARTS: Final = {
    "lift": (
        *LIFT,
        "rides.ride",
        "deaths.hang",
        "deaths.crash",
        "deaths.out_of_memory",
        "deaths.clean_stop",
        "deaths.two_on_one_pin",
        "world.labels",
        "world.said",
        "boots.energised",
        CUT,
        "boots.off",
        "boots.energised",
        REBOOT,
        "boots.off",
        "world.clock",
        "install.upgrade",
    ),
    "site": (
        *LIFT,
        "deaths.kill_9",
        "world.edited_yaml",
        "world.full_run",
        "world.read_only_root",
        "boots.active_low",
        "wires.door_service",
        "wires.charger_service",
        "wires.door",
        "wires.door_killed",
        "wires.adapter_pulled",
        "wires.charge",
        "wires.charger_killed",
        "wires.interface_down",
        "wires.bus_off",
        "network.late",
        "install.wrong_yaml",
        "install.recorder",
        "install.supervisors",
        "figures.memory",
        "figures.ratios",
        "install.page",
        "install.security",
    ),
}
"""Each is one machine from its first boot on: a check may need those before it."""
WHOLE: Final = ("lift", "site")
"""The parts that have every check: they run side by side."""

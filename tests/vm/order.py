"""The order of the checks. A check is a function in `guest/`. Between two checks, the host may cut the
machine's power or restart the machine."""

import os
from typing import Final

CUT: Final = "power cut"
REBOOT: Final = "reboot"
CUT_OFF: Final = "upgrades.cut"
"""A check that cuts the power from inside the machine, at a random moment."""
CUTS: Final = int(os.environ.get("CUTS", "3"))
"""The number of power cuts. Each cut takes a boot and two upgrades, which is minutes on a busy host."""
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
        "boots.active_low",
        "boots.energised",
        CUT,
        "boots.off",
        "boots.energised",
        REBOOT,
        "boots.off",
        "world.clock",
        "network.late",
        "install.upgrade",
    ),
    "site": (
        *LIFT,
        "deaths.phases",
        "world.edited_yaml",
        "world.full_run",
        "world.read_only_root",
        "wires.door_service",
        "wires.charger_service",
        "wires.door",
        "wires.door_killed",
        "wires.adapter_pulled",
        "wires.charge",
        "wires.charger_killed",
        "wires.interface_down",
        "wires.bus_off",
        "install.wrong_yaml",
        "install.recorder",
        "install.supervisors",
        "figures.memory",
        "figures.ratios",
        "install.page",
        "install.security",
    ),
    "upgrade": (
        *LIFT,
        "wires.door_service",
        "wires.charger_service",
        "install.supervisors",
        "upgrades.site",
        CUT,
        "upgrades.booted",
        "upgrades.full_var",
        "upgrades.refused",
        "upgrades.absent",
        "upgrades.back",
        *(CUT_OFF, "upgrades.completed") * CUTS,
        "upgrades.purged",
    ),
}
"""The name of each part of the tests, with its checks. All checks of a part run on one machine, in this
order. A check may need the result of an earlier check."""
WHOLE: Final = ("lift", "site", "upgrade")
"""The parts that together have every check. They run at the same time."""
ALSO: Final = {("arm64", "lift"): ("inside.demo", "inside.transport")}
"""Additional checks for arm64, because most contributors' own machines are amd64."""
NOT_ON: Final = {"arm64": ("network.late",)}
"""Checks that do not run on arm64. In this check on arm64, zenoh would need a router to find another
machine."""

"""The stories of the troubles in `expected.toml`. After each story, a person runs `explain`."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from tests.workbench.troubles import chargers, doors, lifts
from tests.workbench.troubles.site import DOOR, Site
from tests.workbench.troubles.site import LIFT as LIFT1

Stage = Callable[[Site], Mapping[str, str] | None]
"""A function that stages a trouble. The function may return node names, which fill the places in braces
in the verdict's texts."""


@dataclass(frozen=True)
class Trouble:
    """One trouble.

    - `daemon`: the daemon whose file `explain` reads; "" for the device's own daemon.
    - `note`: a person's note. With a note, the person asks for the file, because the recorder writes
      none.
    - `mortal`: the daemon that the story kills.
    - `release`: whether the person types `rmf-bridge release`.
    """

    stage: Stage
    daemon: str = ""
    note: str = ""
    mortal: str = ""
    release: bool = False


LIVE, FILE = "live", "file"
LIFT, DOORS, CHARGER = "lift", "door", "charger"
TROUBLES: Final[Mapping[tuple[str, str, str], Trouble]] = {
    ("robot_dies_in_car", LIVE, LIFT): Trouble(lifts.robot_dies_in_car),
    ("robot_dies_in_car", FILE, LIFT): Trouble(lifts.robot_dies_in_car),
    ("robot_dies_in_car_b", LIVE, LIFT): Trouble(lifts.robot_dies_in_car_b),
    ("robot_dies_in_car_b", FILE, LIFT): Trouble(lifts.robot_dies_in_car_b),
    ("fire_mid_ride", LIVE, LIFT): Trouble(lifts.fire_mid_ride),
    ("fire_mid_ride", FILE, LIFT): Trouble(lifts.fire_mid_ride_to_its_end),
    ("fire_mid_ride_b", LIVE, LIFT): Trouble(lifts.fire_mid_ride_b),
    ("lift_door_contact_cut", LIVE, LIFT): Trouble(lifts.lift_door_contact_cut),
    ("lift_door_contact_cut", FILE, LIFT): Trouble(lifts.lift_door_contact_cut),
    ("door_end_contact_cut", LIVE, DOORS): Trouble(doors.open_contact_cut),
    ("door_end_contact_cut", FILE, DOORS): Trouble(doors.open_contact_cut),
    ("door_end_contact_cut_b", LIVE, DOORS): Trouble(doors.closed_contact_cut),
    ("door_end_contact_cut_b", FILE, DOORS): Trouble(doors.closed_contact_cut),
    ("supervisor_killed", LIVE, LIFT): Trouble(lifts.supervisor_killed),
    ("supervisor_killed", FILE, LIFT): Trouble(lifts.supervisor_killed),
    ("supervisor_killed_b", LIVE, LIFT): Trouble(lifts.supervisor_killed_b),
    ("supervisor_killed_b", FILE, LIFT): Trouble(lifts.supervisor_killed_b),
    ("rmf_silent_robot_asks", LIVE, LIFT): Trouble(lifts.rmf_silent_robot_asks),
    ("rmf_silent_robot_asks", FILE, LIFT): Trouble(lifts.rmf_silent_robot_asks),
    ("slow_modbus_unit", LIVE, LIFT): Trouble(lifts.slow_modbus_unit),
    ("slow_modbus_unit", FILE, LIFT): Trouble(lifts.slow_modbus_unit),
    ("slow_modbus_unit", LIVE, DOORS): Trouble(doors.slow_modbus_unit),
    ("two_daemons_one_name", LIVE, LIFT): Trouble(lifts.two_daemons_one_name),
    ("two_daemons_one_name", FILE, LIFT): Trouble(lifts.two_daemons_one_name),
    ("two_foreign_nodes", LIVE, LIFT): Trouble(lifts.two_foreign_nodes),
    ("two_foreign_nodes", FILE, LIFT): Trouble(
        lifts.two_foreign_nodes, daemon=lifts.SUPERVISOR, note="which node is Lift1?"
    ),
    ("robot_clock_hour_off", LIVE, LIFT): Trouble(lifts.robot_clock_hour_off),
    ("robot_clock_hour_off", FILE, LIFT): Trouble(lifts.robot_clock_hour_off),
    ("robot_clock_hour_off_b", LIVE, LIFT): Trouble(lifts.robot_clock_hour_off_b),
    ("daemon_killed", LIVE, LIFT): Trouble(lifts.daemon_killed, mortal=LIFT1),
    ("daemon_killed", FILE, LIFT): Trouble(lifts.daemon_killed, mortal=LIFT1),
    ("daemon_killed", LIVE, DOORS): Trouble(doors.daemon_killed, mortal=DOOR),
    ("daemon_killed", FILE, DOORS): Trouble(doors.daemon_killed, mortal=DOOR),
    ("daemon_killed", LIVE, CHARGER): Trouble(chargers.daemon_killed),
    ("robot_never_reaches_charger", LIVE, CHARGER): Trouble(chargers.robot_never_comes),
    ("robot_never_reaches_charger", FILE, CHARGER): Trouble(chargers.robot_never_comes_in_time),
    ("fleet_adapter_killed", LIVE, LIFT): Trouble(lifts.fleet_adapter_killed),
    ("fleet_adapter_killed", FILE, LIFT): Trouble(
        lifts.fleet_adapter_killed, note="red stands in the car"
    ),
    ("human_mode_with_fault", LIVE, LIFT): Trouble(lifts.human_mode_with_fault),
    ("human_mode_relays_off", FILE, LIFT): Trouble(lifts.human_mode_relays_off),
    ("human_mode_asked", LIVE, LIFT): Trouble(lifts.human_mode_asked),
    ("door_merely_closes", LIVE, DOORS): Trouble(doors.door_merely_closes),
    ("robot_in_doorway", LIVE, DOORS): Trouble(doors.robot_in_doorway),
    ("door_supervisor_dead_doorway", LIVE, DOORS): Trouble(doors.supervisor_dead_doorway),
    ("release_other_robot_takes_it", LIVE, LIFT): Trouble(lifts.robot_dies_in_car, release=True),
}

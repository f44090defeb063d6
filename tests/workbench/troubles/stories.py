"""Each trouble of `expected.toml`, staged at the site up to the moment when somebody asks."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from tests.workbench.troubles.site import LIFT, Site

IN_CAR: Final = "the robot stands in the car"


@dataclass(frozen=True)
class Trouble:
    """`stage`: what happens; gives the names of nodes, for the places in braces. `daemon`: whose file
    it is, if not the device's. `note`: of a person who asks for a file. `mortal`: who is killed."""

    stage: Callable[[Site], Mapping[str, str] | None]
    daemon: str = ""
    note: str = ""
    mortal: str = ""


def robot_dies_in_car(site: Site) -> None:
    """Its adapter speaks for it no longer, and goes on for another robot."""
    site.boards(site.red, "L1", "L3")
    site.run(4.0)
    site.blue.asks(LIFT, "L1")
    site.until(site.red)
    site.run(2.0)
    site.trouble_begins()
    site.red.is_dropped()
    site.run(120.0)


def robot_dies_in_car_b(site: Site) -> None:
    """Its adapter does not notice."""
    site.boards(site.red, "L1", "L3")
    site.run(4.0)
    site.trouble_begins()
    site.blue.asks(LIFT, "L1")
    site.until(site.red)
    site.run(150.0)


def lift_door_contact_cut(site: Site) -> None:
    """The door's 'opened' wire is cut during a ride."""
    site.boards(site.red, "L1", "L3")
    site.run(8.0)
    site.trouble_begins()
    site.fail(LIFT, "door_opened", "off")
    site.run(40.0)


LIVE, FILE = "live", "file"
TROUBLES: Final[Mapping[tuple[str, str, str], Trouble]] = {
    ("robot_dies_in_car", LIVE, "lift"): Trouble(robot_dies_in_car),
    ("robot_dies_in_car", FILE, "lift"): Trouble(robot_dies_in_car),
    ("robot_dies_in_car_b", LIVE, "lift"): Trouble(robot_dies_in_car_b),
    ("robot_dies_in_car_b", FILE, "lift"): Trouble(robot_dies_in_car_b),
    ("lift_door_contact_cut", LIVE, "lift"): Trouble(lift_door_contact_cut),
    ("lift_door_contact_cut", FILE, "lift"): Trouble(lift_door_contact_cut),
}

"""Troubles at a door: ward_door, under RMF's own supervisor."""

from typing import Final

from tests.workbench.troubles.site import DOOR, Site

SUPERVISOR: Final = "rmf_door_supervisor"


def open_contact_cut(site: Site) -> None:
    """The 'opened' wire is cut after three passages; a robot asks for OPEN."""
    _three_passages(site)
    site.trouble_begins()
    site.fail(DOOR, "opened", "off")
    site.red.opens(DOOR)
    site.run(60.0)


def closed_contact_cut(site: Site) -> None:
    """The 'closed' wire is cut in a passage after three others; the door is let go."""
    _three_passages(site)
    site.red.opens(DOOR)
    site.until(site.red)
    site.trouble_begins()
    site.fail(DOOR, "closed", "off")
    site.run(5.0)
    site.red.closes(DOOR)
    site.until(site.red)
    site.run(60.0)


def slow_modbus_unit(site: Site) -> None:
    """The door's unit answers now and then."""
    site.passes(site.red, DOOR)
    site.trouble_begins()
    site.slow(DOOR)
    site.run(10.0)
    site.red.opens(DOOR)
    site.run(40.0)


def daemon_killed(site: Site) -> None:
    """The door's daemon is killed while the door opens for a robot."""
    site.passes(site.red, DOOR)
    site.trouble_begins()
    site.red.opens(DOOR)
    site.run(2.0)
    site.kills(DOOR)
    site.run(30.0)


def door_merely_closes(site: Site) -> None:
    """A robot has passed, and its hold has just ended."""
    site.red.opens(DOOR)
    site.until(site.red)
    site.run(6.0)
    site.trouble_begins()
    site.red.closes(DOOR)
    site.until(site.red)


def robot_in_doorway(site: Site) -> None:
    """A robot's DoorOpen is over, and it stands in the doorway."""
    site.red.opens(DOOR)
    site.until(site.red)
    site.trouble_begins()
    site.run(60.0)


def supervisor_dead_doorway(site: Site) -> None:
    """The same, and the door supervisor has been killed."""
    robot_in_doorway(site)
    site.supervisors[SUPERVISOR].kill()
    site.run(30.0)


def supervisor_dead(site: Site) -> None:
    """The door supervisor has been killed; a robot asks for OPEN."""
    _three_passages(site)
    site.supervisors[SUPERVISOR].kill()
    site.trouble_begins()
    site.red.opens(DOOR)
    site.run(20.0)


def operator_dead(site: Site) -> None:
    """The operator does not move the leaf."""
    _three_passages(site)
    site.fail(DOOR, "operator", "off")
    site.trouble_begins()
    site.red.opens(DOOR)
    site.run(20.0)


def _three_passages(site: Site) -> None:
    for _ in range(3):
        site.passes(site.red, DOOR)

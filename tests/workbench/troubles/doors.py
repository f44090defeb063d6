"""Troubles at ward_door. RMF's own supervisor serves it."""

from typing import Final

from tests.workbench.troubles.site import DOOR, Site

SUPERVISOR: Final = "rmf_door_supervisor"


def open_contact_cut(site: Site) -> None:
    """Cut the 'opened' wire after three passages, and let a robot ask for OPEN."""
    _three_passages(site)
    site.trouble_begins()
    site.fail(DOOR, "opened", "off")
    site.red.opens(DOOR)
    site.run(60.0)


def closed_contact_cut(site: Site) -> None:
    """Cut the 'closed' wire in the fourth passage, and let the robot release the door."""
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
    """Make the door's Modbus unit slow, so that it answers in time only sometimes."""
    site.passes(site.red, DOOR)
    site.trouble_begins()
    site.slow(DOOR)
    site.run(10.0)
    site.red.opens(DOOR)
    site.run(40.0)


def daemon_killed(site: Site) -> None:
    """Kill the door's daemon while the door opens for a robot."""
    site.passes(site.red, DOOR)
    site.trouble_begins()
    site.red.opens(DOOR)
    site.run(2.0)
    site.kills(DOOR)
    site.run(30.0)


def door_merely_closes(site: Site) -> None:
    """Let a robot pass, and stop just after the robot has closed the door."""
    site.red.opens(DOOR)
    site.until(site.red)
    site.run(6.0)
    site.trouble_begins()
    site.red.closes(DOOR)
    site.until(site.red)


def robot_in_doorway(site: Site) -> None:
    """Let a robot stop in the doorway after its DoorOpen has ended."""
    site.red.opens(DOOR)
    site.until(site.red)
    site.trouble_begins()
    site.run(60.0)


def supervisor_dead_doorway(site: Site) -> None:
    """Let a robot stop in the doorway after its DoorOpen. Then kill the door supervisor."""
    robot_in_doorway(site)
    site.supervisors[SUPERVISOR].kill()
    site.run(30.0)


def supervisor_dead(site: Site) -> None:
    """Kill the door supervisor. Then let a robot ask for OPEN."""
    _three_passages(site)
    site.supervisors[SUPERVISOR].kill()
    site.trouble_begins()
    site.red.opens(DOOR)
    site.run(20.0)


def operator_dead(site: Site) -> None:
    """Let the door operator fail, so that the door does not move. Then let a robot ask for OPEN."""
    _three_passages(site)
    site.fail(DOOR, "operator", "off")
    site.trouble_begins()
    site.red.opens(DOOR)
    site.run(20.0)


def _three_passages(site: Site) -> None:
    for _ in range(3):
        site.passes(site.red, DOOR)

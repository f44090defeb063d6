"""Troubles at the charging station charger_a. Our coordinator serves it."""

from tests.workbench.troubles.site import CHARGER, Site


def daemon_killed(site: Site) -> None:
    """Kill the station's daemon while a robot charges."""
    site.coordinates()
    site.fleet.robots.charge("red", site.fleet.wall())
    site.run(40.0)
    site.press(CHARGER, "robot", True)
    site.run(30.0)
    site.trouble_begins()
    site.kills(CHARGER)
    site.run(30.0)


def robot_never_comes(site: Site) -> None:
    """Let the coordinator grant the station to a robot that does not drive."""
    site.coordinates()
    site.trouble_begins()
    site.fleet.robots.robots["red"].stuck = True
    site.fleet.robots.charge("red", site.fleet.wall())
    site.run(75.0)


def robot_never_comes_in_time(site: Site) -> None:
    """Let the coordinator grant the station to a robot that does not drive. Stop shortly before
    start_timeout."""
    robot_never_comes(site)
    site.run(200.0)
    site.trouble_begins()

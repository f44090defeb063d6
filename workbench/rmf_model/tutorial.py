"""A fleet started from its adapter's configuration file, as RMF's tutorial shapes it."""

from collections.abc import Collection
from pathlib import Path
from typing import cast, get_args

from bridges.settings.fleet_config import load_fleet
from workbench.rmf_model.fleet import Finishing, Fleet, Graph


def tutorial_fleet(file: Path, graph: Graph, drive_s: float, only: Collection[str] = ()) -> Fleet:
    """The file's fleet, each robot at its charger's waypoint. Raises SettingsError, or ValueError.

    `graph`: its navigation graph. `drive_s`: how long every way takes. `only`: these robots; all of the
    file when empty.
    """
    found = load_fleet(str(file))
    places: dict[str, str] = {}
    for _, name, robot in found.robots():
        _, waypoint = robot.waypoint()
        if only and name not in only:
            continue
        if waypoint is None or waypoint not in graph:
            raise ValueError(f"{file}: '{name}' has its charger at {waypoint!r}, not in the graph")
        places[name] = waypoint
    request = found.fleet.finishing_request or "nothing"
    if request not in get_args(Finishing):
        raise ValueError(f"{file}: no finishing_request {request!r}")
    return Fleet(found.fleet.name, graph, places, drive_s, cast(Finishing, request))

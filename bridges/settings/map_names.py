"""Compares the names in a device YAML with the names on RMF's map of the building.

RMF finds a lift, floor, door or charger only by its name. A wrong name causes no error in RMF. Instead
a robot waits for ever.
"""

from collections.abc import Iterator
from pathlib import Path

from bridges.kinds import kind_called
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.kind import CHARGER, DOOR, FLOOR, LIFT, WAYPOINT, Place
from bridges.settings.building_map import BuildingMap
from bridges.settings.load import Config
from bridges.yaml.parsing import Problem, YamlFile, compose
from bridges.yaml.positions import Spot, locate
from bridges.yaml.spelling import nearest, short


def places(config: Config) -> list[Place]:
    """Return every name in a file that RMF's map must have, with its path in the file."""
    kind = kind_called(config.kind)
    if isinstance(kind, GraphKind):
        found = kind.on_map(config.section)
        return [((kind.devices_key, *path), what, name) for path, what, name in found]
    all_places: list[Place] = []
    for name, settings in config.devices.items():
        top = (kind.devices_key, name)
        if config.kind in (LIFT, DOOR, CHARGER):
            all_places.append((top, config.kind, name))
        all_places += [((*top, *path), what, n) for path, what, n in kind.on_map(settings)]
    return all_places


def mismatches(config: Config, building: BuildingMap) -> list[Problem]:
    """Return a problem for each name in the file that the map lacks. Also return a problem for each
    stop of a lift on the map that the file lacks."""
    page = YamlFile(str(config.path))
    root = compose(page, config.text)
    top = Spot(root, root, "the file")
    found = places(config)
    for path, what, name in found:
        lift = path[1] if what == FLOOR else ""
        text = _missing(building, what, name, lift)
        if text:
            page.note(locate(top, path).key, text)
    for path, what, lift in found:
        if what == LIFT:
            ours = {name for p, w, name in found if w == FLOOR and p[:2] == path}
            for text in _not_served(building, lift, ours):
                page.note(locate(top, (*path, "floors")).key, text)
    return sorted(page.problems)


def _missing(building: BuildingMap, what: str, name: str, lift: str) -> str:
    """Return a problem with a suggestion if the map lacks the name; "" if the map has the name."""
    stops = building.stops.get(lift)
    known = building.named[what] if stops is None else stops
    if name in known:
        return ""
    where = Path(building.file).name
    if stops is not None:
        has = f"the lift '{short(lift)}' does not stop at '{short(name)}' on {where}"
        if name in building.named[FLOOR]:
            return f"{has}, though the map has that level (line {building.named[FLOOR][name]})"
    elif what == CHARGER and name in building.named[WAYPOINT]:
        line = building.named[WAYPOINT][name]
        return (
            f"{where}:{line}: the waypoint '{short(name)}' is not a charger: set is_charger: true"
        )
    else:
        has = f"{where} has no {what} '{short(name)}'"
    near = nearest(name, known)
    if near is not None:
        return f"{has}: did you mean '{short(near)}' (line {known[near]})?"
    return f"{has}: {_listed(known)}"


def _listed(known: dict[str, int]) -> str:
    if not known:
        return "it has none"
    some = ", ".join(map(short, list(known)[:12]))
    return f"it has {some}" + (f" and {len(known) - 12} more" if len(known) > 12 else "")


def _not_served(building: BuildingMap, lift: str, ours: set[str]) -> Iterator[str]:
    for floor, line in building.stops.get(lift, {}).items():
        if floor not in ours:
            where = Path(building.file).name
            yield (
                f"on {where} (line {line}) '{short(lift)}' also stops at '{short(floor)}': a robot"
                " sent there would always be refused. Add the floor, or remove the stop from the map"
            )

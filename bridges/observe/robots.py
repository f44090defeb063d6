"""The robots that our fleet daemons report, and the lifts, doors and chargers that a robot waits for or
uses."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple, TypeVar

from bridges.messages import words
from bridges.observe.charger import ObservedCharger
from bridges.observe.device import ObservedDevice, Wait
from bridges.observe.diagnosis import FLEET, Diagnosis
from bridges.observe.requesters import Moment

D = TypeVar("D", bound=ObservedDevice[Any])


class ObservedRobot(NamedTuple):
    """A robot as its daemon reports it. `who`: FLEET/ROBOT, as RMF's requests name it."""

    who: str
    said: Diagnosis
    daemon: Diagnosis | None


def robots(nodes: Mapping[str, Diagnosis]) -> Iterator[ObservedRobot]:
    """Yield the robots on which our daemons report, in the order of their names. `nodes`: the reports
    by `<node>: <robot>` (`ObservedGraph.nodes`)."""
    for name in sorted(nodes):
        node, _, robot = name.partition(": ")
        if nodes[name].kind == FLEET and robot != "daemon":
            daemon = nodes.get(f"{node}: daemon")
            fleet = daemon.value("fleet") if daemon else ""
            who = f"{fleet}/{robot}" if fleet else robot
            yield ObservedRobot(words.printable(who), nodes[name], daemon)


def waits(devices: Iterable[D], who: str, now: Moment) -> Iterator[tuple[D, Wait]]:
    """Yield each lift, door and charger for which this robot (FLEET/ROBOT) waits."""
    for device in devices:
        for one in device.waits(now):
            named = device.robot.value if isinstance(device, ObservedCharger) else one.who
            if named == who:
                yield device, one

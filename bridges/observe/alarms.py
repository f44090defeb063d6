"""The alarms that stop the robots of fleets. Our daemons state their alarms on `/diagnostics`. Other
nodes only publish alarm messages.

RMF's fleet adapters obey the last alarm message of any node. So a message `false` of any node also ends
the alarms of the other nodes. It does not end the alarms that our daemons state on `/diagnostics`.
"""

from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from typing import Final, Literal

from msgspec import Struct

from bridges.kinds.shared import alarming
from bridges.kinds.shared.alarming import CAUSES, FLEETS, RAISED, SINCE, STATE, fleets_in
from bridges.kinds.shared.fleet_alarm_memory import Fleets, overlap
from bridges.messages.definitions import EmergencySignal
from bridges.messages.heard import Heard
from bridges.messages.topics import EMERGENCY_SIGNAL
from bridges.messages.words import printable
from bridges.observe.diagnosis import Diagnosis
from bridges.observe.requesters import Moment

Actor = Literal["a person", "nobody"]
STANDS: Final = frozenset((*RAISED, "reset"))
PUBLISHED: Final = "published"
"""The state of an alarm that a node has published, but does not state on `/diagnostics`."""
UNKNOWN: Final = "an unknown node"
OLD_S: Final = 3.0
"""The time (s) after the start of listening in which a message may be old. A publisher may have
retained such a message."""
MOST: Final = 50


class ObservedAlarm(Struct, frozen=True):
    """The alarm of a node.

    - `state`: the statement on `/diagnostics` (`quiet`, `alarm`, `drill` or `reset`), or PUBLISHED
    - `fleets`: the names of the stopped fleets, or "" for all fleets
    - `current`: Does the daemon still state its alarm? If the daemon falls silent, its alarm stays
      valid.
    - `since`: the beginning of the state (s since the epoch), or None if unknown
    """

    node: str
    state: str
    causes: str
    fleets: str
    current: bool
    since: float | None = None

    @property
    def stands(self) -> bool:
        """Return whether this alarm makes robots stand still."""
        return self.state == PUBLISHED or self.state in STANDS

    @property
    def condition(self) -> str:
        """Return a few words about the alarm, such as `ALARM: fire_panel of Main panel; every fleet
        must stand still`."""
        if not self.stands:
            return "no alarm"
        words = {"alarm": f"ALARM: {self.causes}", "drill": "DRILL", "reset": "reset, waits"}
        word = words.get(self.state, f"ALARM on {self.causes}")
        return f"{word}; {self.fleets or 'every fleet'} must stand still"

    def because(self, clock: Callable[[float], str]) -> str:
        """Return one sentence that says why the robots must stand still. `clock(wall)` returns a time
        as text."""
        robots = f"Every robot of {self.fleets}" if self.fleets else "Every robot"
        at = "at an unknown time" if self.since is None else f"at {clock(self.since)}"
        silent = "" if self.current else ", and has been silent since its last statement"
        why = {
            "alarm": f"because {self.causes} raised an alarm {at} and nobody has reset {self.node}",
            "drill": f"for a drill of {self.node}, which began {at} and ends by itself",
            "reset": f"until another alarm ends, although {self.node} was reset {at}",
        }.get(self.state, f"because {self.node} published an alarm on {self.causes} {at}")
        return f"{robots} must stand still {why}{silent}."

    @property
    def ends(self) -> tuple[Actor, str]:
        """Return who can let the robots drive again (`a person` or `nobody`), and what this person must
        do."""
        reset = f"when the cause is over and it is safe: `rmf-bridge reset FILE` for {self.node}"
        if self.state == "drill":
            return "nobody", "the drill ends by itself"
        return "a person", {
            "alarm": reset,
            "reset": "end the other alarms: `rmf-bridge watch` shows them",
        }.get(self.state, f"end the alarm of {self.node}, where it was raised")


class PublishedAlarms:
    """The alarms that nodes have published, by the node's name.

    A message `false` ends the alarms of all nodes, as in RMF, where it lets the robots drive. Within
    OLD_S after the start of listening a `false` may be an old, retained message. Therefore it then ends
    only the alarm of its own sender.
    """

    def __init__(self) -> None:
        self.found: dict[str, tuple[str, Fleets, Moment]] = {}

    def hear(self, heard: Heard, moment: Moment, began: float) -> None:
        """Note the message if it is about an alarm."""
        topic, message = heard.topic.rpartition("/")[2], heard.message
        if not alarming.is_alarm(topic, message):
            return
        node = printable(heard.sender.node.lstrip("/")) if heard.sender else ""
        event, old = alarming.heard(message, [node]), moment.at - began < OLD_S
        if event.on:
            if node not in self.found and len(self.found) < MOST:
                named = EMERGENCY_SIGNAL.name if isinstance(message, EmergencySignal) else topic
                since = Moment(moment.at, moment.wall, seen=not old)
                self.found[node] = named, event.fleets, since
            return
        for name, (_, stand, _) in [*self.found.items()]:
            if overlap(stand, event.fleets) and (name == node or not old):
                del self.found[name]


def alarms(
    nodes: Mapping[str, Diagnosis], published: PublishedAlarms, now: float
) -> Iterator[ObservedAlarm]:
    """Yield the stated alarm of each daemon that may raise an alarm, and the published alarm of each
    other node. `nodes` maps the name `<node>: daemon` to the daemon's report."""
    stated = set()
    for name, said in sorted(nodes.items()):
        if STATE in said.values:
            told = ", ".join(sorted(fleets_in(said.value(FLEETS))))
            state, causes = said.value(STATE), printable(said.value(CAUSES))
            node, since = printable(name.rpartition(": ")[0]), _wall(said.value(SINCE))
            stated.add(node)
            current = said.is_current(now)
            yield ObservedAlarm(node, state, causes, printable(told), current, since)
    for node, (topic, fleets, at) in sorted(published.found.items()):
        if node not in stated and (node or not stated):
            told = printable(", ".join(sorted(fleets)))
            wall = at.wall if at.seen else None
            yield ObservedAlarm(node or UNKNOWN, PUBLISHED, topic, told, True, wall)


def _wall(text: str) -> float | None:
    try:
        return datetime.fromisoformat(text).timestamp()
    except ValueError:
        return None

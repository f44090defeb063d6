"""The alarms for fleets, as our daemons state them on `/diagnostics`."""

from collections.abc import Iterator, Mapping
from typing import Final

from msgspec import Struct

from bridges.kinds.shared.alarming import CAUSES, FLEETS, RAISED, STATE, fleets_in
from bridges.messages.words import printable
from bridges.observe.diagnosis import Diagnosis

STANDS: Final = frozenset((*RAISED, "reset"))


class ObservedAlarm(Struct, frozen=True):
    """The alarm of a daemon, as the daemon states it.

    `state`: `quiet`, `alarm`, `drill` or `reset`. `fleets`: the names of the fleets, or "" for all
    fleets. `current`: False if the daemon has fallen silent. An alarm does not end when its daemon
    falls silent.
    """

    node: str
    state: str
    causes: str
    fleets: str
    current: bool

    @property
    def stands(self) -> bool:
        """Return whether robots stand because of this alarm."""
        return self.state in STANDS

    @property
    def condition(self) -> str:
        """A few words on the alarm, such as `ALARM: fire_panel of Main panel; every fleet is to
        stand`."""
        if not self.stands:
            return "no alarm"
        word = {"alarm": f"ALARM: {self.causes}", "drill": "DRILL"}.get(self.state, "reset, waits")
        return f"{word}; {self.fleets or 'every fleet'} is to stand"

    @property
    def because(self) -> str:
        """A sentence that says why the robots stand."""
        robots = f"Every robot of {self.fleets}" if self.fleets else "Every robot"
        silent = "" if self.current else ", whose daemon has been silent since then"
        why = {
            "alarm": f"because {self.causes} raised an alarm and nobody has reset {self.node}",
            "drill": f"for a drill of {self.node}, which ends by itself",
        }.get(self.state, f"until another alarm ends: {self.node} was reset")
        return f"{robots} is to stand {why}{silent}."


def alarms(nodes: Mapping[str, Diagnosis], now: float) -> Iterator[ObservedAlarm]:
    """Yield the alarm of each daemon that may raise an alarm. `nodes`: each daemon's report on itself,
    by `<node>: daemon`."""
    for name, said in sorted(nodes.items()):
        if STATE in said.values:
            told = ", ".join(sorted(fleets_in(said.value(FLEETS))))
            state, causes = said.value(STATE), printable(said.value(CAUSES))
            node = printable(name.rpartition(": ")[0])
            yield ObservedAlarm(node, state, causes, printable(told), said.is_current(now))

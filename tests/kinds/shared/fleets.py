"""Alarms for fleets on one ROS graph, in virtual time: several daemons, a stranger, and the fleets'
robots.

The stranger is a node that is not ours. The messages of the daemons and of the stranger reach everybody
at once. A daemon writes its memory to its disk before it publishes. Each robot obeys the last message
for its fleet.
"""

from collections.abc import Mapping
from typing import Any

import msgspec
from msgspec.structs import replace

from bridges.kinds.shared import alarming, fleet_alarm, kept_alarm
from bridges.kinds.shared.decision import AlarmInputs, DrillOrdered, OperatorReset, Said
from bridges.kinds.shared.durations import NEVER
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmHeard,
    AlarmStated,
    DeviceTells,
    FleetAlarmLimits,
    FleetAlarmMemory,
    FleetAlarmReport,
    Fleets,
)
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.topics import EMERGENCY_SIGNAL, FIRE_ALARM_TRIGGER

STRANGER = "stranger"
QUIET_S = 3.0


class DaemonSeen(msgspec.Struct, frozen=True):
    """A daemon with its disk.

    `present` has the causes of an alarm at its only device. `retained` has its messages that late nodes
    still get. `memory` is None if the daemon is dead. `faults` has the codes of its last report.
    """

    memory: FleetAlarmMemory | None = None
    disk: bytes | None = None
    present: frozenset[str] = frozenset()
    drill: bool = False
    seen: bool = True
    retained: tuple[bool, ...] = ()
    fleets: Fleets = frozenset()
    state: str = "quiet"
    faults: tuple[str, ...] = ()
    started_at: float = 0.0
    wake_at: float = NEVER


class AlarmGraph(msgspec.Struct, frozen=True):
    """The ROS graph with its daemons and fleets.

    - `stands` says for each fleet whether its robots must stand still by the last message.
    - `said` has every message of a daemon, as (s, daemon, value, fleets).
    - `stranger` says that the stranger's last message was an alarm.
    - `path` has the names of the test's moves so far.
    """

    daemons: Mapping[str, DaemonSeen]
    stands: Mapping[str, bool]
    now: float = 0.0
    stranger: bool = False
    stranger_spoke: bool = False
    stranger_fleets: Fleets = frozenset()
    said: tuple[tuple[float, str, bool, tuple[str, ...]], ...] = ()
    path: tuple[str, ...] = ()

    # ---- events

    def tells(
        self, name: str, *present: str, drill: bool = False, seen: bool = True
    ) -> "AlarmGraph":
        """Change the causes of an alarm at this daemon's only device."""
        daemon = replace(self.daemons[name], present=frozenset(present), drill=drill, seen=seen)
        return self._with(name, daemon)._inputs(name)

    def resets(self, name: str) -> "AlarmGraph":
        """Reset this daemon, as a person does."""
        return self._decides(name, OperatorReset())

    def drills(self, name: str, for_s: float) -> "AlarmGraph":
        """Order a drill of `for_s` seconds, as a person does. With 0 the drill ends."""
        return self._decides(name, DrillOrdered(for_s))

    def kill(self, name: str) -> "AlarmGraph":
        """Kill this daemon. Its retained messages disappear too."""
        return self._with(name, replace(self.daemons[name], memory=None, retained=()))

    def start(self, name: str) -> "AlarmGraph":
        """Start this daemon. It reads its disk, and hears the retained messages of the other nodes."""
        daemon = self.daemons[name]
        memory = fleet_alarm.initial() if daemon.disk is None else kept_alarm.restore(daemon.disk)
        graph = self._with(name, replace(daemon, memory=memory, started_at=self.now))
        graph = graph._decides(name, MaySpeak(False))
        for other, one in self.daemons.items():
            for on in one.retained if other != name else ():
                graph = graph._decides(name, AlarmHeard(frozenset({other}), on, one.fleets))
        if self.stranger_spoke:
            heard = AlarmHeard(frozenset({STRANGER}), self.stranger, self.stranger_fleets)
            graph = graph._decides(name, heard)
        return graph._inputs(name)

    def stranger_says(self, on: bool, *fleets: str) -> "AlarmGraph":
        """Let the stranger publish an alarm (`on`) or the end of its alarm for these fleets."""
        told = frozenset(fleets)
        graph = replace(self, stranger=on, stranger_spoke=True, stranger_fleets=told)
        return graph._deliver(STRANGER, on, frozenset(fleets))

    def until(self, at: float) -> "AlarmGraph":
        """Let time pass until `at`. Each daemon wakes up when it wants to, and states its alarm each
        second. Its quiet start ends after QUIET_S."""
        graph = self
        while graph.now < at:
            graph = replace(graph, now=min(at, graph.now + 0.1))
            for name in graph.daemons:
                graph = graph._passes(name)
        return graph

    # ---- private functions

    def _passes(self, name: str) -> "AlarmGraph":
        graph, daemon = self, self.daemons[name]
        if daemon.memory is None:
            return self
        if not daemon.memory.may_end and self.now >= daemon.started_at + QUIET_S:
            graph = graph._decides(name, MaySpeak(True))
        if daemon.wake_at <= self.now:
            graph = graph._decides(name, Woken())
        if round(self.now, 1) % 1.0 == 0:
            graph = graph._states(name)
        daemon = graph.daemons[name]
        assert daemon.memory is not None
        if daemon.memory.told is None and self.now - daemon.memory.ended_at > fleet_alarm.RENEW_S:
            graph = graph._with(name, replace(daemon, retained=()))
        return graph

    def _inputs(self, name: str) -> "AlarmGraph":
        daemon = self.daemons[name]
        inputs = AlarmInputs(daemon.present, daemon.seen, daemon.drill)
        return self._decides(name, DeviceTells("Panel", inputs))

    def _states(self, name: str) -> "AlarmGraph":
        daemon, graph = self.daemons[name], self
        raised = daemon.state in alarming.RAISED
        for other in self.daemons:
            if other != name:
                graph = graph._decides(other, AlarmStated(name, raised, daemon.fleets))
        return graph

    def _decides(self, name: str, event: Any) -> "AlarmGraph":
        daemon = self.daemons[name]
        if daemon.memory is None:
            return self
        topic = EMERGENCY_SIGNAL if daemon.fleets else FIRE_ALARM_TRIGGER
        limits = FleetAlarmLimits(topic, daemon.fleets, frozenset({"Panel"}))
        made = fleet_alarm.decide(daemon.memory, event, self.now, limits)
        assert made.wake_at > self.now
        report: FleetAlarmReport = made.report
        faults = tuple(fault.code for fault in report.faults)
        daemon = replace(
            daemon,
            memory=made.memory,
            disk=kept_alarm.persist(made.memory),
            state=report.state,
            faults=faults,
            wake_at=made.wake_at,
        )
        graph = self._with(name, daemon)
        for said in made.publish:
            graph = graph._published(name, said)
        return graph

    def _published(self, name: str, said: Said) -> "AlarmGraph":
        event = alarming.heard(said[1], [name])
        daemon = self.daemons[name]
        graph = self._with(name, replace(daemon, retained=(*daemon.retained, event.on)))
        told = (round(self.now, 1), name, event.on, tuple(sorted(event.fleets)))
        return replace(graph, said=(*graph.said, told))._deliver(name, event.on, event.fleets)

    def _deliver(self, sender: str, on: bool, fleets: Fleets) -> "AlarmGraph":
        stands = {f: on if not fleets or f in fleets else was for f, was in self.stands.items()}
        graph = replace(self, stands=stands)
        for other in self.daemons:
            if other != sender:
                graph = graph._decides(other, AlarmHeard(frozenset({sender}), on, fleets))
        return graph

    def _with(self, name: str, daemon: DaemonSeen) -> "AlarmGraph":
        return replace(self, daemons={**self.daemons, name: daemon})


def graph(**fleets: tuple[str, ...]) -> AlarmGraph:
    """Return a graph with a running daemon for each name in `fleets`.

    A daemon sends its alarms to its fleets. An empty tuple means all fleets.
    """
    daemons = {name: DaemonSeen(fleets=frozenset(told)) for name, told in fleets.items()}
    robots = {fleet for told in fleets.values() for fleet in told} or {"tiny"}
    made = AlarmGraph(daemons, dict.fromkeys(sorted(robots), False))
    for name in daemons:
        made = made.start(name)
    return made.until(5.0)

"""The events, the memory and the report of the alarm that one daemon raises for the fleets.

`fleet_alarm.py` has the rules.
"""

from collections.abc import Mapping

import msgspec

from bridges.kinds.shared.decision import AlarmInputs, DrillOrdered, Fault, OperatorReset
from bridges.kinds.shared.durations import AGES_AGO
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.definitions import Message
from bridges.messages.topics import Topic

Fleets = frozenset[str]
"""The fleets that are told; empty for all fleets."""


class DeviceTells(msgspec.Struct, frozen=True):
    """A device of this daemon reports its causes."""

    device: str
    inputs: AlarmInputs


class AlarmHeard(msgspec.Struct, frozen=True):
    """Another node has published an alarm, or its end. `senders`: the nodes that may have sent it."""

    senders: frozenset[str]
    on: bool
    fleets: Fleets = frozenset()


class AlarmNamed(msgspec.Struct, frozen=True):
    """The nodes that may have sent the messages of an unknown node. `unknown`: the name under which
    these messages were noted."""

    unknown: str
    senders: frozenset[str]


class AlarmStated(msgspec.Struct, frozen=True):
    """Another of our nodes states on `/diagnostics` whether its alarm is raised."""

    node: str
    raised: bool
    fleets: Fleets = frozenset()


FleetAlarmEvent = (
    DeviceTells
    | AlarmHeard
    | AlarmNamed
    | AlarmStated
    | MaySpeak
    | Woken
    | OperatorReset
    | DrillOrdered
)


class AlarmCause(msgspec.Struct, frozen=True, order=True):
    """A cause of an alarm: a device and its signal."""

    device: str
    signal: str

    def __str__(self) -> str:
        return f"{self.signal} of {self.device}"


class FleetAlarmLimits(msgspec.Struct, frozen=True):
    """The settings of the alarm: its topic, its fleets, and the devices that report causes."""

    topic: Topic[Message]
    fleets: Fleets = frozenset()
    devices: frozenset[str] = frozenset()


class FleetAlarmMemory(msgspec.Struct, frozen=True):
    """The memory of one daemon's alarm.

    `told`: the fleets to which we have published `true`; None if we have published no `true` since our
    last `false`. `told_at`, `ended_at`: the times of our last `true` and `false`. `owed`: our `true` no
    longer has an effect, so a raised alarm must be published again. `others`: for each other node whose
    alarm is not over, the fleets of that alarm. `ours`: for each other node of this project, the time
    of its last statement. `may_end`: the quiet start is over. `contradicted`: the nodes that published
    `false` against our alarm, and the time. `drill_until`: the end of the drill that a person has
    ordered. `shown`: the last decision's `state`. `since`: the time when that state began; None if it
    began before the daemon's start.
    """

    inputs: Mapping[str, AlarmInputs] = {}
    latched: tuple[AlarmCause, ...] = ()
    told: Fleets | None = None
    told_at: float = AGES_AGO
    ended_at: float = AGES_AGO
    owed: bool = False
    others: Mapping[str, Fleets] = {}
    ours: Mapping[str, float] = {}
    may_end: bool = False
    contradicted: tuple[str, float] = ("", AGES_AGO)
    drill_until: float = AGES_AGO
    shown: str = "quiet"
    since: float | None = None

    @property
    def drill(self) -> bool:
        """Return whether only a drill raises the alarm."""
        asked = any(inputs.drill for inputs in self.inputs.values())
        return not self.latched and (asked or self.drill_until > AGES_AGO)

    @property
    def raised(self) -> bool:
        """Return whether the robots of our fleets must be stopped, because of a cause or drill of this
        daemon."""
        return bool(self.latched) or self.drill

    @property
    def state(self) -> str:
        """Return `quiet`, `alarm`, `drill` or `reset`.

        In `reset` a person has reset our causes, but other nodes still publish `true`. We publish
        `false` (the end of the alarm) only after their alarms have ended.
        """
        if self.raised:
            return "drill" if self.drill else "alarm"
        return "quiet" if self.told is None else "reset"


class FleetAlarmReport(msgspec.Struct, frozen=True):
    """The state of the daemon's alarm, for the status file and `/diagnostics`. `state` and `since`: see
    `FleetAlarmMemory`. `waits`: the nodes whose alarms must end before we publish `false`."""

    state: str
    causes: tuple[AlarmCause, ...] = ()
    waits: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = ()
    since: float | None = None
    read_at: float | None = None

    def news(self) -> object:
        """Return all fields whose change is published at once."""
        return self.state, self.causes, self.waits, self.faults


def overlap(one: Fleets, other: Fleets) -> bool:
    """Return whether a fleet is in both sets. An empty set means all fleets."""
    return not one or not other or bool(one & other)

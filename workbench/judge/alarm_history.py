"""The history of one node's alarm. It has the node's `true` and `false` messages, the node's statements
on /diagnostics, and the alarms of other nodes.

Some transports hide the sender of a message. No law blames a node for such a message.
"""

from typing import Final

from bridges.kinds.shared import alarming
from bridges.kinds.shared.durations import SILENT_S
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmHeard,
    Fleets,
    overlap,
)
from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard
from workbench.judge.history import NOT_YET, REMEMBERED, AnyHistory, keep

ALL: Final[Fleets] = frozenset()
"""An alarm or its end that names no fleet concerns all fleets."""
JOINS_S: Final = 2.0
"""Time (s) in which a listener that joins may hear retained messages, in any order."""


class AlarmHistory(AnyHistory):
    """The history of the alarm of the node `name`. A message is `true` (alarm) or `false` (end of the
    alarm), with the fleets that it concerns. A statement is the alarm's state in the node's
    diagnostics.

    Messages of this node:

    - `said`: the latest message heard, if this node sent it.
    - `told`: the fleets that the node has alarmed with `true` and not yet released with `false`. An
      empty set means all fleets. None means no alarm.
    - `told_at`: the time of the node's last `true`. `released_at`: the time of its last `false`.
    - `told_before`: the value of `told` before the message `said`.
    - `partly`: whether the node has released some fleets of an alarm of all fleets. Nobody knows
      which fleets remain.
    - `needless`: how many `false` in a row, for the same fleets, the node has sent without an alarm of
      its own.

    Statements of this node:

    - `stated`, `stated_before`: the states in the last two statements; "" if there was none.
    - `stated_at`: the time of the last statement.
    - `new`: whether the latest message heard is a statement of this node.
    - `rose`: whether the present alarm was stated directly after `quiet`.
    - `quiet_at`: the time of the last statement `quiet`.

    Messages of other nodes:

    - `freed`: the fleets of this node's alarm for which another node has sent `false`, until this node
      repeats `true` for them. An empty set means all fleets. None means no fleet.
    - `against_at`: the time of the first such `false` that this node has to answer. It is forgotten
      when this node has repeated `true` for the freed fleets, or ends its alarm.
    - `again`: whether this node has just repeated `true` for all freed fleets.
    - `hidden_at`: the time of the last message with a hidden sender.
    - `standing`: other node -> the fleets of its present alarm.
    - `stood`: the other nodes whose alarm the message `said` has ended.
    - `over`: other node -> the time at which this node itself ended its last alarm.

    `volatile` tells whether the publisher of the alarm's topic retains nothing; None if unknown.
    `hears` tells whether the node's messages would be heard. A recording may lack the alarm's topic.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name.lstrip("/"))
        self.said: AlarmHeard | None = None
        self.told: Fleets | None = None
        self.told_before: Fleets | None = None
        self.freed: Fleets | None = None
        self.told_at = self.released_at = self.against_at = self.hidden_at = NOT_YET
        self.needless = 0
        self.partly = self.hears = False
        self.stated = self.stated_before = ""
        self.stated_at = self.quiet_at = NOT_YET
        self.new = self.again = self.rose = False
        self.standing: dict[str, Fleets] = {}
        self.stood: tuple[str, ...] = ()
        self.over: dict[str, float] = {}
        self.volatile: bool | None = None
        self._stated_at: dict[str, float] = {}
        self._fleets: Fleets = ALL
        self._needless_for: Fleets | None = None
        self._joined_at = NOT_YET

    def take(self, heard: Heard, own: bool = False) -> bool:
        """Take a message on an alarm's topic, or the diagnostics in which daemons state their
        alarms."""
        self._begin(heard, own)
        if self._joined_at == NOT_YET:
            self._joined_at = self.now
        self.said, self.new, self.again = None, False, False
        message = heard.message
        if isinstance(message, d.DiagnosticArray):
            for node, state, fleets in alarming.statements(message):
                self._state(node, state, fleets)
            return self.new
        if not alarming.is_alarm(heard.topic, message):
            self._other_at = self.now if isinstance(message, words.Stated) else self._other_at
            return False
        node = heard.sender.node.lstrip("/") if heard.sender else ""
        event = alarming.heard(message, [node])
        if node == self.name:
            self._say(event)
        else:
            self._hear(node, event)
        return True

    def pass_time(self, now: float, wall: float) -> None:
        """Note that time has passed without a message."""
        super().pass_time(now, wall)
        self.said, self.new, self.again = None, False, False

    def checked(self) -> None:
        """Forget how long the network was silent, after the laws have checked the latest message."""
        self.network_s = 0.0

    @property
    def raised(self) -> bool:
        """Does the node's last statement tell of an alarm or a drill?"""
        return self.stated in alarming.RAISED

    @property
    def unended(self) -> Fleets | None:
        """The fleets of this node's alarm for which no node has sent `false`. An empty set means all
        fleets, or all fleets but some (see `is_vague`). None means that no alarm stands."""
        return self.told if self.freed is None else without(self.told, self.freed)

    @property
    def is_vague(self) -> bool:
        """Is it unknown which fleets remain, because an alarm of all fleets has ended for some?"""
        return self.told == ALL and (self.partly or bool(self.freed))

    def _say(self, event: AlarmHeard) -> None:
        self.states += 1
        self.hears = True
        self.said, self.told_before = event, self.told
        if event.on:
            self.told = joined(self.told, event.fleets)
            self.told_at, self.needless, self._needless_for = self.now, 0, None
            self.partly &= bool(event.fleets)
            names_some = self.freed == ALL and event.fleets
            self.freed = without(self.freed, event.fleets)
            self.again = self.against_at > NOT_YET and self.freed is None
            if self.freed is None or names_some:  # nobody knows whether these are all fleets
                self.against_at = NOT_YET
            return
        if self.told is not None and overlap(self.told, event.fleets):
            self.needless, self._needless_for = 0, None
        else:
            same = self._needless_for is None or overlap(self._needless_for, event.fleets)
            self.needless += same
            self._needless_for = joined(self._needless_for, event.fleets)
        self.told = without(self.told, event.fleets)
        self.freed = without(self.freed, event.fleets)
        self.partly = self.told == ALL
        self.released_at = self.now
        if self.told is None or self.freed is None:
            self.freed, self.against_at = None, NOT_YET
        self.stood = tuple(n for n, told in self.standing.items() if overlap(told, event.fleets))
        self._end(event.fleets)

    def _hear(self, node: str, event: AlarmHeard) -> None:
        is_joining = self.told_at > NOT_YET and self.now - self._joined_at <= JOINS_S
        if not node:  # perhaps this node
            self.hidden_at, self.against_at = self.now, NOT_YET
        elif event.on:
            if len(self.standing) < REMEMBERED:
                self.standing[node] = event.fleets
                self.others.add(node)
            return
        elif is_joining:  # perhaps older than this node's `true`
            self.hidden_at = self.now
        if not event.on:
            self._end(event.fleets)
            self._is_over(node)
            ours = self._fleets if self.told is None and self.raised else self.told
            known = node and not is_joining
            if known and ours is not None and overlap(ours, event.fleets):
                self.freed = joined(self.freed, common(ours, event.fleets))
                self.against_at = self.now if self.against_at == NOT_YET else self.against_at

    def _end(self, fleets: Fleets) -> None:
        """End the alarms of these fleets, because a `false` lets RMF's robots drive. An alarm stays if
        its node still makes statements. RMF has obeyed the `false`, and a dead node does not
        contradict it."""
        for node, told in [*self.standing.items()]:
            states = self.now - self._stated_at.get(node, NOT_YET) <= SILENT_S
            if not states and overlap(told, fleets):
                del self.standing[node]

    def _state(self, node: str, state: str, fleets: Fleets) -> None:
        if node == self.name:
            self.states += 1
            self.new, self.stated_before, self.stated = True, self.stated, state
            self.stated_at, self._fleets = self.now, fleets
            self.against_at = self.against_at if self.raised else NOT_YET
            self.quiet_at = self.now if state == "quiet" else self.quiet_at
            self.rose = self.raised and (self.rose or self.stated_before == "quiet")
            return
        self.others.add(node)
        keep(self._stated_at, node, self.now)
        if state in alarming.RAISED:
            self.standing[node] = fleets
        else:
            self._is_over(node)

    def _is_over(self, node: str) -> None:
        self.standing.pop(node, None)
        keep(self.over, node, self.now)


def joined(one: Fleets | None, other: Fleets) -> Fleets:
    """Return the fleets that are in one of the sets. An empty set means all fleets; None, no fleet."""
    if one is None:
        return other
    return one | other if one and other else ALL


def common(one: Fleets, other: Fleets) -> Fleets:
    """Return the fleets that are in both sets, which must overlap. An empty set means all fleets."""
    return one & other if one and other else one | other


def without(one: Fleets | None, other: Fleets) -> Fleets | None:
    """Return the fleets of `one` that are not in `other`. An empty set means all fleets; None, no
    fleet. All fleets without some remain all fleets, because nobody knows their names."""
    if one is None or not other:
        return None
    return (one - other or None) if one else ALL

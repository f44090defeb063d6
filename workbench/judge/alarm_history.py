"""The history of one node's alarm. It has the node's `true` and `false` messages, the node's statements
on /diagnostics, and the alarms of other nodes.

Some transports hide the sender of a message. No law blames a node for such a message.
"""

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


class AlarmHistory(AnyHistory):
    """The history of the alarm of the node `name`. A message is `true` (alarm) or `false` (end of the
    alarm), with the fleets that it concerns. A statement is the alarm's state in the node's
    diagnostics.

    Messages of this node:

    - `said`: the latest message heard, if this node sent it.
    - `told`: the fleets that the node has alarmed with `true` and not yet released with `false`. An
      empty set means all fleets. None means no alarm.
    - `told_at`: the time of the node's last `true`.
    - `told_before`: the value of `told` before the message `said`.
    - `needless`: how many `false` in a row the node has sent without an alarm of its own.

    Statements of this node:

    - `stated`, `stated_before`: the states in the last two statements; "" if there was none.
    - `stated_at`: the time of the last statement.
    - `new`: whether the latest message heard is a statement of this node.
    - `rose`: whether the present alarm was stated directly after `quiet`.
    - `quiet_at`: the time of the last statement `quiet`.

    Messages of other nodes:

    - `ended_at`: the time of the last `false`, of any node, for one of the alarmed fleets.
    - `against_at`: the time of another node's `false` against this node's alarm. It is
      forgotten when this node repeats `true`, or ends its alarm.
    - `again`: whether this node has just repeated `true` after such a `false`.
    - `hidden_at`: the time of the last message with a hidden sender.
    - `standing`: other node -> the fleets of its present alarm.
    - `stood`: the other nodes whose alarm the message `said` has ended.
    - `over`: other node -> the time at which this node itself ended its last alarm.

    `volatile` tells whether the publisher of the alarm's topic retains nothing; None if unknown.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name.lstrip("/"))
        self.said: AlarmHeard | None = None
        self.told: Fleets | None = None
        self.told_before: Fleets | None = None
        self.told_at = self.ended_at = self.against_at = self.hidden_at = NOT_YET
        self.needless = 0
        self.stated = self.stated_before = ""
        self.stated_at = self.quiet_at = NOT_YET
        self.new = self.again = self.rose = False
        self.standing: dict[str, Fleets] = {}
        self.stood: tuple[str, ...] = ()
        self.over: dict[str, float] = {}
        self.volatile: bool | None = None
        self._stated_at: dict[str, float] = {}
        self._fleets: Fleets = frozenset()

    def take(self, heard: Heard, own: bool = False) -> bool:
        """Take a message on an alarm's topic, or the diagnostics in which daemons state their
        alarms."""
        self._begin(heard, own)
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

    def checked(self) -> None:
        """Forget how long the network was silent, after the laws have checked the latest message."""
        self.network_s = 0.0

    @property
    def raised(self) -> bool:
        """Does the node's last statement tell of an alarm or a drill?"""
        return self.stated in alarming.RAISED

    def _say(self, event: AlarmHeard) -> None:
        self.states += 1
        self.said, self.told_before = event, self.told
        if event.on:
            self.again = self.against_at > NOT_YET
            both = event.fleets if self.told is None else event.fleets | self.told
            all_fleets = not event.fleets or self.told == frozenset()
            self.told, self.told_at = (frozenset() if all_fleets else both), self.now
            self.against_at = NOT_YET
            self.needless = 0
            return
        self.needless += self.told is None
        self.told, self.ended_at, self.against_at = None, self.now, NOT_YET
        self.stood = tuple(n for n, told in self.standing.items() if overlap(told, event.fleets))
        self._end(event.fleets)

    def _hear(self, node: str, event: AlarmHeard) -> None:
        if not node:
            self.hidden_at = self.now
        elif event.on:
            if len(self.standing) < REMEMBERED:
                self.standing[node] = event.fleets
                self.others.add(node)
            return
        if not event.on:
            self._end(event.fleets)
            self._is_over(node)
            ours = self._fleets if self.told is None and self.raised else self.told
            if ours is not None and overlap(ours, event.fleets):
                self.ended_at = self.against_at = self.now

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

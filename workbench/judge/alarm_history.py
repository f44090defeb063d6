"""The history of one node's alarm: its messages, its statements, and the alarms of other nodes.

A wire may hide a message's sender. Such a message is nobody's: no law blames a node for it.
"""

from bridges.kinds.shared import alarming
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
    """The history of one node's alarm. `name`: the node.

    - `said`: the node's message, if it is the latest message.
    - `told`: the fleets of the node's `true`, until its `false`. `told_at`: the time of that `true`.
      `told_before`: `told` before `said`.
    - `needless`: the number of its `false` in a row, without a `true` before them.
    - `stated`, `stated_before`: the states in its latest two statements; "" before a statement.
      `stated_at`: the time of the latest. `new`: it is the latest message. `rose`: the statements have
      gone from `quiet` to the present raised alarm. `quiet_at`: the last statement `quiet`.
    - `ended_at`: the last `false` of any node for one of the fleets of `told`.
    - `against_at`: another node's `false` against the node's alarm, until the node repeats `true`.
      `again`: the node has just repeated `true` after such a `false`.
    - `hidden_at`: the time of the last message whose sender the wire has hidden.
    - `standing`: the fleets of each other node's alarm. `stood`: the nodes whose alarms `said`, a
      `false`, has ended. `over`: the time at which each node has itself ended its last alarm.
    - `volatile`: the publisher of the alarm's topic retains nothing; None if unknown.
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
        self._stating: set[str] = set()
        self._fleets: Fleets = frozenset()

    def take(self, heard: Heard, own: bool = False) -> bool:
        """Take a message on an alarm's topic, or statements of our daemons."""
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
        """Note that the laws have read the latest message."""
        self.network_s = 0.0

    @property
    def raised(self) -> bool:
        """Does the node state a raised alarm?"""
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
        """Let a `false` end the alarms of nodes that make no statements: RMF's robots drive."""
        for node, told in [*self.standing.items()]:
            if node not in self._stating and overlap(told, fleets):
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
        self._stating.add(node)
        if state in alarming.RAISED:
            self.standing[node] = fleets
        else:
            self._is_over(node)

    def _is_over(self, node: str) -> None:
        self.standing.pop(node, None)
        keep(self.over, node, self.now)

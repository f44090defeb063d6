"""Run a judgement: listen, perform a play (a series of test messages), release the device, and give the
verdict. The play is performed only if the user asks for it, and if the device is free.

This module has no I/O and no clock. So the same code judges a real node on the network, and a test's
node in virtual time. The caller passes messages in, publishes the returned messages, and calls `turn`
at `wake_at`.
"""

from collections.abc import Callable
from enum import Enum, auto
from typing import Final

from bridges.messages.heard import Heard
from workbench.judge.judge import Judge
from workbench.judge.scenarios import LEAVES_S, REPEAT_S, Scenario
from workbench.judge.shared_laws import BURST_WITHIN_S
from workbench.rmf_model import NEVER, Said

LISTENS_S: Final = 4.0
"""Time (s) of listening before a play, for the device's state and for other nodes."""
APPEARS_S: Final = 15.0
"""Maximum time (s) to wait for the device's first state, because nodes must first discover each
other."""
SETTLES_S: Final = 4.0
"""Time (s) of listening after a play, for late breaches."""


class Act(Enum):
    """The part of a judgement that runs now."""

    LISTEN = auto()
    PLAY = auto()
    LEAVE = auto()
    SETTLE = auto()
    DONE = auto()


class JudgeRun:
    """One judgement.

    - `for_s`: time (s) of listening without a play; inf means until `stop`.
    - `strangers()`: names of other publishers on the play's topics; "" if there are none.
    - `note`: why a play was not performed, or why it was not completed.
    """

    def __init__(
        self,
        judge: Judge,
        scenario: Scenario | None,
        for_s: float,
        strangers: Callable[[], str] = lambda: "",
    ) -> None:
        self.judge = judge
        self.act = Act.LISTEN
        self.note = ""
        self._scenario = scenario
        self._strangers = strangers
        self._for_s = for_s if scenario is None else LISTENS_S
        self.began_at = 0.0
        self._until = NEVER
        self._leave_until = NEVER
        self._epoch = 0.0
        self._in_haste = False
        self._last: tuple[float, float] = (0.0, 0.0)

    @property
    def done(self) -> bool:
        """Return whether there is a verdict."""
        return self.act is Act.DONE

    def begin(self, at: float, wall: float) -> None:
        """Start to listen. `at` is the monotonic time (s). `wall` is in seconds since the epoch."""
        self.began_at, self._until = at, at + self._for_s
        self._epoch = wall - at
        self._last = (at, wall)

    def hear(self, heard: Heard) -> list[Said]:
        """Take a message that another node sent. Return messages to publish."""
        self._last = (heard.at, heard.wall)
        self.judge.hear(heard)
        if self._scenario is None or self.act not in (Act.PLAY, Act.LEAVE):
            return []
        if heard.topic not in (topic.name for topic in self._scenario.hears):
            return []
        said = self._scenario.hear(heard.topic, heard.message, self._now)
        if self.act is not Act.PLAY:
            return []
        if self.judge.history.burst_s < BURST_WITHIN_S:
            self.note = (
                "stopped: each request causes a state, and RMF sends a request after each state"
            )
            return self._begin_leaving()
        return self._told(said)

    def turn(self, at: float, wall: float) -> list[Said]:
        """Do everything that is due at time `at`. Return messages to publish."""
        self._last = (at, wall)
        match self.act:
            case Act.LISTEN if at >= self._until:
                return self._begin_play()
            case Act.PLAY:
                return self._play_on()
            case Act.LEAVE if at >= self._until:
                return self._leave_on()
            case Act.SETTLE if at >= self._until:
                self.act = Act.DONE
        return []

    def wake_at(self) -> float:
        """The latest time (monotonic s) at which the caller must call `turn`."""
        if self.act is Act.PLAY and self._scenario is not None:
            return min(self._scenario.wake_at() - self._epoch, self._last[0] + REPEAT_S)
        return NEVER if self.act is Act.DONE else self._until

    def stop(self) -> list[Said]:
        """End early. If a play is running, release the device first. A caller may call `stop` again."""
        if self.act is Act.PLAY:
            self.note, self._in_haste = "interrupted", True
            return self._begin_leaving()
        if self.act is not Act.LEAVE:
            self.act = Act.DONE
        self._in_haste = True
        return []

    @property
    def _now(self) -> float:
        """Return RMF's clock (s since the epoch). The clock begins with the wall clock, and then
        follows the monotonic clock. Thus steps of the wall clock change nothing."""
        return self._epoch + self._last[0]

    def _begin_play(self) -> list[Said]:
        state = self.judge.history.state
        if self._scenario is None:
            self.act = Act.DONE
            return []
        if state is None and self._last[0] < self.began_at + APPEARS_S:
            self._until = self._last[0] + REPEAT_S
            return []
        self.note = self._strangers() or (self._scenario.unfit(state) if state is not None else "")
        if state is None or self.note:
            self.act = Act.DONE
            return []
        self.act = Act.PLAY
        return self._told(self._scenario.begin(self._now)) + self._play_on()

    def _play_on(self) -> list[Said]:
        assert self._scenario is not None
        self.note = self._strangers()
        said = [] if self.note else self._told(self._scenario.tick(self._now))
        if not (self.note or self._scenario.over):
            return said
        self.note = self.note or self._scenario.why
        return said + self._begin_leaving()

    def _begin_leaving(self) -> list[Said]:
        self.act, self._leave_until = Act.LEAVE, self._last[0] + LEAVES_S
        assert self._scenario is not None
        if not self.note and self._scenario.left:
            self._settle()
            return []
        return self._leave_on()

    def _leave_on(self) -> list[Said]:
        assert self._scenario is not None
        late = self._last[0] >= self._leave_until
        if self._scenario.left or late:
            if not self._scenario.left:
                self.note = f"{self.note or 'played'}; the device was not released".lstrip("; ")
            self._settle()
            return []
        self._until = self._last[0] + REPEAT_S
        return self._told(self._scenario.leave(self._now))

    def _settle(self) -> None:
        self.act = Act.DONE if self._in_haste else Act.SETTLE
        self._until = self._last[0] + SETTLES_S

    def _told(self, said: list[Said]) -> list[Said]:
        """Judge our own messages like the messages of other nodes. Return our messages."""
        at, wall = self._last
        for topic, message in said:
            self.judge.hear(Heard(at, wall, topic.name, message), own=True)
        return said

"""Copies of RMF's nodes, with which the judge tests one device: fleet adapters with their robots, and
the supervisor.

The copies follow RMF's rules (`workbench/rmf_model/`), without I/O and clock. The judge hides the
states of all other devices from its supervisor. Otherwise this supervisor would end the sessions of
those devices. If the graph already has a supervisor, the judge plays only fleet adapters. Their
requests go through that supervisor.
"""

from collections import deque
from collections.abc import Callable, Iterator
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import topics, words
from workbench.rmf_model import NEVER, Party, Said
from workbench.rmf_model.robot import Phase, RobotContext

DEAF_S: Final = 6.0
"""Time (s) for which the played supervisor is silent after an END without a floor.

Otherwise the supervisor, like RMF's, would immediately send an END with a floor. Then nobody would see
that the lift refused the first END.
"""
RETAINED: Final = topics.ADAPTER_LIFT_REQUESTS.publish.depth

Step = Phase | float
Script = Callable[[RobotContext], Iterator[Step]]
"""A robot's steps. Each step is a phase, or the time (s) that the robot drives."""


class Traveller:
    """A robot with its fleet adapter. `waits_since` is the time at which the robot's phase began.
    During a drive, `waits_since` is inf."""

    def __init__(self, requester_id: str, script: Script) -> None:
        self.robot = RobotContext(requester_id)
        self.done = False
        self.waits_since = NEVER
        self._steps = script(self.robot)
        self._drives_until = -NEVER

    @property
    def waits_for(self) -> str:
        """The name of the phase in which the robot waits."""
        phase = self.robot.phase
        return type(phase).__name__ if phase is not None and not phase.done else ""

    def go_on(self, now: float) -> list[Said]:
        """Begin the next step, if the present step is over."""
        if self.done or not self.robot.done or now < self._drives_until:
            return []
        step = next(self._steps, None)
        if step is None:
            self.done, self.robot.on_task, self.robot.phase = True, False, None
            self.waits_since = NEVER
            return []
        if isinstance(step, Phase):
            self.waits_since = now
            return self.robot.begin(step, now)
        self._drives_until, self.waits_since = now + step, NEVER
        return []

    def wake_at(self) -> float:
        """Time of the robot's next timer, or the end of the robot's drive."""
        drives = self._drives_until if self.robot.done and not self.done else NEVER
        return min(self.robot.wake_at(), drives)


class PlayedNodes:
    """One scenario for one device. `now` is the time by RMF's clock (s since the epoch).

    - `supervisor`: a function that makes a new supervisor; None if the graph has a supervisor.
    - `failed`: why the scenario was ended early, or "".

    Methods return messages. The caller publishes and judges these messages.
    """

    def __init__(
        self,
        device: str,
        travellers: list[Traveller],
        supervisor: Callable[[], Party] | None,
        patience_s: float,
    ) -> None:
        self.device = device
        self.travellers = travellers
        self.failed = ""
        self._makes = supervisor
        self._supervisor = supervisor() if supervisor else None
        self._patience_s = patience_s
        self._retained: deque[d.LiftRequest] = deque(maxlen=RETAINED)
        self._deaf_until = -NEVER

    @property
    def over(self) -> bool:
        """Return whether every robot has done its steps, or the scenario has failed."""
        return bool(self.failed) or all(traveller.done for traveller in self.travellers)

    @property
    def names(self) -> set[str]:
        """The names of our own sessions."""
        return {traveller.robot.requester_id for traveller in self.travellers}

    def begin(self, now: float) -> list[Said]:
        """Start every robot."""
        return self._go_on(now)

    def hear(self, topic: str, message: d.Message, now: float) -> list[Said]:
        """Take a message of the graph that another node sent. `topic` is the topic's name."""
        if isinstance(message, words.Stated) and words.device(message) != self.device:
            return []
        said = self._spread(topic, message, now)
        return said + self._go_on(now)

    def tick(self, now: float) -> list[Said]:
        """Fire the timers whose time has come."""
        said = []
        for traveller in self.travellers:
            if now >= traveller.robot.wake_at():
                said += self._say(traveller.robot.tick(now), now)
            self._give_up(traveller, now)
        return said + self._go_on(now)

    def wake_at(self) -> float:
        """The latest time at which the caller must call `tick`."""
        waits = (t.waits_since + self._patience_s for t in self.travellers)
        return min([*(t.wake_at() for t in self.travellers), *waits])

    def restart_supervisor(self, now: float) -> list[Said]:
        """Replace the played supervisor by a new one. Give the new supervisor the retained messages,
        sorted by robot."""
        if self._makes is None:
            return []
        self._supervisor = self._makes()
        said = []
        for message in sorted(self._retained, key=lambda one: one.session_id):
            said += self._say(self._supervisor.hear(message, now), now)
        return said

    def deafen(self, until: float) -> None:
        """Hide all states from the played supervisor until `until`. Otherwise the supervisor would
        repair the error of a faulty node."""
        self._deaf_until = until

    def _go_on(self, now: float) -> list[Said]:
        said = []
        for traveller in self.travellers:
            if not self.failed:
                said += self._say(traveller.go_on(now), now)
        return said

    def _give_up(self, traveller: Traveller, now: float) -> None:
        if now - traveller.waits_since < self._patience_s or self.failed:
            return
        who = traveller.robot.requester_id
        self.failed = f"{traveller.waits_for} of {who} has not ended in {self._patience_s:.0f} s"

    def _say(self, said: list[Said], now: float) -> list[Said]:
        """Return these messages, together with the answers of the other played nodes."""
        out = []
        for topic, message in said:
            out.append((topic, message))
            if isinstance(message, d.LiftRequest) and topic == topics.ADAPTER_LIFT_REQUESTS:
                self._retained.append(message)
            out += self._spread(topic.name, message, now)
        return out

    def _spread(self, topic: str, message: d.Message, now: float) -> list[Said]:
        said: list[Said] = []
        for party in self._parties():
            deaf = party is self._supervisor and now < self._deaf_until
            deaf = deaf and isinstance(message, words.Stated)
            if topic in (heard.name for heard in party.subscribes) and not deaf:
                said += self._say(party.hear(message, now), now)
        bare = isinstance(message, d.LiftRequest) and not message.destination_floor
        if bare and topic == topics.LIFT_REQUESTS.name:
            self._deaf_until = now + DEAF_S
        return said

    def _parties(self) -> list[Party]:
        robots: list[Party] = [traveller.robot for traveller in self.travellers]
        return [*robots, self._supervisor] if self._supervisor is not None else robots

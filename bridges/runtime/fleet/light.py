"""One robot at RMF's traffic light: its path is told, and RMF's answers go to the robot's core.

Two facts of RMF's EasyTrafficLight shape this file (open-rmf/rmf_ros2, EasyTrafficLight.cpp, jazzy and
main). Its Python binding keeps Python's lock while a question waits for the light's own lock, and RMF
may hold that one while it waits for Python's, to call `pause`. Then the whole process stands, until
systemd's watchdog ends it. So RMF is asked seldom. And RMF never calls `resume`, nor its callback for
deadlocks: the answers to our questions are all that it says.
"""

import datetime
import time
from collections.abc import Mapping
from typing import Any, Final

from bridges.kinds.fleet.light import LightQuestion
from bridges.kinds.fleet.report import RobotReport
from bridges.kinds.fleet.signals import LightAnswer, Pose, Says
from bridges.runtime.fleet.robot import AGAIN_S, Put

ASKS_S: Final = 0.5
"""The pause (s) between two questions about unchanged progress."""
NO_LIGHT: Final = "RMF's schedule has given it no traffic light yet"
TAKES_S: Final = 3.0
"""The time (s) that RMF may need to take a path. Until then it answers with an error."""
ANSWERS: Final[Mapping[str, Says]] = {
    "ContinueAtNextCheckpoint": "continue",
    "WaitAtNextCheckpoint": "wait",
    "PauseImmediately": "pause",
    "Resume": "resume",
    "Wait": "stay",
    "MovingError": "error",
    "WaitingError": "error",
}
NO_DELAY: Final = datetime.timedelta()


class RmfLight:
    """One robot at RMF: its traffic light, and the last answer."""

    def __init__(self, name: str, rmf: Any, answers: Put, fleet: str) -> None:
        self.handle: Any = None
        self._name, self._rmf, self._answers, self._fleet = name, rmf, answers, fleet
        self._asked_for_at: float | None = None
        self._path = 0
        self._asked: object = None
        self._ask_at = self._taken_at = 0.0
        self._said: LightAnswer | None = None

    def add(self, adapter: Any, configuration: Any, report: RobotReport) -> str:
        """Ask for a traffic light; return why there is none for long, or ""."""
        now = time.monotonic()
        if self._asked_for_at is None:
            self._asked_for_at = now
            traits = configuration.vehicle_traits
            adapter.add_easy_traffic_light(
                self._take, self._fleet, self._name, traits, self._pause, _ignore
            )
        return NO_LIGHT if now >= self._asked_for_at + AGAIN_S else ""

    def update(self, report: RobotReport) -> None:
        """Ask RMF about the robot's progress, if it is time."""
        asks = report.light
        if asks is None:
            return
        now, news = time.monotonic(), (asks.number, asks.checkpoint, asks.stands)
        if now < self._ask_at and news == self._asked:
            return
        self._asked, self._ask_at = news, now + ASKS_S
        if not asks.path:
            self._path = 0
            self.handle.update_idle_location(asks.here.map, _vector(asks.here))
        elif asks.number != self._path:  # RMF takes a path later, on a thread of its own
            self._path, self._said, self._taken_at = asks.number, None, now + TAKES_S
            self.handle.follow_new_path([self._waypoint(at) for at in asks.path])
        else:
            says = ANSWERS[self._ask(asks).name]
            if says != "error" or now >= self._taken_at:
                self._tell(LightAnswer(asks.number, asks.checkpoint, says))

    def _ask(self, asks: LightQuestion) -> Any:
        if asks.stands == "at":
            return self.handle.waiting_at(asks.checkpoint)
        ask = self.handle.moving_from if asks.stands == "moving" else self.handle.waiting_after
        return ask(asks.checkpoint, _vector(asks.here))

    def _waypoint(self, at: Pose) -> Any:
        return self._rmf.Waypoint(at.map, _vector(at), NO_DELAY, True)

    def _tell(self, answer: LightAnswer) -> None:
        if answer != self._said:
            self._said = answer
            self._answers(self._name, answer)

    def _take(self, handle: Any) -> None:
        self.handle = handle

    def _pause(self) -> None:
        """Take RMF's call, on RMF's thread: the last answer has changed to `pause`."""
        if (last := self._said) is not None:
            self._tell(LightAnswer(last.path, last.checkpoint, "pause"))


def _ignore() -> None:
    """Take RMF's resume, which is not needed: a resume comes as an answer."""


def _vector(at: Pose) -> list[float]:
    return [at.x, at.y, at.yaw]

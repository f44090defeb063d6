"""One robot that RMF controls with a traffic light. We tell RMF the robot's path, and pass RMF's
answers to the robot's core.

Two facts about RMF's EasyTrafficLight shape this file (open-rmf/rmf_ros2, EasyTrafficLight.cpp, jazzy
and main):

- A question to RMF may block the whole process, because two locks can block each other. The Python
  binding holds Python's global lock while a question waits for the light's lock. RMF may hold the
  light's lock while it waits for Python's lock to call `pause`. Then the process stands still until
  systemd's watchdog ends it. Therefore we seldom ask.
- RMF never calls `resume`, and never calls its callback for deadlocks. Therefore only the answers to
  our questions tell us when the robot may go on.
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
"""The pause (s) between two questions while the robot's progress is unchanged."""
NO_LIGHT: Final = "RMF's schedule has not given the robot a traffic light yet"
TAKES_S: Final = 3.0
"""The time (s) that RMF may need to accept a path. Before it has accepted the path, RMF answers with an
error."""
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
    """One robot that RMF controls with a traffic light, and RMF's last answer."""

    def __init__(self, name: str, rmf: Any, answers: Put, fleet: str) -> None:
        self.handle: Any = None
        self._name, self._rmf, self._answers, self._fleet = name, rmf, answers, fleet
        self._asked_for_at: float | None = None
        self._path = 0
        self._asked: object = None
        self._ask_at = self._taken_at = 0.0
        self._said: LightAnswer | None = None

    def add(self, adapter: Any, configuration: Any, report: RobotReport) -> str:
        """Ask for a traffic light. Return an explanation if RMF has not given one for AGAIN_S,
        otherwise ""."""
        now = time.monotonic()
        if self._asked_for_at is None:
            self._asked_for_at = now
            traits = configuration.vehicle_traits
            adapter.add_easy_traffic_light(
                self._take, self._fleet, self._name, traits, self._pause, _ignore
            )
        return NO_LIGHT if now >= self._asked_for_at + AGAIN_S else ""

    def update(self, report: RobotReport) -> None:
        """Tell RMF the robot's progress, and pass on its answer. Do nothing if no progress was made and
        ASKS_S has not passed."""
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
        elif asks.number != self._path:  # RMF accepts the path later, on its own thread
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
        """Pass on that the robot must pause. RMF calls this method on its own thread, between two
        questions."""
        if (last := self._said) is not None:
            self._tell(LightAnswer(last.path, last.checkpoint, "pause"))


def _ignore() -> None:
    """Ignore RMF's call of `resume`, because RMF's answers already say when the robot may go on."""


def _vector(at: Pose) -> list[float]:
    return [at.x, at.y, at.yaw]

"""One robot in RMF's adapter. This module keeps the adapter's handle for the robot, and the activity
that the robot now executes. It also reports the robot's issues, and whether the robot accepts tasks
(its commission).

RMF's adapter calls our callbacks on its own threads. A callback only puts an order into the inbox of
the robot's bus.
"""

import json
import re
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

from bridges.kinds.fleet.report import RobotReport
from bridges.kinds.fleet.signals import Act, Goal, Localize, Navigate, Order, Pose, Stop
from bridges.kinds.shared.decision import Fault

GIVEN_UP_S: Final = 2.0
"""The time (s) for which the robot may go on after RMF has ended its activity. Often RMF orders the
next activity a moment later, and then the robot must not stop."""
AGAIN_S: Final = 10.0
"""The pause (s) before the next attempt, after RMF has not taken a robot."""
NOT_TAKEN: Final = "RMF does not take the robot: is it near a lane, on a level of the graph?"
COUNTS: Final = re.compile(r"\d+(\.\d+)? (s|m)\b")
"""The seconds and metres in a fault's detail. An issue lasts while only these change."""
Put = Callable[[str, Order], None]


class RmfRobot:
    """One robot in RMF's adapter."""

    def __init__(self, name: str, rmf: Any, orders: Put, numbers: Iterator[int]) -> None:
        self.handle: Any = None
        self._name, self._rmf, self._orders, self._numbers = name, rmf, orders, numbers
        self._now: tuple[int, Any] = (0, None)
        self._lock = threading.Lock()
        self._given_up_at: float | None = None
        self._fit = True
        self._commissioned: Any = None
        self._issues: dict[tuple[str, str], Any] = {}
        self._again_at = 0.0

    def add(self, fleet: Any, configuration: Any, report: RobotReport) -> str:
        """Add the robot to RMF at its first known position. Return the reason why RMF did not accept
        the robot, or ""."""
        if report.at is None or time.monotonic() < self._again_at:
            return "" if report.at is None else NOT_TAKEN
        self._again_at = time.monotonic() + AGAIN_S
        callbacks = self._rmf.easy_full_control.RobotCallbacks(
            self._navigate, self._stop, self._act
        )
        callbacks.localize = self._localize
        known = configuration.get_known_robot_configuration(self._name)
        self.handle = fleet.add_robot(self._name, self._state(report), known, callbacks)
        return "" if self.handle else NOT_TAKEN

    def update(self, report: RobotReport) -> None:
        number, execution = self._now
        if report.at is not None:
            goes_on = execution is not None and report.activity == number
            activity = execution.identifier if execution is not None and goes_on else None
            self.handle.update(self._state(report), activity)
        if execution is not None and report.finished == number:
            self._end(number)
            execution.finished()
        elif execution is not None and not execution.okay():
            self._give_up(number)
        more = self.handle.more()
        if more is not None:
            self._commission(more, bool(report.fit))
            self._issue(more, report.faults)

    def _state(self, report: RobotReport) -> Any:
        assert report.at is not None
        place = [report.at.x, report.at.y, report.at.yaw]
        return self._rmf.easy_full_control.RobotState(report.at.map, place, report.battery)

    def _give_up(self, number: int) -> None:
        now = time.monotonic()
        self._given_up_at = now if self._given_up_at is None else self._given_up_at
        if now >= self._given_up_at + GIVEN_UP_S:
            self._end(number)
            self._orders(self._name, Stop(next(self._numbers), number))

    def _end(self, number: int) -> None:
        """Forget this execution. Do nothing if RMF has begun the next execution."""
        with self._lock:
            if self._now[0] == number:
                self._now = (number, None)

    def _commission(self, more: Any, fit: bool) -> None:
        if fit == self._fit:
            return
        self._fit = fit
        if fit:  # restore: somebody may have decommissioned the robot before the fault
            more.set_commission(self._commissioned)
            return
        self._commissioned, none = more.commission(), more.commission()
        none.accept_dispatched_tasks = none.accept_direct_tasks = False
        none.perform_idle_behavior = False
        more.set_commission(none)
        more.reassign_dispatched_tasks()

    def _issue(self, more: Any, faults: Iterable[Fault]) -> None:
        """Resolve the issues whose fault has gone or tells something else now, and create the new
        ones."""
        present = {(fault.code, COUNTS.sub("", fault.detail)): fault for fault in faults}
        for key in self._issues.keys() - present.keys():
            self._issues.pop(key).resolve({})
        for key in present.keys() - self._issues.keys():
            tier = self._rmf.robot_update_handle.Tier.Error
            detail = {"detail": present[key].detail}
            self._issues[key] = more.create_issue(tier, present[key].code, detail)

    def _begun(self, execution: Any) -> int:
        with self._lock:
            number = next(self._numbers)
            self._now, self._given_up_at = (number, execution), None
        return number

    def _navigate(self, destination: Any, execution: Any) -> None:
        self._orders(self._name, Navigate(self._begun(execution), _goal(destination)))

    def _localize(self, estimate: Any, execution: Any) -> None:
        self._orders(self._name, Localize(self._begun(execution), _goal(estimate)))

    def _act(self, category: str, description: Any, execution: Any) -> None:
        number = self._begun(execution)
        self._orders(self._name, Act(number, category, json.dumps(description)))

    def _stop(self, activity: Any) -> None:
        number, execution = self._now
        if execution is not None and execution.identifier.is_same(activity):
            self._end(number)
            self._orders(self._name, Stop(next(self._numbers), number))


def _goal(destination: Any) -> Goal:
    x, y, yaw = (float(part) for part in destination.position)
    lift = destination.inside_lift
    return Goal(
        Pose(str(destination.map), x, y, yaw),
        destination.name or "",
        destination.dock or "",
        destination.speed_limit,
        lift.name if lift is not None else "",
    )

"""A lift's car and its doors: positions and movements in virtual time."""

from typing import Literal

NEVER = float("inf")

# The parts of a floor's travel, with their shares of its time. The car first shows the floor that it
# leaves, then no floor, then the next floor.
LEGS = {"leaving": 0.25, "between": 0.5, "arriving": 0.25}


class Car:
    """The car. `floor` is the landing's index, 0 for the lowest. `leg` is the present part of the
    way."""

    def __init__(self) -> None:
        self.floor = 0
        self.leg: Literal["standing", "leaving", "between", "arriving"] = "standing"
        self.course = 0
        self.due_at = NEVER
        self._frozen = False

    @property
    def standing(self) -> bool:
        """Is the car at a landing, and not moving?"""
        return self.leg == "standing"

    @property
    def shown(self) -> int | None:
        """Return the landing that the floor code shows. Return None between landings."""
        return None if self.leg == "between" else self.floor

    def run(self, now: float, goal: int | None, floor_s: float | None) -> None:
        """Continue the travel until `now`. `floor_s` is the time (s) for a floor. None means that the
        car is stuck."""
        if floor_s is None:
            self._frozen = True
            return
        if self._frozen and not self.standing:
            self.due_at = max(self.due_at, now)
        self._frozen = False
        while self.due_at <= now:
            self._next_leg(goal, floor_s)

    def depart(self, now: float, goal: int, floor_s: float | None) -> None:
        """Leave the landing for another landing. A stuck car stays."""
        if floor_s is not None:
            self.course = 1 if goal > self.floor else -1
            self._begin("leaving", now, floor_s)

    def event_at(self) -> float:
        """Return the time at which the next leg begins."""
        return NEVER if self._frozen else self.due_at

    def _next_leg(self, goal: int | None, floor_s: float) -> None:
        if self.leg == "leaving":
            self._begin("between", self.due_at, floor_s)
        elif self.leg == "between":
            self.floor += self.course
            self._begin("arriving", self.due_at, floor_s)
        elif goal is not None and (goal - self.floor) * self.course > 0:
            self._begin("leaving", self.due_at, floor_s)
        else:
            self.leg, self.course, self.due_at = "standing", 0, NEVER

    def _begin(
        self, leg: Literal["leaving", "between", "arriving"], at: float, floor_s: float
    ) -> None:
        self.leg = leg
        self.due_at = at + LEGS[leg] * floor_s


class CarDoor:
    """One door of the car with its landing door. The door stays open until `dwell_until`."""

    def __init__(self) -> None:
        self.dwell_until = 0.0
        self.due_at = NEVER
        self._position = 0.0
        self._course = 0
        self._travel_s = 0.0
        self._since = 0.0

    @property
    def opened(self) -> bool:
        """Does the limit contact show a fully open door?"""
        return self._position == 1.0 and not self._course

    @property
    def closed(self) -> bool:
        """Is the door fully closed and locked?"""
        return self._position == 0.0 and not self._course

    def run(self, now: float) -> None:
        """Move to the position at `now` (s)."""
        if now >= self.due_at:
            self._position = 1.0 if self._course > 0 else 0.0
            self._course, self.due_at = 0, NEVER
        elif self._course:
            moved = (now - self._since) / self._travel_s
            self._position = min(1.0, max(0.0, self._position + self._course * moved))
        self._since = now

    def steer(self, now: float, open_it: bool, travel_s: float | None) -> None:
        """Move towards open or closed. If `travel_s` is None, the operator stands still."""
        goal = 1.0 if open_it else 0.0
        if travel_s is None or self._position == goal:
            self._course, self.due_at = 0, NEVER
            return
        course = 1 if open_it else -1
        if (course, travel_s) != (self._course, self._travel_s):
            self._course, self._travel_s = course, travel_s
            self.due_at = now + abs(goal - self._position) * travel_s

"""The watchdog of a simulated I/O module, as in couplers of the WAGO 750 series.

Its holding registers are 0x1000 time (x 100 ms), 0x1003 trigger, 0x1006 state (0 stopped, 1 running, 2
tripped), and 0x1007 restart. A trigger counts if its value differs from the last trigger's value. The
first trigger starts the watchdog. When the watchdog trips, the module's coils go off. After a trip,
writes to coils get exception 4 until the watchdog is restarted.
"""

from typing import Final

from drivers.hal.modbus.points import Point

TIME, TRIGGER, STATE, RESTART = 0x1000, 0x1003, 0x1006, 0x1007
STOPPED, RUNNING, TRIPPED = 0, 1, 2
TIME_AT_POWER_ON: Final = 100


class ModuleWatchdog:
    """One unit's watchdog. Times are monotonic seconds."""

    plant = None

    def __init__(self, unit: int) -> None:
        self.unit = unit
        self.points = frozenset(
            Point(unit, "holding register", a) for a in (TIME, TRIGGER, STATE, RESTART)
        )
        self.outputs = self.points
        self._registers = {TIME: TIME_AT_POWER_ON, TRIGGER: 0, STATE: STOPPED, RESTART: 0}
        self._due_at = float("inf")

    @property
    def tripped(self) -> bool:
        """Are the outputs off, and are writes to the outputs refused?"""
        return self._registers[STATE] == TRIPPED

    def get(self, point: Point, now: float) -> int:
        """Return the register's value."""
        return self._registers[point.address]

    def set(self, point: Point, value: int, now: float) -> bool:
        """Write a register. Return False if the register cannot be written now."""
        state = self._registers[STATE]
        if point.address == STATE or (point.address == TIME and state == RUNNING):
            return False
        differs = value != self._registers[point.address]
        self._registers[point.address] = value
        starts = point.address == RESTART and value == 1 and state == TRIPPED
        if starts or (point.address == TRIGGER and differs and state != TRIPPED):
            self._registers[STATE] = RUNNING
            self._due_at = now + self._registers[TIME] / 10
        return True

    def expire(self) -> None:
        """Make the watchdog trip at the next call of `trips`."""
        self._due_at = 0.0

    def trips(self, now: float) -> bool:
        """Does the watchdog trip at `now`? The answer is True once for each trip."""
        if self._registers[STATE] != RUNNING or now < self._due_at:
            return False
        self._registers[STATE] = TRIPPED
        return True

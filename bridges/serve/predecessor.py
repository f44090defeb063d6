"""What a dead daemon has left on: switched off before this one claims anything.

A process of its own does it, as it does after a death: what hangs there hangs nobody here, and it
knows the profiles as the dead daemon knew them. What does not answer is a fault that is shown, and is
tried on while we serve; but for our own record, whose outputs each device claims as soon as it answers.
"""

import logging
import math
import subprocess
import time
from collections.abc import Callable, Collection, Sequence
from typing import Any

from bridges.log import pairs
from bridges.serve.record import Record, Records
from drivers import Driver

log = logging.getLogger(__name__)

PATIENCE_S = 15.0
"""For a process that gives up by itself after 5 s (and a slow machine)."""
PAUSE_FIRST_S, PAUSE_MOST_S = 5.0, 60.0


LOOK_EVERY_S = 0.02


class Predecessor:
    """`ours`: the record that this daemon is about to claim by. `command`: its file's `outputs-off`."""

    def __init__(self, records: Records, ours: Record, command: Sequence[str]) -> None:
        self._records = records
        self._ours = ours
        self._command = command
        self._child: subprocess.Popen[bytes] | None = None
        self._pause_s = PAUSE_FIRST_S
        self._next_at = math.inf

    def make_safe(self, wait: Callable[[float], bool]) -> frozenset[str]:
        """Before anything is claimed: everything off that was left on.

        Returns when it is off, has not answered in time, or `wait(s)` says that we are to end: the
        devices of our own record that are not verified off.
        """
        found = self._records.unreleased()
        if found:
            log.warning(pairs("daemon_had_died", claimed=", ".join(r.name for r in found)))
            self._start([record.name for record in found])
            give_up_at = time.monotonic() + PATIENCE_S
            while self._running() and time.monotonic() < give_up_at:
                if wait(LOOK_EVERY_S):
                    break
            self._judge(time.monotonic(), self._own_unsafe())
        return self._own_unsafe()

    def left(self) -> list[str]:
        """The records of others' outputs that are not verified off."""
        return [r.name for r in self._records.unreleased() if r.name != self._ours.name]

    def tick(self, now: float) -> None:
        """Once a second or so: try again what has not answered."""
        if self._child is not None and not self._running():
            self._judge(now)
        elif self._child is None and now >= self._next_at:
            self._start(self.left())

    def close(self) -> None:
        """We end, and switch off what is ours; `outputs-off` after us has its turn with the rest."""
        if self._child is not None:
            self._child.kill()
            self._child.wait()
            self._child = None

    def _own_unsafe(self) -> frozenset[str]:
        own = [r for r in self._records.unreleased() if r.name == self._ours.name]
        return frozenset(name for r in own for name in r.config().devices if name not in r.safe)

    def _start(self, names: Sequence[str]) -> None:
        options = [word for name in names for word in ("--record", name)]
        try:
            self._child = subprocess.Popen(
                [*self._command, *options], stdin=subprocess.DEVNULL, start_new_session=True
            )
        except OSError as error:
            log.warning(pairs("not_started", command="outputs-off", reason=error))

    def _running(self) -> bool:
        return self._child is not None and self._child.poll() is None

    def _judge(self, now: float, unsafe: Collection[str] = ()) -> None:
        """What came of a try. `unsafe`: what is left of our own record, which is not tried again."""
        self.close()
        if left := self.left():
            if self._next_at == math.inf:
                log.error(pairs("predecessor_not_off", claimed=", ".join(left)))
            self._next_at = now + self._pause_s
            self._pause_s = min(2 * self._pause_s, PAUSE_MOST_S)
            return
        self._next_at = math.inf
        if not unsafe:
            log.info(pairs("predecessor_outputs_off"))


class SafeFirst:
    """A device (`drivers.Driver`) that a dead daemon may have left on, and that did not answer yet:
    made safe as soon as it does, before anything else is asked of it.
    """

    def __init__(self, name: str, driver: Driver[Any, Any]) -> None:
        self._name = name
        self._driver = driver
        self._safe = False
        self.read = driver.read
        self.write = driver.write
        self.make_safe = driver.make_safe
        self.close = driver.close

    def open(self) -> None:
        """Claim it, and the first time make it safe."""
        self._driver.open()
        if not self._safe:
            self._driver.make_safe()
            self._safe = True
            log.info(pairs("predecessor_outputs_off", device=self._name))

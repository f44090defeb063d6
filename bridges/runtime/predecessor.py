"""Switches off the outputs that a dead daemon left on, before this daemon claims outputs. Each dead
daemon has left a record of its outputs (`record.py`).

The separate process `outputs-off` does the work, as after every death of a daemon. So this daemon does
not hang if the process hangs. The process uses the profiles in the dead daemon's record.

Devices that do not answer are reported. While this daemon serves, it repeats the attempts to switch
them off. It does not repeat this for devices that are in its own record too. `SafeFirst` switches such
a device off when the device first answers.

Another process may already have tried the devices, after the death or at boot. In that case this daemon
does not try them again at its start.
"""

import logging
import math
import subprocess
import time
from collections.abc import Callable, Collection, Sequence
from typing import Any

from bridges.runtime.record import ClaimRecord, Records
from bridges.system.log import pairs
from drivers import Driver

log = logging.getLogger(__name__)

PATIENCE_S = 15.0
"""The longest wait (s) for the process `outputs-off`. The process itself gives up after 5 s, but may
need long to start on a slow machine."""
PAUSE_FIRST_S, PAUSE_MOST_S = 5.0, 60.0


LOOK_EVERY_S = 0.02


class Predecessor:
    """The records of dead daemons, and the attempts to switch their outputs off.

    `ours`: this daemon's own record. `command`: the command `outputs-off` for this daemon's file.
    """

    def __init__(self, records: Records, ours: ClaimRecord, command: Sequence[str]) -> None:
        self._records = records
        self._ours = ours
        self._command = command
        self._child: subprocess.Popen[bytes] | None = None
        self._pause_s = PAUSE_FIRST_S
        self._next_at = math.inf

    def make_safe(self, wait: Callable[[float], bool]) -> frozenset[str]:
        """Switch off the outputs that dead daemons left on, before this daemon claims outputs. Return
        the devices in our own record that are not verified off.

        Wait for the end of `outputs-off`, but at most PATIENCE_S. `wait(s)` waits, and returns True if
        the daemon must end. In that case, stop waiting for `outputs-off`.
        """
        found = self._records.unreleased()
        if found:
            log.warning(pairs("daemon_had_died", claimed=", ".join(r.name for r in found)))
        if names := [r.name for r in found if r.name != self._ours.name or not r.tried]:
            self._start(names)
            give_up_at = time.monotonic() + PATIENCE_S
            while self._running() and time.monotonic() < give_up_at:
                if wait(LOOK_EVERY_S):
                    break
            self._judge(time.monotonic(), self._own_unsafe())
        return self._own_unsafe()

    def left(self) -> list[str]:
        """Return the names of other daemons' records with outputs that are not verified off."""
        return [r.name for r in self._records.unreleased() if r.name != self._ours.name]

    def tick(self, now: float) -> None:
        """Try again, after a pause, to switch off the outputs that are not verified off. The daemon
        calls this method about once a second."""
        if self._child is not None and not self._running():
            self._judge(now)
        elif self._child is None and now >= self._next_at:
            self._start(self.left())

    def close(self) -> None:
        """Stop the attempts. The `outputs-off` that runs after this daemon's end handles the remaining
        records."""
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
        """Note the result of an attempt. `unsafe`: the devices of our own record that are not verified
        off. `SafeFirst` handles these devices."""
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
    """A driver that wraps the driver of a silent device, because a dead daemon may have left this
    device on. When the device first answers, its outputs are switched off before anything else
    happens."""

    def __init__(self, name: str, driver: Driver[Any, Any]) -> None:
        self._name = name
        self._driver = driver
        self._safe = False
        self.read = driver.read
        self.write = driver.write
        self.make_safe = driver.make_safe
        self.close = driver.close

    def open(self) -> None:
        """Claim the device. At the first success, also switch the outputs off."""
        self._driver.open()
        if not self._safe:
            self._driver.make_safe()
            self._safe = True
            log.info(pairs("predecessor_outputs_off", device=self._name))

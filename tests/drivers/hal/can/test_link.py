"""Tests of the wait for frames of one bus. The bus has a file descriptor, like the kernel's
interfaces."""

import select
import socket
from typing import Any

import can
import can.bus
import pytest

from drivers.hal.can.frames import Frame
from drivers.hal.can.link import Link

HOUR_S = 3600.0


class Interface(can.BusABC):
    """A bus with a file descriptor. Each byte in the file stands for one frame. The byte is the frame's
    id.

    `waits` has the time limit (s) of each call of `recv`.
    """

    def __init__(self) -> None:
        self._near, self.far = socket.socketpair()
        self.waits: list[float | None] = []
        super().__init__("can0")

    def fileno(self) -> int:
        """Return the file on which the link waits."""
        return self._near.fileno()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        self.waits.append(timeout)
        if timeout:
            return None, False  # only the test's clock decides how long this wait is
        return can.Message(arbitration_id=self._near.recv(1)[0], is_extended_id=False), False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Do nothing, because no test here sends."""

    def shutdown(self) -> None:
        """Close both ends of the file."""
        super().shutdown()
        self._near.close()
        self.far.close()


def test_a_clock_that_is_set_back_during_a_wait_does_not_prolong_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shown = iter([0.0, -HOUR_S, HOUR_S, HOUR_S, HOUR_S, HOUR_S])
    monkeypatch.setattr(can.bus, "time", lambda: next(shown))
    bus = Interface()
    link = Link(lambda: bus, "can0", timeout_s=0.05)
    link.open()
    heard: list[Any] = [link.receive(0.001)]
    bus.far.send(b"\x07")
    heard.append(link.receive(0.001))
    link.close()
    assert (heard, bus.waits) == ([None, Frame(7, b"")], [0])


class Guarded(can.BusABC):
    """A bus in virtual time, on which a master guards a node that is off. Each PERIOD_S a remote frame
    comes, and nothing else. `now` is the time (s)."""

    PERIOD_S = 0.05

    def __init__(self, file: bool) -> None:
        self.now = 0.0
        self._file = file
        self._next_at = self.PERIOD_S
        super().__init__("can0")

    def fileno(self) -> int:
        """Return the number of a file that nobody reads, because the test replaces `select`."""
        if not self._file:
            raise NotImplementedError
        return 0

    def select(self, readable: list[int], _w: object, _x: object, wait_s: float) -> list[list[int]]:
        """Wait for the next remote frame, as `select.select` does."""
        comes = self._next_at <= self.now + wait_s
        self.now = max(self.now, self._next_at) if comes else self.now + wait_s
        return [readable if comes else []]

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if not self.select([0], None, None, timeout or 0.0)[0]:
            return None
        self._next_at += self.PERIOD_S
        return can.Message(arbitration_id=0x70A, is_remote_frame=True, is_extended_id=False)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Do nothing, because no test here sends."""


@pytest.mark.parametrize("file", [True, False])
def test_frames_without_a_meaning_do_not_prolong_a_wait(
    file: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = Guarded(file)
    monkeypatch.setattr(select, "select", bus.select)
    link = Link(lambda: bus, "can0", timeout_s=0.05, clock=lambda: bus.now)
    link.open()
    assert link.receive(0.22) is None
    assert bus.now == pytest.approx(0.22)
    link.close()

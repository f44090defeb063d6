"""Tests of the wait for frames of one bus. The bus has a file descriptor, like the kernel's
interfaces."""

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

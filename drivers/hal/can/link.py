"""One CAN bus through python-can. The bus is on an interface of the kernel (SocketCAN), or on an slcan
adapter.

python-can opens, reads and sends. This file corrects the following behaviour of python-can:

- python-can's `recv` waits by the wall clock. If somebody sets the clock back by an hour, `recv` waits
  an hour longer on a silent bus. So this file waits itself, and calls `recv` only for data that has
  already come.
- python-can may return no frame although an slcan adapter has sent more data. This happens when the
  adapter sends an acknowledgement first. So this file reads again.
- Bytes that are not slcan break python-can's parser permanently. So this file opens the adapter again.
- python-can's slcan write waits for the adapter without limit. In this file the write has `timeout_s`.
- An interface that is down or gone raises many types of exceptions. This file turns each exception into
  a LinkDown, whose text says what to do.
- SocketCAN reports the bus's own troubles as error frames (linux/can/error.h). This file decodes them.
"""

import errno
import logging
import os
import select
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final

import can
import serial
from can import BusABC, Message
from can.exceptions import CanInitializationError, error_check
from can.interfaces.slcan import slcanBus

from drivers.hal.can.frames import EXTENDED, Frame, LinkDown, Trouble
from drivers.hal.can.settings import Slcan

logging.getLogger("can").setLevel(logging.CRITICAL)  # silenced: LinkDown reports the same failures

FAILURES: Final = (can.CanError, serial.SerialException, OSError, ValueError, IndexError)
"""The errors of python-can and its libraries. python-can's parser raises ValueError and IndexError."""
IN_ONE_GO: Final = 4096
"""The maximum number of lines that one call reads from an adapter. If none of them is a frame, the call
returns without a frame."""

BUS_OFF: Final = 0x40
RESTARTED: Final = 0x100
TROUBLES: Final = {
    BUS_OFF: "bus-off",
    0x20: "nobody acknowledges frames",
    0x04: "the controller counts many errors",
    0x80: "bus errors",
    0x08: "protocol errors",
    0x10: "transceiver errors",
    0x01: "frames cannot be sent in time",
}
"""Bits of an error frame's id (linux/can/error.h). The most serious bit comes first."""


Vendor = Callable[[], BusABC]
"""A function that opens a bus with python-can and returns it."""


def socketcan(interface: str) -> BusABC:
    """Open an interface of the kernel. The interface already has a bitrate, which `ip link` has set."""
    from can.interfaces.socketcan import SocketcanBus

    return SocketcanBus(channel=interface)


def slcan(settings: Slcan) -> BusABC:
    """Open an adapter on a serial port, exclusively."""
    return SlcanAdapter(
        settings.port,
        tty_baudrate=settings.baudrate,
        bitrate=settings.bitrate,
        sleep_after_open=0,
        timeout=0,
    )


class SlcanAdapter(slcanBus):
    """python-can's adapter with two changes. The port is exclusive, and writes have a time limit."""

    def _write(self, string: str) -> None:
        with error_check("Could not write to serial device"):
            self.serialPortOrig.write(string.encode() + self.LINE_TERMINATOR)

    def open(self) -> None:
        """Open the port exclusively."""
        with error_check(exception_type=CanInitializationError):
            self.serialPortOrig.exclusive = True
        super().open()


class Link:
    """One bus. The link opens the bus again when needed. `where` is the bus's name in errors. Tests
    replace `clock`, which gives seconds."""

    def __init__(
        self,
        vendor: Vendor,
        where: str,
        timeout_s: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._now = clock
        self._vendor = vendor
        self._where = where
        self._timeout_s = timeout_s
        self._bus: BusABC | None = None
        self._readable: Callable[[float], bool] | None = None

    def open(self) -> None:
        """Open the bus if it is closed. Raises LinkDown."""
        if self._bus is not None:
            return
        try:
            self._bus = self._vendor()
        except FAILURES as error:
            raise LinkDown(self._explained(error)) from error
        self._readable = _selecting(self._bus)

    def receive(self, wait_s: float) -> Frame | Trouble | None:
        """Return the next frame or trouble. Return None if nothing comes within `wait_s`. Lines and
        frames without a meaning do not prolong the wait. Raises LinkDown."""
        assert self._bus is not None
        deadline = self._now() + wait_s
        for _ in range(IN_ONE_GO):
            left_s = max(0.0, deadline - self._now())
            try:
                if self._readable and not self._readable(left_s):
                    return None
                message = self._bus.recv(0 if self._readable else left_s)
            except FAILURES as error:
                raise LinkDown(self._explained(error)) from error
            if message is None and self._readable is None:
                return None
            if message is not None and (meant := _meaning(message)):
                return meant
        return None

    def send(self, frame: Frame) -> None:
        """Send a frame. Raises LinkDown. Success does not prove that any device has read the frame."""
        assert self._bus is not None
        message = can.Message(
            arbitration_id=frame.id & ~EXTENDED,
            is_extended_id=bool(frame.id & EXTENDED),
            data=frame.payload,
        )
        try:
            self._bus.send(message, timeout=self._timeout_s)
        except FAILURES as error:
            raise LinkDown(self._explained(error)) from error

    def close(self) -> None:
        """Close the interface, whatever its state. The caller may call `close` twice."""
        bus, self._bus = self._bus, None
        if bus is None:
            return
        with suppress(*FAILURES):
            bus.shutdown()
        port = getattr(bus, "serialPortOrig", None)
        if port is not None:  # python-can does not close the port of an unplugged adapter
            with suppress(*FAILURES):
                port.close()

    def _explained(self, error: BaseException) -> str:
        code = _code(error)
        hint = _HINTS.get(code, os.strerror(code) if code else _printable(str(error)))
        return f"CAN {self._where}: {hint.format(where=self._where)}"


_HINTS: Final = {
    errno.ENODEV: "no such interface; see `ip link show type can`",
    errno.ENXIO: "no such interface; see `ip link show type can`",
    errno.ENETDOWN: "the interface is down; sudo ip link set {where} up type can bitrate 250000"
    " restart-ms 100, with the bitrate of your charger",
    errno.ENOBUFS: "frames pile up because no device acknowledges them; is the device powered,"
    " wired and terminated, and has it the same bitrate?",
    errno.EAFNOSUPPORT: "this kernel has no CAN; sudo modprobe can-raw",
    errno.ENOENT: "the adapter is not there; is it plugged in? ls /dev/serial/by-id",
    errno.EACCES: "no permission; the daemon's user must be in the group dialout",
    errno.EAGAIN: "another program has it open",
    errno.EBUSY: "another program has it open",
}


def _selecting(bus: BusABC) -> Callable[[float], bool] | None:
    """Return a function that waits for input. Return None for a simulated bus inside this process,
    because such a bus has no file to wait for."""
    try:
        descriptor = bus.fileno()
    except NotImplementedError:
        return None
    return lambda wait_s: bool(select.select([descriptor], [], [], wait_s)[0])


def _meaning(message: Message) -> Frame | Trouble | None:
    """Return the data frame, or the trouble that the controller reports. Return None for remote and FD
    frames."""
    if message.is_error_frame:
        found = message.arbitration_id
        if found & RESTARTED and not found & BUS_OFF:
            return Trouble("", bus_off=False)
        text = next((text for bit, text in TROUBLES.items() if found & bit), "")
        return Trouble(text, bool(found & BUS_OFF)) if text else None
    if message.is_remote_frame or message.is_fd:
        return None
    extended = EXTENDED if message.is_extended_id else 0
    return Frame(message.arbitration_id | extended, bytes(message.data))


def _code(error: BaseException | None) -> int:
    """Return the errno of an error or of its cause. Return 0 if neither has an errno."""
    while error is not None:
        code = getattr(error, "error_code", None) or getattr(error, "errno", None)
        if isinstance(code, int):
            return code
        error = error.__cause__ or error.__context__
    return 0


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:120])

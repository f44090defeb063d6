"""systemd's notifications: READY=1, WATCHDOG=1, STOPPING=1 (sd_notify(3))."""

import os
import socket
from collections.abc import Mapping


def notify(state: str, environ: Mapping[str, str] = os.environ) -> None:
    """Send a notification to systemd. Do nothing without NOTIFY_SOCKET. If the socket is full, the
    notification is lost.

    Raises OSError if no file descriptor is left, or if writing is not permitted.
    """
    path = environ.get("NOTIFY_SOCKET", "")
    if not path:
        return
    address = "\0" + path[1:] if path.startswith("@") else path
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as out:
        out.setblocking(False)
        try:
            out.sendto(state.encode(), address)
        except (BlockingIOError, ConnectionRefusedError, FileNotFoundError):
            return


def watchdog_s(environ: Mapping[str, str] = os.environ) -> float | None:
    """Return the maximum time (s) between two WATCHDOG=1 that systemd allows. Return None if systemd
    does not watch this process."""
    usec = environ.get("WATCHDOG_USEC", "")
    ours = environ.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
    return int(usec) / 1e6 if usec.isdigit() and ours else None

"""systemd's notification protocol: READY=1, WATCHDOG=1, STOPPING=1 (sd_notify(3))."""

import os
import socket
from collections.abc import Mapping


def notify(state: str, environ: Mapping[str, str] = os.environ) -> None:
    """Notify systemd; do nothing if NOTIFY_SOCKET is not set. A full socket drops the message.

    Raises OSError if no file descriptor is left, or writing is not permitted.
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
    """Return the longest time (s) that systemd allows between two WATCHDOG=1; None if systemd has no
    watchdog for this process."""
    usec = environ.get("WATCHDOG_USEC", "")
    ours = environ.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
    return int(usec) / 1e6 if usec.isdigit() and ours else None

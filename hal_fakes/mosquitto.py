"""A real broker on 127.0.0.1. The broker is mosquitto, in a process that tests can kill, freeze and
restart."""

import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import paho.mqtt.client as paho

from drivers.hal import HalError

READY_S: Final = 15.0
LOOK_S: Final = 0.01
PATH: Final = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin"
ENDS_WITH_US: Final = ("setpriv", "--pdeathsig", "KILL")


class Mosquitto:
    """A broker at `port`. `lines` are further lines of its configuration, such as those for TLS.

    `replace` has the settings with which a bus finds this broker. These settings have no user and no
    TLS, so they need the default `lines`.
    """

    def __init__(self, lines: Sequence[str] = ("allow_anonymous true",)) -> None:
        program = shutil.which("mosquitto", path=PATH)
        if program is None:
            raise HalError("an MQTT broker is missing: sudo apt install mosquitto")
        self.port = _free_port()
        self.replace: dict[str, object] = {
            "host": "127.0.0.1",
            "port": self.port,
            "tls": None,
            "user": None,
            "password_file": None,
        }
        self._folder = tempfile.TemporaryDirectory(prefix="mosquitto-")
        file = Path(self._folder.name) / "mosquitto.conf"
        always = (
            "user root",
            f"listener {self.port} 127.0.0.1",
            "persistence false",
            "log_type none",
        )
        file.write_text("\n".join((*always, *lines, "")))
        self._command = (*ENDS_WITH_US, program, "-c", str(file))
        self._process: subprocess.Popen[bytes] | None = None
        self.start()

    def start(self) -> None:
        """Start the broker, and wait until it listens. The broker does not remember earlier messages.
        Raises HalError."""
        self._process = subprocess.Popen(
            self._command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        deadline = time.monotonic() + READY_S
        while not _listens(self.port):
            if self._process.poll() is not None or time.monotonic() > deadline:
                raise HalError(f"mosquitto does not start: {' '.join(self._command)}")
            time.sleep(LOOK_S)

    def kill(self) -> None:
        """Kill the broker with SIGKILL, which has the effect of a power cut."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()

    def freeze(self) -> None:
        """Freeze the broker. It stops working, but every connection stays open."""
        if self._process is not None:
            self._process.send_signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """Let a frozen broker work again."""
        if self._process is not None:
            self._process.send_signal(signal.SIGCONT)

    def close(self) -> None:
        """End the broker. The caller may call `close` twice."""
        self.kill()
        self._folder.cleanup()


def end(client: paho.Client) -> None:
    """End the thread of a client that has left its broker, and close the client.

    `loop_stop` leaves the two sockets open that wake the thread (paho-mqtt 2.2). The garbage collector
    would close them at a random later time, with a warning.
    """
    client.loop_stop()
    client.reinitialise()


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port: int = server.getsockname()[1]
        return port


def _listens(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), timeout=READY_S).close()
    except OSError:
        return False
    return True

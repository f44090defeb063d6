"""The control socket to the plants of a running simulation.

The socket is AF_UNIX and carries lines of text. Words with spaces are in quotes. The answer to each
line is `ok` or `error TEXT`:

- `follow`: from now on every edge is sent as a line of JSON,
  `{"at": s monotonic, "device": …, "what": "relay"|"sensor", "signal": …, "value": …}`
- `fail DEVICE PART MODE`: a wire or part fails (`off`, `stuck`, `slow`, `garbage`, `wrong`), or works
  again (`ok`)
- `press DEVICE SIGNAL on|off`: a person or the building acts
- `names`: answered with a line of JSON, `{DEVICE: {"press": [SIGNAL, …], "fail": [PART, …]}}`
"""

import contextlib
import json
import logging
import shlex
import socket
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import msgspec

from bridges.system.log import pairs
from drivers.hal.points import HalError
from hal_fakes.plants.plant import Edge, FailureMode, Plant

log = logging.getLogger(__name__)


class Control:
    """The server. One thread accepts callers. Each caller has a thread that reads this caller's
    orders."""

    def __init__(self, path: Path, plants: Mapping[str, Plant]) -> None:
        self.path = path
        self._plants = plants
        self._followers: set[socket.socket] = set()
        self._callers: dict[socket.socket, threading.Thread] = {}
        self._lock = (
            threading.Lock()
        )  # guards followers and callers; no thread holds this lock while it calls a plant
        self._listener = _listen(path)
        for plant in plants.values():
            plant.on_edge = self._tell
        self._thread = threading.Thread(target=self._accept, name="plant control", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening, close the connections, and remove the socket. The caller may call `close`
        twice."""
        for plant in self._plants.values():
            plant.on_edge = None
        _hang_up(self._listener)
        self._thread.join()
        with self._lock:
            callers = dict(self._callers)
        for caller, thread in callers.items():
            _hang_up(caller)
            thread.join()
        self._listener.close()
        self.path.unlink(missing_ok=True)

    def _accept(self) -> None:
        while True:
            try:
                caller, _ = self._listener.accept()
            except OSError:
                return
            thread = threading.Thread(
                target=self._serve, args=(caller,), name="plant control caller", daemon=True
            )
            with self._lock:
                self._callers[caller] = thread
            thread.start()

    def _serve(self, caller: socket.socket) -> None:
        with caller, caller.makefile("r", encoding="utf-8", errors="replace") as lines:
            with contextlib.suppress(OSError):
                for line in lines:
                    self._answer(caller, line)
            with self._lock:
                self._callers.pop(caller, None)
                self._followers.discard(caller)

    def _answer(self, caller: socket.socket, line: str) -> None:
        answer = "ok"
        words: list[str] = []
        try:
            words = shlex.split(line)
            if words == ["names"]:
                answer = json.dumps({name: plant.names() for name, plant in self._plants.items()})
            else:
                self._obey(words)
        except ValueError as error:
            answer = f"error {error}"
        with self._lock:
            caller.sendall(answer.encode() + b"\n")
            if answer == "ok" and words == ["follow"]:
                self._followers.add(caller)

    def _obey(self, words: list[str]) -> None:
        match words:
            case ["follow"]:
                return
            case ["fail", device, part, mode]:
                chosen = None if mode == "ok" else cast(FailureMode, mode)
                self._plant(device).fail(part, chosen)
                event = "mended" if chosen is None else "failed"
                log.info(pairs(event, device=device, part=part, mode=mode))
            case ["press", device, signal, "on" | "off" as how]:
                self._plant(device).press(signal, how == "on", time.monotonic())
                log.info(pairs("pressed", device=device, signal=signal, to=how))
            case _:
                raise ValueError(
                    "not understood; write: follow | names | fail DEVICE PART"
                    " off|stuck|slow|garbage|wrong|ok | press DEVICE SIGNAL on|off"
                )

    def _plant(self, device: str) -> Plant:
        if device not in self._plants:
            raise ValueError(f"no device {device!r}; there are {', '.join(sorted(self._plants))}")
        return self._plants[device]

    def _tell(self, edge: Edge) -> None:
        line = msgspec.json.encode(edge) + b"\n"
        with self._lock:
            for follower in list(self._followers):
                if not _sent(follower, line):
                    self._followers.discard(follower)
                    _hang_up(follower)


def _sent(follower: socket.socket, line: bytes) -> bool:
    """Send without waiting, because a follower that does not read must not stop the plants. Return
    whether the line was sent."""
    try:
        return follower.send(line, socket.MSG_DONTWAIT) == len(line)
    except OSError:
        return False


def _listen(path: Path) -> socket.socket:
    path.unlink(missing_ok=True)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        listener.bind(str(path))
    except OSError as error:
        listener.close()
        raise HalError(f"cannot make the plant's control socket {path}: {error}") from error
    listener.listen()
    return listener


def _hang_up(end: socket.socket) -> None:
    with contextlib.suppress(OSError):
        end.shutdown(socket.SHUT_RDWR)

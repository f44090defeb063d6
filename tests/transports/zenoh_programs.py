"""Foreign programs on zenoh. Each program runs in a separate process, on 127.0.0.1."""

import json
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bridges.transports.zenoh.config import LOOPBACK_PORT

READER = Path(__file__).with_name("rmw_zenoh_reader.py")


def meeting(domain: int) -> str:
    """Return the endpoint on this machine where our nodes of a domain meet."""
    return f"tcp/127.0.0.1:{LOOPBACK_PORT + domain}"


def free_port() -> int:
    """Return a free TCP port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Written:
    """The lines that a program has written."""

    def __init__(self) -> None:
        self.lines: list[dict[str, Any]] = []

    def values(self, key: str) -> list[Any]:
        """Return the value of `key` from each line that has this key."""
        return [line[key] for line in self.lines if key in line]


@contextmanager
def reading(endpoint: str, *orders: str) -> Iterator[Written]:
    """Run rmw_zenoh_reader.py until the `with` block ends."""
    written = Written()
    command = [sys.executable, str(READER), endpoint, *orders]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        thread = threading.Thread(target=_collect, args=(child.stdout, written))
        thread.start()
        try:
            yield written
        finally:
            assert child.stdin is not None
            child.stdin.close()
            child.wait()
            thread.join()


def _collect(lines: Any, written: Written) -> None:
    for line in lines:
        written.lines.append(json.loads(line))


class Router:
    """A router of the zenoh library. The test can kill and restart the router's process.

    `config` has all settings except the endpoint.
    """

    def __init__(self, endpoint: str | None = None, **config: Any) -> None:
        self.endpoint = endpoint or f"tcp/127.0.0.1:{free_port()}"
        self._config = {
            "mode": "router",
            "listen/endpoints": [self.endpoint],
            "scouting/multicast/enabled": False,
            "timestamping/enabled": True,
            **{key.replace("__", "/"): value for key, value in config.items()},
        }
        self._child: subprocess.Popen[str] | None = None

    def start(self) -> None:
        """Start the router, and wait until it listens."""
        command = [
            sys.executable,
            "-m",
            "tests.transports.zenoh_programs",
            json.dumps(self._config),
        ]
        self._child = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._child.stdout is not None
        assert self._child.stdout.readline() == "listening\n"

    def leave(self) -> None:
        """End the router. The router says farewell to its peers, as when an operator stops it."""
        if self._child:
            assert self._child.stdin is not None
            assert self._child.stdout is not None
            self._child.stdin.close()
            self._child.wait()
            self._child.stdout.close()
            self._child = None

    def die(self) -> None:
        """Kill the router's process."""
        if self._child:
            self._child.kill()
        self.leave()


def route(config: dict[str, Any]) -> None:
    """Run a router until stdin ends."""
    import zenoh

    made = zenoh.Config()
    for key, value in config.items():
        made.insert_json5(key, json.dumps(value))
    with zenoh.open(made):
        print("listening", flush=True)  # noqa: T201
        sys.stdin.read()


if __name__ == "__main__":
    route(json.loads(sys.argv[1]))

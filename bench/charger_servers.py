"""HTTP chargers for the benchmarks, in a separate process.

A sound charger answers at once. A dead charger never answers. A trickling charger sends its answer byte
by byte. The process prints the ports as one JSON line, and serves until its standard input ends.
"""

import asyncio
import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

BODY: Final = b'{"state": 0, "error_msg": ""}'
HEAD: Final = b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n"
TRICKLE_S: Final = 0.25
"""The time (s) between two bytes of a trickling charger. It is shorter than any timeout for a single
read."""


PERIOD_S: Final = 1.0
TIMEOUT_S: Final = 1.0
CODES: Final = {"idle": [0], "charging": [5], "error": [8]}


@contextmanager
def http_chargers(sound: int, dead: int = 0, trickling: int = 0) -> Iterator[list[int]]:
    """Serve these numbers of chargers, and yield the ports."""
    counts = [str(count) for count in (sound, dead, trickling)]
    command = [sys.executable, "-m", "bench.charger_servers", *counts]
    far = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert far.stdin
    assert far.stdout
    try:
        yield json.loads(far.stdout.readline())
    finally:
        far.stdin.close()
        far.wait(10.0)
        far.stdout.close()


def chargers_at(ports: Sequence[int]) -> dict[str, Any]:
    """Return a daemon's YAML with a bus and a charger for each port."""
    settings = {"type": "http", "timeout_s": TIMEOUT_S, "scan_s": PERIOD_S}
    return {
        "kind": "charger",
        "driver": "http",
        "buses": {
            f"tpu_{n}": {**settings, "api_base": f"127.0.0.1:{port}"}
            for n, port in enumerate(ports)
        },
        "chargers": {
            f"charger_{n}": {"bus": f"tpu_{n}", "codes": CODES} for n in range(len(ports))
        },
    }


async def _sound(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Answer each request at once, and keep the connection open."""
    with contextlib.suppress(OSError, asyncio.IncompleteReadError):
        while await reader.readuntil(b"\r\n\r\n"):
            writer.write(HEAD % len(BODY) + BODY)
            await writer.drain()
    writer.close()


async def _dead(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Accept the connection, and send nothing."""
    with contextlib.suppress(OSError):
        while await reader.read(4096):
            pass
    writer.close()


async def _trickling(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Send one byte every TRICKLE_S."""
    with contextlib.suppress(OSError, asyncio.IncompleteReadError):
        await reader.readuntil(b"\r\n\r\n")
        for byte in HEAD % len(BODY) + BODY:
            writer.write(bytes((byte,)))
            await writer.drain()
            await asyncio.sleep(TRICKLE_S)
    writer.close()


async def _serve(sound: int, dead: int, trickling: int) -> None:
    kinds = [_sound] * sound + [_dead] * dead + [_trickling] * trickling
    servers = [await asyncio.start_server(kind, "127.0.0.1", 0) for kind in kinds]
    print(json.dumps([server.sockets[0].getsockname()[1] for server in servers]), flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    os._exit(0)  # end at once, because some connections would never close


if __name__ == "__main__":
    asyncio.run(_serve(*map(int, sys.argv[1:4])))

"""The far side of the charger bench, a process of its own: sound, dead and trickling HTTP chargers.

Prints the ports, one JSON line, and serves until its standard input ends.
"""

import asyncio
import contextlib
import json
import os
import sys
from typing import Final

BODY: Final = b'{"state": 0, "error_msg": ""}'
HEAD: Final = b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n"
TRICKLE_S: Final = 0.25
"""Between two bytes: shorter than any timeout for one read."""


async def _sound(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Answers at once, on a connection that is kept."""
    with contextlib.suppress(OSError, asyncio.IncompleteReadError):
        while await reader.readuntil(b"\r\n\r\n"):
            writer.write(HEAD % len(BODY) + BODY)
            await writer.drain()
    writer.close()


async def _dead(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Takes the connection and says nothing."""
    with contextlib.suppress(OSError):
        while await reader.read(4096):
            pass
    writer.close()


async def _trickling(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """One byte now and then."""
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
    os._exit(0)  # conversations that would never end are not worth a goodbye


if __name__ == "__main__":
    asyncio.run(_serve(*map(int, sys.argv[1:4])))

"""The far side of a `line` bus. A real server on 127.0.0.1 gives each question to all stations."""

import socketserver
import threading
from collections.abc import Sequence
from typing import Any, Protocol

from hal_fakes.fake import Outside


class Station(Protocol):
    """A station on the line. It answers only questions that name the station."""

    def answer(self, question: str) -> str:
        """Return one line of text, or "" if the question is for another station."""


class LineServer:
    """A server that runs until `close`."""

    def __init__(self, stations: Sequence[Station]) -> None:
        class Answer(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                question = self.rfile.readline().decode().strip()
                self.wfile.write("".join(s.answer(question) for s in stations).encode() + b"\n")

        self._server = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Answer)
        self.replace: dict[str, Any] = {
            "host": "127.0.0.1",
            "port": self._server.server_address[1],
        }
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the server."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


FAKE: Outside[Any, Station] = Outside(lambda settings, stations: LineServer(stations))

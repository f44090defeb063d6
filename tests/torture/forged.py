"""Forged bytes on each wire for a fixed time. The daemon must live, log little, and end on SIGTERM."""

import os
import pty
import random
import re
import selectors
import signal
import socket
import struct
import subprocess
import threading
import time
import tty
from collections.abc import Callable
from pathlib import Path

from hal_fakes.domain import domain_for_a_while
from tests.runtime.site import ROOT, YAML, Daemon
from tests.torture.table import Table

SERVICE = {"RMF_BRIDGE_SERVICE": "1"}
SERIAL = r"/dev/serial/by-id/[^ ,}\n]*"
LINES_MOST = 200
"""The most lines that a daemon may log under attack. A stranger must not be able to fill the log."""


class Liar:
    """A server that answers everything with forged bytes until the test closes it. `count` counts the
    answers."""

    def __init__(self, rng: random.Random) -> None:
        self.count = 0
        self._rng = rng
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self) -> None:
        """Stop sending, and wait for the thread."""
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        raise NotImplementedError

    def _forged(self, heard: bytes) -> bytes:
        """Return bytes that often begin like a true answer, but that never form a whole true answer."""
        self.count += 1
        forged = heard[: self._rng.randrange(12)] + self._rng.randbytes(self._rng.randrange(1, 40))
        return b"HTTP/1.1 200 OK\r\n" + forged if heard.startswith(b"GET") else forged


class TcpLiar(Liar):
    """A server of Modbus TCP or HTTP that sends forged bytes."""

    def __init__(self, rng: random.Random) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        super().__init__(rng)

    def _run(self) -> None:
        with selectors.DefaultSelector() as ready, self._server:
            ready.register(self._server, selectors.EVENT_READ)
            while not self._stop.is_set():
                for key, _ in ready.select(0.1):
                    if key.fileobj is self._server:
                        ready.register(self._server.accept()[0], selectors.EVENT_READ)
                    elif isinstance(key.fileobj, socket.socket) and not self._answer(key.fileobj):
                        ready.unregister(key.fileobj)
                        key.fileobj.close()
            for key in list(ready.get_map().values()):
                if isinstance(key.fileobj, socket.socket):
                    key.fileobj.close()

    def _answer(self, caller: socket.socket) -> bool:
        try:
            heard = caller.recv(4096)
            caller.sendall(self._forged(heard))
        except OSError:
            return False
        return bool(heard) and self._rng.random() < 0.8


class LineLiar(Liar):
    """A sender of forged bytes at the other end of a serial line. The line is for Modbus RTU or CAN
    (slcan)."""

    def __init__(self, rng: random.Random) -> None:
        self._far, near = pty.openpty()
        tty.setraw(near)
        self.port = os.ttyname(near)
        self._near = near
        super().__init__(rng)

    def _run(self) -> None:
        with selectors.DefaultSelector() as ready:
            ready.register(self._far, selectors.EVENT_READ)
            os.set_blocking(self._far, False)
            while not self._stop.is_set():
                heard = os.read(self._far, 4096) if ready.select(0.02) else b"t1238"
                try:
                    os.write(self._far, self._forged(heard) + b"\r")
                except BlockingIOError:
                    continue
        os.close(self._far)
        os.close(self._near)


class DatagramLiar(Liar):
    """A sender of forged DDS messages that begin like RTPS. It sends to the first four ports that
    processes in the domain use."""

    def __init__(self, rng: random.Random, domain: int) -> None:
        self._domain = domain
        super().__init__(rng)

    def _run(self) -> None:
        guid = self._rng.randbytes(12)
        kinds = (0x01, 0x06, 0x07, 0x08, 0x09, 0x0C, 0x0E, 0x12, 0x13, 0x15, 0x16, 0x30)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not self._stop.is_set():
                body = self._rng.randbytes(self._rng.randrange(0, 80))
                part = struct.pack(
                    "<BBH", self._rng.choice(kinds), self._rng.randrange(8), len(body)
                )
                for index in range(4):
                    to = "127.0.0.1", 7400 + 250 * self._domain + 10 + index
                    sender.sendto(b"RTPS\x02\x01\x01\x10" + guid + part + body, to)
                    self.count += 1


def forged(directory: Path, rng: random.Random, each_s: float, table: Table) -> None:
    """Send forged bytes for `each_s` seconds on one wire after the other."""
    for name, begin in WIRES.items():
        here = directory / name.replace(" ", "_")
        here.mkdir(parents=True)
        with domain_for_a_while() as domain:
            liar, yaml = begin(rng, domain)
            file = here / "device.yaml"
            file.write_text(yaml)
            running = Daemon(file, here / "run", **SERVICE)
            ended = _dies_within(running, each_s)
            liar.close()
            assert not ended, f"{name}: {running.log.read_text()}"
            began = time.monotonic()
            code = running.end(signal.SIGTERM)
            assert time.monotonic() - began < 15
        said = running.log.read_text()
        assert "Traceback" not in said, said
        assert said.count("\n") < LINES_MOST, said
        what = f"forged bytes on {name}, {each_s:g} s"
        table.count(what, f"lived, {said.count(chr(10))} log lines, exit code {code}", liar.count)


def _dies_within(running: Daemon, each_s: float) -> bool:
    try:
        running.process.wait(each_s)
    except subprocess.TimeoutExpired:
        return False
    return True


def _modbus(rng: random.Random, domain: int) -> tuple[Liar, str]:
    liar = TcpLiar(rng)
    return liar, YAML.format(domain=domain, transport="dds", port=liar.port)


def _dds(rng: random.Random, domain: int) -> tuple[Liar, str]:
    return DatagramLiar(rng, domain), YAML.format(domain=domain, transport="dds", port=1)


def _http(rng: random.Random, domain: int) -> tuple[Liar, str]:
    liar = TcpLiar(rng)
    there = f'api_base: "127.0.0.1:{liar.port}/api"'
    return liar, _shipped("charger_http.yaml", domain, r'api_base: "[^"]*"', there)


def _line(name: str, place: str) -> Callable[[random.Random, int], tuple[Liar, str]]:
    def begin(rng: random.Random, domain: int) -> tuple[Liar, str]:
        liar = LineLiar(rng)
        return liar, _shipped(name, domain, place, liar.port)

    return begin


def _shipped(name: str, domain: int, place: str, there: str) -> str:
    """Return a shipped YAML on loopback. Its bus connects to the sender of forged bytes."""
    text = (ROOT / "config" / name).read_text()
    rmf = f"rmf: {{transport: dds, network: localhost, domain_id: {domain}}}\n"
    text = re.sub(r"^rmf:\n(  .*\n)*", rmf, text, flags=re.MULTILINE)
    changed, times = re.subn(place, there, text, count=1)
    assert times == 1, text
    return changed


WIRES: dict[str, Callable[[random.Random, int], tuple[Liar, str]]] = {
    "dds": _dds,
    "modbus tcp": _modbus,
    "modbus rtu": _line("door_rs485.yaml", SERIAL),
    "can (slcan)": _line("charger_wiferion.yaml", SERIAL),
    "http": _http,
}

"""Disturbances of a daemon's wires: spoiled replies, silent devices, zenoh routers, floods of
liveliness tokens, and wrong clocks."""

import json
import random
import signal
import struct
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from bridges.messages.definitions import DoorModeValue
from hal_fakes.domain import domain_for_a_while
from tests.drivers.charger.test_can_wake import CHARGE, START, STOP, Sleeper
from tests.runtime.site import SERVICE, YAML, Daemon, Graph, Module, command
from tests.torture.forged import TcpLiar
from tests.torture.table import Table
from tests.transports.test_zenoh_tokens import stranger
from tests.transports.zenoh_programs import Router, meeting
from tests.waiting import wait_until

PATIENCE_S: Final = 60.0
TOKENS: Final = 5000


def wires(directory: Path, rng: random.Random, each_s: float, times: int, table: Table) -> None:
    """Run all disturbances of this file in turn."""
    directory.mkdir()
    _replies(directory, rng, each_s, table)
    _silences(rng, 20 * times, table)
    _routers(directory, table)
    _tokens(directory, table)
    _past(directory, table)


class Almost(TcpLiar):
    """A fake I/O module of a building whose door is open. In each reply about the door one part is
    wrong."""

    def _forged(self, heard: bytes) -> bytes:
        if len(heard) < 12:  # hang up, because this is too short for a request
            return b""
        number, unit, function = heard[:2], heard[6:7], heard[7]
        if function != 2:
            good = heard[7:12] if function > 4 else bytes((function, 1, 0))
            return number + struct.pack(">HH", 0, len(good) + 1) + unit + good
        self.count += 1
        content = b"\x02\x01\x01"
        match self._rng.randrange(4):
            case 0:
                number = bytes(2)
            case 1:
                number = struct.pack(">H", (int.from_bytes(number, "big") - 1) % 0x10000)
            case 2:
                unit = b"\x02"
            case _:
                content = b"\x82\x00"
        return number + struct.pack(">HH", 0, len(content) + 1) + unit + content


def _replies(directory: Path, rng: random.Random, each_s: float, table: Table) -> None:
    with domain_for_a_while() as domain:
        liar, graph = Almost(rng), Graph(domain)
        file = directory / "almost.yaml"
        file.write_text(YAML.format(domain=domain, transport="dds", port=liar.port))
        running = Daemon(file, directory / "almost", **SERVICE)
        running.wait_for("ready")
        with (
            open("/dev/null") as never,
            subprocess.Popen(["sleep", str(each_s)], stdin=never) as nap,
        ):
            nap.wait()
        assert running.process.poll() is None, running.log.read_text()
        shown = {state.current_mode.value for state in graph.states}
        assert DoorModeValue.MODE_OPEN not in shown
        said = running.log.read_text()
        running.end(signal.SIGTERM)
        liar.close()
        graph.transport.close()
    assert "Traceback" not in said, said
    what = (
        "replies of an open door with number 0 or the previous one, of another unit, or exception 0"
    )
    table.count(what, f"never OPEN, {said.count(chr(10))} log lines", liar.count)


def _silences(rng: random.Random, times: int, table: Table) -> None:
    for _ in range(times):
        charger = Sleeper()
        charger.awake = True
        assert {frame for _, frame in charger.scans(rng.uniform(1, 4), power=True)} == {CHARGE}
        charger.awake = False
        # Wait for 1.5 s, because the charger's last status stays fresh for 1 s.
        charger.scans(1.5, power=True)
        silent = {frame for _, frame in charger.scans(rng.uniform(2, 10), power=True)}
        assert silent == {START, STOP}
        charger.bus.close()
    what = "a charger on CAN that falls silent in a charge (driver, virtual time)"
    table.count(what, "told to wake up and to stop in each period, nothing else", times)


@contextmanager
def _on_zenoh(directory: Path, name: str, **env: str) -> Iterator[tuple[Daemon, Module, Path]]:
    """Yield the daemon of a door. Its zenoh traffic must stay on this machine."""
    here = directory / name
    here.mkdir()
    with domain_for_a_while() as domain:
        module = Module(here, domain, transport="zenoh")
        running = Daemon(module.file, here / "run", **SERVICE, **env)
        running.wait_for("ready")
        try:
            yield running, module, here / "run"
            assert running.process.poll() is None, running.log.read_text()
            assert running.end(signal.SIGTERM) == 0
            assert "Traceback" not in running.log.read_text()
        finally:
            running.process.kill()
            module.close()


def _status(run: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((run / "status.json").read_text())
    return found


def _routers(directory: Path, table: Table) -> None:
    """Let a router come and go three times."""
    with _on_zenoh(directory, "routers") as (running, module, run):
        for _ in range(3):
            router = Router(connect__endpoints=[meeting(module.domain)])
            router.start()
            wait_until(
                lambda: _status(run)["faults"],
                "status shows the missing router as a fault",
                PATIENCE_S,
            )
            asked = command("status", "--runtime-dir", run)
            code = subprocess.run(asked, capture_output=True).returncode
            router.leave()
            wait_until(lambda: not _status(run)["faults"], "the fault is over", PATIENCE_S)
            table.count("a router beside a `network: localhost` service", f"`status` {code}, back")
        lines = running.log.read_text().count("\n")
        table.count("the log of that daemon", f"{lines} lines")


def _tokens(directory: Path, table: Table) -> None:
    with _on_zenoh(directory, "tokens") as (running, module, run), stranger(module.domain) as far:
        kind = "rmf_door_msgs::msg::dds_::DoorRequest_/RIHS01_0"
        far.claims("MP", "door_requests", kind, range(TOKENS))
        wait_until(
            lambda: "crowded" in running.log.read_text(),
            "the log names the crowd of tokens",
            PATIENCE_S,
        )
        written = _status(run)["pid"]
        rss = Path(f"/proc/{written}/status").read_text().partition("VmRSS:")[2].split()[0]
        said = running.log.read_text()
        assert said.count("crowded") == 1
        table.count("liveliness tokens", f"served on, {int(rss) // 1000} MB, one log line", TOKENS)


def _past(directory: Path, table: Table) -> None:
    """Start a daemon whose process sees a time before 1970. Linux itself refuses such a time, so a
    preloaded library changes the clock."""
    source, library = Path(__file__).with_name("past.c"), directory / "past.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    past = directory / "past"
    env = {"LD_PRELOAD": str(library), "RMF_BRIDGES_PAST": str(past)}
    with _on_zenoh(directory, "clock", **env) as (running, _, run):
        for _ in range(3):
            past.touch()
            with subprocess.Popen(["sleep", "3"]) as nap:
                nap.wait()
            assert running.process.poll() is None, running.log.read_text()
            past.unlink()
            before = (run / "status.json").stat().st_mtime
            wait_until(
                lambda before=before: (run / "status.json").stat().st_mtime > before,  # type: ignore[misc]
                "the status file is still written",
                PATIENCE_S,
            )
            table.count("a wall clock before 1970, on zenoh, 3 s", "served on")
        assert "panicked" not in running.log.read_text()

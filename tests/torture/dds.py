"""Disturbances of DDS: messages with names of up to ten megabytes, and a network that fails."""

import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from bridges.messages.definitions import DoorState, Time
from bridges.messages.topics import DOOR_REQUESTS, DOOR_STATES
from hal_fakes.domain import domain_for_a_while
from tests.runtime.site import ROOT, Daemon
from tests.torture.table import Table
from tests.transports.joining import joining
from tests.waiting import wait_until

LIMIT_MIB = 128
"""The memory limit (MiB) of a daemon: MemoryMax in systemd/rmf-bridge@.service."""
FORGERS = 3
DAEMONS = {
    "lift_dry_contact": ["--simulate"],
    "lift_supervisor": [],
    "door_supervisor": [],
    "charger_coordinator": [],
}
NAMES = {"10 MB": 10_000_000, "1 MB": 1_000_000, "60 kB": 60_000}
LOSSES_S = (9.0, 12.0, 20.0)
BACK_S = 3.0
DOMAIN = 5
"""The DDS domain of these tests, which have their own network namespace."""


def long_names(directory: Path, each_s: float, table: Table) -> None:
    """Forge samples on every topic that a daemon hears. Each daemon must go on, and stay below its
    memory limit."""
    for shown, length in NAMES.items():
        found = [_flooded(directory / f"{one}-{length}", one, length, each_s) for one in DAEMONS]
        most_mib = max(mib for mib, _ in found)
        assert most_mib < LIMIT_MIB, f"names of {shown}: {most_mib:.0f} MiB"
        what = f"names of {shown} on dds, {each_s:g} s to each of {len(DAEMONS)} daemons"
        sent = sum(times for _, times in found)
        table.count(what, f"served on, at most {most_mib:.0f} MiB", sent)


def _flooded(directory: Path, name: str, length: int, each_s: float) -> tuple[float, int]:
    """Return a daemon's peak memory (MiB) and the number of forged samples."""
    directory.mkdir(parents=True)
    with domain_for_a_while() as domain:
        file = _on_loopback(name, directory, domain)
        running = Daemon(file, directory / "run", *DAEMONS[name])
        running.wait_for("ready")
        sent = _forge(domain, length, each_s)
        most_mib = _most_mib(running.process.pid)
        assert running.end(signal.SIGTERM) == 0, running.log.read_text()
    return most_mib, sent


def _on_loopback(name: str, directory: Path, domain: int) -> Path:
    text = (ROOT / f"config/{name}.yaml").read_text()
    rmf = f"rmf: {{transport: dds, network: localhost, domain_id: {domain}}}\n"
    file = directory / f"{name}.yaml"
    file.write_text(re.sub(r"^rmf:\n(  .*\n)*", rmf, text, flags=re.MULTILINE))
    return file


def _forge(domain: int, length: int, each_s: float) -> int:
    command = [
        sys.executable,
        "-m",
        "tests.transports.long_samples",
        *map(str, (domain, length, each_s)),
    ]
    forgers = [subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT) for _ in range(FORGERS)]
    return sum(int(forger.communicate()[0]) for forger in forgers)


def _most_mib(pid: int) -> float:
    """Return the peak resident memory of a process (MiB)."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    assert found
    return int(found[1]) / 1024


def lost_network(table: Table) -> None:
    """Take the interface `lo` down and up. A node with RMF's defaults must soon hear our states
    again."""
    inside = f"ip link set lo up && exec {sys.executable} -m tests.torture.dds"
    alone = shutil.which("unshare")
    if not alone or subprocess.run([alone, "-n", "true"], capture_output=True).returncode:
        table.count("no network (needs root and unshare)", "not tried")
        return
    subprocess.run([alone, "-n", "sh", "-c", inside], cwd=ROOT, check=True)
    for loss_s in LOSSES_S:
        table.count(f"no network for {loss_s:g} s, dds", f"heard again within {BACK_S:g} s")


def _in_the_namespace() -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "tests.transports.long_samples", str(DOMAIN)],
        stdin=subprocess.PIPE,
    ) as rmf:
        node = joining("dds", DOMAIN)("ours")
        states, heard = node.publisher(DOOR_STATES), list[float]()
        node.subscribe(DOOR_REQUESTS, lambda request: heard.append(request.request_time.sec))
        sent = 0

        def echoed() -> bool:
            nonlocal sent
            sent += 1
            states.publish(DoorState(Time(sent), "ward"))
            return bool(heard) and heard[-1] >= first

        for loss_s in LOSSES_S:
            first = sent + 1
            wait_until(echoed, "the two nodes hear each other")
            subprocess.run(["ip", "link", "set", "lo", "down"], check=True)
            time.sleep(loss_s)
            subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
            back_at, first = time.monotonic(), sent + 1
            wait_until(echoed, "a state has been there and back")
            took_s = time.monotonic() - back_at
            sys.stderr.write(f"{loss_s:g} s without network, heard again after {took_s:.1f} s\n")
            assert took_s < BACK_S
        node.close()
        assert rmf.stdin
        rmf.stdin.close()


if __name__ == "__main__":
    _in_the_namespace()

import os
import socket
from pathlib import Path

from bridges.runtime.notify import notify, watchdog_s


def _listener(address: str) -> socket.socket:
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    listening.bind(address)
    listening.settimeout(5)
    return listening


def test_systemd_hears_what_it_is_told_on_a_path_and_on_an_abstract_socket(tmp_path: Path) -> None:
    path, name = str(tmp_path / "notify"), f"rmf-bridges-test-{os.getpid()}"
    for address, bound in ((path, path), (f"@{name}", f"\0{name}")):
        with _listener(bound) as listening:
            notify("READY=1", {"NOTIFY_SOCKET": address})
            assert listening.recv(100) == b"READY=1"


def test_without_systemd_nothing_happens(tmp_path: Path) -> None:
    notify("READY=1", {})
    notify("READY=1", {"NOTIFY_SOCKET": str(tmp_path / "nobody")})
    assert list(tmp_path.iterdir()) == []


def test_a_systemd_that_does_not_read_never_blocks_the_daemon(tmp_path: Path) -> None:
    path = str(tmp_path / "full")
    with _listener(path) as listening:
        for _ in range(10_000):
            notify("WATCHDOG=1", {"NOTIFY_SOCKET": path})
        assert listening.recv(100) == b"WATCHDOG=1"


def test_the_watchdog_counts_only_when_it_is_meant_for_this_process() -> None:
    ours, other = str(os.getpid()), str(os.getpid() + 1)
    assert watchdog_s({"WATCHDOG_USEC": "10000000", "WATCHDOG_PID": ours}) == 10.0
    assert watchdog_s({"WATCHDOG_USEC": "10000000"}) == 10.0
    assert watchdog_s({"WATCHDOG_USEC": "10000000", "WATCHDOG_PID": other}) is None
    assert watchdog_s({}) is None

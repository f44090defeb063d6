"""`rmf-bridge notify` beside a real daemon. People get a notice when the daemon dies and when it
returns."""

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hal_fakes.wire import runs_here
from tests.runtime.site import Module, command, daemon, environment
from tests.system.test_certificates import certificate
from tests.waiting import PATIENCE_S, wait_until
from tests.workbench.notify.sink import Sink

FILE = """
after_s: 3
over_s: 3
again_s: 5
to:
  - {{webhook: "{url}"}}
"""


@contextmanager
def notify(file: Path, state: Path, domain: int) -> Iterator[subprocess.Popen[bytes]]:
    graph = ("--localhost", "--domain-id", str(domain), "--transport", runs_here())
    line = command("notify", file, "--state", state, *graph)
    process = subprocess.Popen(line, env=environment())
    try:
        yield process
    finally:
        process.terminate()
        assert process.wait(PATIENCE_S) == 0


def states_are_heard(status: Path) -> None:
    """Wait until another node hears the daemon's states, and two more states have come."""

    def heard() -> bool:
        return bool(json.loads(status.read_text())["heard_by"]["door_states"])

    wait_until(lambda: status.exists() and heard(), "notify listens")
    times = {status.stat().st_mtime_ns}

    def renewed() -> bool:
        times.add(status.stat().st_mtime_ns)
        return len(times) > 3

    wait_until(renewed, "two more states")


@pytest.mark.long(20)
def test_a_killed_daemon_is_told_repeated_until_acknowledged_and_over_when_it_is_back(
    sink: Sink, tmp_path: Path, domain: int
) -> None:
    module = Module(tmp_path, domain, runs_here())
    file = tmp_path / "to.yaml"
    file.write_text(FILE.format(url=sink.url))
    state = tmp_path / "state"

    def got(event: str) -> dict[str, str] | None:
        every = [json.loads(body) for _, body in sink.got]
        return next((one for one in every if one["event"] == event), None)

    with notify(file, state, domain):
        with daemon(module.file, tmp_path / "one", RMF_BRIDGE_SERVICE="1") as running:
            running.wait_for("ready")
            states_are_heard(tmp_path / "one" / "status.json")
            running.end(signal.SIGKILL)
        wait_until(lambda: got("new"), "the death is told")
        told = got("new")
        assert told is not None
        assert told["title"] == "door ward_door is silent"
        assert "its daemon is not running, or is cut off" in told["text"]
        wait_until(lambda: got("again"), "the death is told again")
        acknowledge = command("notify", file, "--state", state, "--ack", told["key"])
        assert subprocess.run(acknowledge, env=environment()).returncode == os.EX_OK
        wait_until(lambda: not [*state.glob("acknowledged*")], "the acknowledgement is taken")
    sink.got.clear()
    with notify(file, state, domain), daemon(module.file, tmp_path / "one") as running:
        running.wait_for("ready")
        wait_until(lambda: got("over"), "its return is told")
        assert [json.loads(body)["event"] for _, body in sink.got] == ["over"]
    module.close()


@pytest.mark.long(8)
def test_the_end_of_a_certificate_is_told(sink: Sink, tmp_path: Path, domain: int) -> None:
    file, ended = tmp_path / "to.yaml", certificate(tmp_path / "page.pem", -3.5)
    file.write_text(f"certificates: [{ended}]\n{FILE.format(url=sink.url)}")
    with notify(file, tmp_path / "state", domain):
        wait_until(lambda: sink.got, "the end is told")
    told = json.loads(sink.got[0][1])
    assert told["severity"] == "critical"
    title = f"certificate {ended} (notify, certificates) ended 3 days ago, on "
    assert told["title"].startswith(title)


@pytest.mark.long(12)
def test_what_a_recipient_has_not_taken_is_sent_after_a_restart(
    sink: Sink, tmp_path: Path, domain: int
) -> None:
    file, state = tmp_path / "to.yaml", tmp_path / "state"
    ended = [certificate(tmp_path / f"{n}.pem", -3.5) for n in range(2)]
    file.write_text(f"certificates: [{ended[0]}, {ended[1]}]\n{FILE.format(url=sink.url)}")
    sink.status = 500
    with notify(file, state, domain):
        wait_until(lambda: sink.got, "a notice is refused")
    sink.status = 200
    sink.got.clear()

    def taken() -> set[str]:
        return {json.loads(body)["key"] for _, body in sink.got}

    wanted = {f"daemon notify: CERTIFICATE_EXPIRES certificates {one}" for one in ended}
    with notify(file, state, domain):
        wait_until(lambda: taken() == wanted, "each notice")
        for key in wanted:
            acknowledge = command("notify", file, "--state", state, "--ack", key)
            assert subprocess.run(acknowledge, env=environment()).returncode == os.EX_OK
        wait_until(lambda: not [*state.glob("acknowledged*")], "each acknowledgement is taken")
    told = json.loads((state / "told.json").read_text())["told"]
    assert {one["trouble"]["what"].split()[-1] for one in told if one["acknowledged"]} == {
        str(one) for one in ended
    }
    assert all(one["acknowledged"] for one in told)


def test_an_acknowledgement_is_readable_for_the_service_under_any_umask(tmp_path: Path) -> None:
    file, state = tmp_path / "to.yaml", tmp_path / "state"
    file.write_text(FILE.format(url="https://chat.example/hook"))
    acknowledge = command("notify", file, "--state", state, "--ack", "door ward: SILENT")
    assert subprocess.run(acknowledge, env=environment(), umask=0o077).returncode == os.EX_OK
    [written] = state.iterdir()
    assert written.stat().st_mode & 0o777 == 0o644

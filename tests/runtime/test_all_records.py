"""The command `outputs-off --all-records`. After a power cut the command runs before any daemon."""

import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from bridges.cli import main
from bridges.runtime import record
from bridges.settings.load import load
from drivers.profiles import texts
from tests.runtime.site import Module, environment
from tests.waiting import wait_until

COIL_OFF = bytes.fromhex("0001 0000 0006 01 05 0000 0000")
COIL_ON = bytes.fromhex("0001 0000 0006 01 05 0000 ff00")
"""A Modbus TCP request: transaction 1, unit 1, write single coil 0, on."""


def died(state: Path, file: Path, later: bytes = b"") -> Path:
    """Write the record that a daemon leaves behind when the power fails. Return the record's path.

    `later` is appended to the YAML text in the record, as if a later version of the daemon had written
    it.
    """
    left = record.of(load(file))
    if later:
        left = msgspec.structs.replace(left, yaml=left.yaml + later, claim=None)
    texts.give({})
    path = state / "rmf-bridge" / file.stem / left.name
    path.parent.mkdir(mode=0o700, parents=True)
    path.write_bytes(msgspec.json.encode(left))
    return path


@pytest.fixture
def module(tmp_path: Path, domain: int) -> Iterator[Module]:
    """Yield a module whose relay is on."""
    made = Module(tmp_path, domain)
    with socket.create_connection(("127.0.0.1", port(made.file))) as wire:

        def is_on() -> bool:  # sends again, because the test may miss the first edge
            for frame in (COIL_OFF, COIL_ON):
                wire.sendall(frame)
                assert wire.recv(64)
            return made.relay()[-1:] == [True]

        wait_until(is_on, "the relay is on")
    yield made
    made.close()


def port(file: Path) -> int:
    """Return the TCP port of the module in a file."""
    found = int(load(file).buses["module"].tcp.port)
    texts.give({})
    return found


def booted(state: Path, own_s: float = 20.0, before: str = "") -> subprocess.CompletedProcess[str]:
    """Run the command that a unit runs at boot. The folder `state` holds the state directories and the
    YAML files. The code `before` runs first."""
    code = (
        "import os, pathlib, sys; from bridges.runtime.all_records import switch_off_all;"
        f"here = pathlib.Path({str(state)!r}); {before}\n"
        f"sys.exit(switch_off_all(here / 'rmf-bridge', here / 'run', here, {own_s}, 20))"
    )
    env = environment()
    return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)


@pytest.mark.long(25)
def test_a_relay_goes_off_though_another_services_module_never_answers(
    tmp_path: Path, module: Module
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        dead = tmp_path / "dead_door.yaml"
        silent_port = str(silent.getsockname()[1])
        dead.write_text(module.yaml.replace(str(port(module.file)), silent_port))
        answers, never = died(tmp_path, module.file), died(tmp_path, dead)
        done = booted(tmp_path)
    wait_until(lambda: module.relay()[-1:] == [False], "the relay is off")
    assert (done.returncode, answers.exists(), never.exists()) == (1, False, True)
    assert "left_to_its_daemon service=dead_door" in done.stderr


def test_a_process_that_cannot_be_ended_keeps_no_other_service_waiting(
    tmp_path: Path, module: Module
) -> None:
    late = tmp_path / "late.yaml"
    late.write_text(module.yaml.replace(str(port(module.file)), "1") + "\n# its pins: type: gpio\n")
    answers, never = died(tmp_path, module.file), died(tmp_path, late)
    refused = "\ndef kill(*_): raise PermissionError\nos.kill = kill"
    done = booted(tmp_path, own_s=0.0, before=refused)
    assert (done.returncode, answers.exists(), never.exists()) == (1, False, True)
    assert "not_killed service=late" in done.stderr


@pytest.mark.long(25)
def test_a_record_of_a_later_version_that_is_not_understood_is_named_and_off_is_what_the_file_says(
    tmp_path: Path, module: Module
) -> None:
    path = died(tmp_path, module.file, later=b"\nlater: 1\n")
    done = booted(tmp_path)
    wait_until(lambda: module.relay()[-1:] == [False], "the relay is off")
    assert (done.returncode, path.exists()) == (1, True)
    assert f"{module.file}:" in done.stderr
    assert "unknown key 'later'" in done.stderr


def test_without_a_file_and_without_all_records_the_command_says_what_it_wants(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(["outputs-off"])
    assert "name a device YAML, or --all-records" in capsys.readouterr().err

"""`outputs-off --all-records`: after a power cut, each service's relay goes off before a daemon starts."""

import socket
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from bridges.cli import main
from bridges.serve import record
from bridges.settings.load import load
from drivers.profiles import texts
from tests.serve.site import Module, environment
from tests.waiting import wait_until

COIL_ON = bytes.fromhex("0001 0000 0006 01 05 0000 ff00")
"""Modbus TCP: transaction 1, unit 1, write single coil 0."""


def died(state: Path, file: Path) -> Path:
    """What the daemon of this file left when the power was cut."""
    left = record.of(load(file))
    texts.give({})
    path = state / "rmf-bridge" / file.stem / left.name
    path.parent.mkdir(mode=0o700, parents=True)
    path.write_bytes(msgspec.json.encode(left))
    return path


def test_a_relay_goes_off_though_another_services_module_never_answers(
    tmp_path: Path, domain: int
) -> None:
    module = Module(tmp_path, domain)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        dead = tmp_path / "dead_door.yaml"
        port = load(module.file).buses["module"].tcp.port  # type: ignore[attr-defined]
        dead.write_text(module.yaml.replace(f"{port}", f"{silent.getsockname()[1]}"))
        with socket.create_connection(("127.0.0.1", port)) as wire:
            wire.sendall(COIL_ON)
            wait_until(lambda: module.relay() == [True], "the relay is on")
        state = tmp_path / "state"
        answers, never = died(state, module.file), died(state, dead)
        code = (
            "import pathlib, sys; from bridges.commands.all_records import switch_off_all;"
            f"sys.exit(switch_off_all(pathlib.Path({str(state / 'rmf-bridge')!r})))"
        )
        env = environment(XDG_STATE_HOME=str(state), XDG_RUNTIME_DIR=str(tmp_path / "run"))
        done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
    wait_until(lambda: module.relay() == [True, False], "the relay is off")
    module.close()
    assert (done.returncode, answers.exists(), never.exists()) == (1, False, True)
    assert f"left_to_its_daemon file={dead}" in done.stderr


def test_without_a_file_and_without_all_records_the_command_says_what_it_wants(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(["outputs-off"])
    assert "name a device YAML, or --all-records" in capsys.readouterr().err

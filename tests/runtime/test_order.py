"""A person's order to a daemon whose runtime directory is full, or is not where the command looks
first."""

import errno
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.cli import main
from bridges.runtime import order
from bridges.runtime.runtime_directory import RuntimeDirectory
from bridges.runtime.signals import RESET
from bridges.system.directories import by_hand


@contextmanager
def obedient(file: Path, **devices: Any) -> Iterator[RuntimeDirectory]:
    """Serve this file by hand in this process, and obey each order at its signal. `devices`: the status
    of each device."""
    runtime = RuntimeDirectory(by_hand(file), file, serves=True)

    def show(*given: order.PersonsOrder) -> None:
        process: dict[str, Any] = msgspec.to_builtins(runtime.process)
        answers = [order.OrderAnswered(one.id, {}) for one in given]
        status = process | {"order": answers[-1] if answers else None, "devices": devices}
        runtime.write_status(msgspec.json.encode(status))

    before = signal.signal(RESET, lambda *_: show(*order.take(runtime.path, file)))
    try:
        show()
        yield runtime
    finally:
        signal.signal(RESET, before)
        runtime.close()


@pytest.fixture
def yaml(machine: Path) -> Path:
    file = machine / "door.yaml"
    file.touch()
    (machine / "user/7").mkdir(parents=True)
    (machine / "tmp").mkdir()
    return file


@pytest.mark.parametrize("earlier", [False, True])
def test_a_daemon_started_by_cron_obeys_an_order_from_a_login_shell(
    yaml: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], earlier: bool
) -> None:
    login = os.environ["XDG_RUNTIME_DIR"]
    if earlier:  # a daemon that has ended left this directory
        with obedient(yaml):
            pass
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    with obedient(yaml) as daemon:
        monkeypatch.setenv("XDG_RUNTIME_DIR", login)
        assert by_hand(yaml).runtime != daemon.path
        assert main(["reset", str(yaml)]) == 0
    assert capsys.readouterr() == ("reset; no fault remains\n", "")


def test_a_reset_of_one_device_tells_only_what_remains_there_and_names_the_devices(
    yaml: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    jammed = {"faults": [{"code": "DOOR_OBSTRUCTED", "detail": "not clear"}]}
    with obedient(yaml, ward={"faults": []}, lab=jammed):
        assert main(["reset", str(yaml)]) == 0
        assert main(["reset", str(yaml), "--device", "ward"]) == 0
        assert main(["reset", str(yaml), "--device", "lap"]) == 1
    assert capsys.readouterr() == (
        "remains: lab: DOOR_OBSTRUCTED: not clear\nreset; no fault remains\n",
        f"{yaml} has no device 'lap'; it has ward, lab\n",
    )


def test_an_order_to_a_daemon_in_an_unknown_directory_is_reported_with_the_remedy(
    yaml: Path, machine: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    login = os.environ["XDG_RUNTIME_DIR"]
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(machine / "elsewhere"))
    with obedient(yaml) as daemon:
        monkeypatch.setenv("XDG_RUNTIME_DIR", login)
        assert main(["reset", str(yaml)]) == os.EX_UNAVAILABLE
        told = capsys.readouterr().err
        assert told == (
            f"the order to the daemon of {yaml} cannot be written: {by_hand(yaml).runtime}: No such"
            " file or directory; if the daemon uses another directory, give it with --runtime-dir\n"
        )
        assert main(["reset", str(yaml), "--runtime-dir", str(daemon.path)]) == 0


@pytest.mark.parametrize("words", [["reset"], ["drill", "--for", "60"]])
def test_an_order_that_finds_no_room_is_reported_and_leaves_nothing(
    yaml: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with obedient(yaml) as daemon:
        before = sorted(daemon.path.iterdir())
        monkeypatch.setattr(os, "fsync", full)
        assert main([*words, str(yaml)]) == os.EX_UNAVAILABLE
        assert sorted(daemon.path.iterdir()) == before
    told = capsys.readouterr().err
    assert f"cannot be written: {daemon.path}: No space left on device" in told

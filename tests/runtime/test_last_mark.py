"""The file (mark) that a daemon leaves at its end to say that all outputs are off. Then `outputs-off`
need not switch any output.

`outputs-off` believes the mark only if the same run of the daemon stopped cleanly.
"""

import signal
import subprocess
from pathlib import Path

import pytest

from bridges.runtime.last_mark import MARK, leave, says_off
from tests.runtime.site import Module, command, daemon, environment
from tests.waiting import PATIENCE_S

RUN = {"INVOCATION_ID": "4f5e", "SERVICE_RESULT": "success"}


@pytest.mark.parametrize(
    ("after", "off"),
    [
        ({}, True),
        ({"INVOCATION_ID": "an older run"}, False),
        ({"INVOCATION_ID": ""}, False),
        ({"SERVICE_RESULT": "watchdog"}, False),
        ({"SERVICE_RESULT": "exit-code"}, False),
        ({"SERVICE_RESULT": ""}, False),
        ({"RUNTIME_DIRECTORY": ""}, False),
        ({"RUNTIME_DIRECTORY": "/nowhere"}, False),
    ],
)
def test_only_the_mark_of_this_run_after_a_clean_stop_says_off(
    tmp_path: Path, after: dict[str, str], off: bool
) -> None:
    here = RUN | {"RUNTIME_DIRECTORY": str(tmp_path)}
    leave(here)
    assert says_off(here | after) is off


def test_a_mark_that_is_missing_or_torn_or_not_a_file_says_nothing(tmp_path: Path) -> None:
    here = RUN | {"RUNTIME_DIRECTORY": str(tmp_path)}
    mark = tmp_path / MARK
    found = [says_off(here)]
    mark.write_text("4f5")
    found.append(says_off(here))
    mark.unlink()
    mark.symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere").write_text("4f5e")
    found.append(says_off(here))
    mark.unlink()
    mark.mkdir()
    found.append(says_off(here))
    assert found == [False] * 4


def test_outside_of_a_unit_no_mark_is_left(tmp_path: Path) -> None:
    leave({"RUNTIME_DIRECTORY": str(tmp_path)})
    leave({"INVOCATION_ID": "a desktop's"})
    assert list(tmp_path.iterdir()) == []


def test_after_a_clean_stop_outputs_off_asks_the_module_nothing_and_after_a_kill_it_does(
    module: Module, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    run.mkdir(mode=0o750)
    unit = {"RUNTIME_DIRECTORY": str(run), "INVOCATION_ID": "4f5e", "RMF_BRIDGE_SERVICE": "1"}
    told = []
    for number in (signal.SIGTERM, signal.SIGKILL):
        unit["INVOCATION_ID"] += "0"
        with daemon(module.file, run, **unit) as running:
            running.wait_for("ready")
            running.process.send_signal(number)
            running.process.wait(PATIENCE_S)
        result = "success" if number is signal.SIGTERM else "signal"
        done = subprocess.run(
            command("outputs-off", module.file),
            env=environment(**unit, SERVICE_RESULT=result),
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        told.append(("nothing_to_switch_off" in done.stderr, "outputs_off device" in done.stderr))
    assert told == [(True, False), (False, True)]

"""The charging demo with real processes on real DDS. It prints RIGHT if the chargers charged as
planned."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from bridges.messages import definitions as d
from hal_fakes.demo.charging import CHARGED, problems
from hal_fakes.demo.journal import Journal
from hal_fakes.wire import wire
from tests.hal_fakes.demo.test_demo import PATIENTLY, directory
from tests.processes import RUN, running

__all__ = ["directory"]


def demo(directory: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "hal_fakes.demo", "charging", *PATIENTLY],
        env={
            "TMPDIR": str(directory),
            "PATH": "/usr/bin:/bin",
            "TRANSPORT": wire(),
            RUN: os.environ[RUN],
        },
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


@pytest.mark.long(90)
def test_the_scenarios_go_as_on_their_slides_with_three_daemons_on_one_graph(
    directory: Path,
) -> None:
    process = demo(directory)
    try:
        out, _ = process.communicate()
    finally:
        process.kill()
    assert process.returncode == 0, out
    assert "\nRIGHT: each scenario went as planned; never two robots at one charger.\n" in out
    assert "A robot cannot be charged: tiny/AMR02 failed at charger_a and at charger_b" in out
    assert "porter/P01 stands at charger_b, and tiny/AMR02 waits for that station" in out
    summary = out.partition("RIGHT:")[2].splitlines()[2:]
    assert [line.split()[0] for line in summary] == ["1", "2", "3", "4", "5a", "5b"]
    assert (running(directory), list(directory.iterdir())) == ([], [])


def test_ctrl_c_in_the_middle_leaves_nothing_behind(directory: Path) -> None:
    process = demo(directory)
    assert process.stdout is not None
    for line in process.stdout:
        if "wait at wait_1" in line:
            break
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate()
    assert process.returncode == 130, out
    assert out.endswith("interrupted; every daemon has been stopped\n")
    assert (running(directory), list(directory.iterdir())) == ([], [])


def journal(*told: tuple[str, str, str]) -> Journal:
    """Return a journal with a CHARGING state for each of these charges, one charge after the other.

    Each charge is (charger, robot, request id). Between two charges the charger is IDLE.
    """
    made = Journal(0.0, lambda text: None, colour=False)
    for charger, robot, request_id in told:
        value = int(d.ChargerStateValue.CHARGER_CHARGING)
        state = d.ChargerState(d.Time(), value, charger, "", request_id, "tiny", robot)
        made.state(state, 0.0)
        made.state(d.ChargerState(charger_name=charger, state=1), 0.0)
    return made


OURS = "charger_coordinator/1"
RIGHT = [(charger, who, OURS) for charger, robots in CHARGED.items() for who in robots]


def test_only_a_day_that_lacks_a_charge_has_a_problem() -> None:
    assert problems(journal(*RIGHT)) == []
    assert problems(journal(*RIGHT[:-1])) == [
        "charger_b charged P01 AMR02, expected P01 AMR02 AMR01"
    ]


def test_a_charge_without_a_request_is_a_problem() -> None:
    told = [*RIGHT[:-1], ("charger_b", "AMR01", "unrequested/charger_b")]
    assert problems(journal(*told)) == ["charger_b charged for unrequested/charger_b"]


def test_a_robot_at_two_chargers_is_a_problem() -> None:
    day = journal(*RIGHT)
    value = int(d.ChargerStateValue.CHARGER_CHARGING)
    for charger in ("charger_a", "charger_b"):
        day.state(d.ChargerState(d.Time(), value, charger, "", OURS, "tiny", "AMR01"), 0.0)
    assert "AMR01 was charged at two chargers at once" in problems(day)

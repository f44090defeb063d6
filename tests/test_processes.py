"""Processes of a test run. All of them end when the run finishes or is killed."""

import os
import subprocess
import sys
from pathlib import Path

from tests.processes import RUN, running
from tests.waiting import wait_until

RUNS = """
import subprocess, sys, threading
from tests.processes import end_with_us

def start():
    words = ["sh", "-c", 'sh -c "sleep 600; :" "$0" & wait', sys.argv[1]]
    subprocess.Popen(words, start_new_session=True)

end_with_us()
starts = threading.Thread(target=start)
starts.start()
starts.join()
sys.stdin.read()
"""
"""A program with a second thread. This thread starts a child process in a new session, and then the
thread ends. The child starts another child."""


def test_what_a_killed_run_has_started_is_killed(tmp_path: Path) -> None:
    of_its_own = {name: value for name, value in os.environ.items() if name != RUN}
    words = [sys.executable, "-c", RUNS, str(tmp_path)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, env=of_its_own) as run:
        wait_until(lambda: len(running(tmp_path)) == 3, "all three processes run")
        run.kill()
    wait_until(lambda: not running(tmp_path), "no process runs")

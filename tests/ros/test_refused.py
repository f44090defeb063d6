"""A daemon on `ros2` refuses to start. A stand-in replaces rclpy. The exit code is 69, and the
executor's thread has ended.

With the real ROS, 2 of 4 such starts ended in SIGABRT. The stand-in cannot abort.
"""

import os
import subprocess
import sys
from pathlib import Path

from tests.ros import stand_in

LIFT = Path(__file__).parents[2] / "config" / "lift_dry_contact.yaml"


def test_a_start_without_a_message_ends_with_69_and_joins_the_executors_thread(
    tmp_path: Path,
) -> None:
    packages, runtime = tmp_path / "ros", tmp_path / "run"
    packages.mkdir()
    stand_in.write(packages)
    file = tmp_path / "lift.yaml"
    text = LIFT.read_text()
    lines = [line for line in text.splitlines() if "ros_setup:" not in line]
    file.write_text("\n".join(lines).replace("transport: auto", "transport: ros2"))
    command = [sys.executable, "-m", "bridges.cli", "run", str(file), "--simulate"]
    done = subprocess.run(
        [*command, "--runtime-dir", str(runtime)],
        env={**os.environ, "PYTHONPATH": f"{packages}:{os.environ.get('PYTHONPATH', '')}"},
        cwd=LIFT.parents[1],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert "has no LiftState" in done.stderr
    assert done.stderr.splitlines()[-1] == "joined"
    assert done.returncode == os.EX_UNAVAILABLE

"""The key `ros_setup:` in the YAML file.

The daemon sources ROS's setup file. Then it runs as if a prepared shell had started it.
"""

import logging
import os
import signal
from pathlib import Path

import pytest

from bridges.kinds.shared.rmf_section import Rmf
from bridges.transports.ros2.setup import SOURCED, sourced, sourcing
from bridges.transports.transport import TransportError
from tests.runtime.site import daemon
from tests.waiting import PATIENCE_S

ROOT = Path(__file__).parents[2]
ARGV = ["python", "rmf-bridge", "run", "my lift.yaml"]


def test_the_file_is_sourced_once_and_the_command_goes_on_as_it_was(tmp_path: Path) -> None:
    setup = tmp_path / "setup.bash"
    setup.touch()
    rmf = Rmf(ros_setup=str(setup))
    command = sourcing(rmf, {}, ARGV)
    assert (command[:2], command[-5:]) == (["bash", "-c"], [str(setup), *ARGV])
    assert sourced(rmf, {"PATH": "/bin"}) == {"PATH": "/bin", SOURCED: str(setup)}
    assert sourcing(rmf, sourced(rmf, {}), ARGV) == []
    assert sourcing(rmf, {SOURCED: "/opt/ros/another/setup.bash"}, ARGV) == command


def test_dds_needs_no_setup_file_and_none_is_sourced_where_none_is_named(tmp_path: Path) -> None:
    setup = tmp_path / "setup.bash"
    setup.touch()
    assert sourcing(Rmf(transport="dds", ros_setup=str(setup)), {}, ARGV) == []
    assert sourcing(Rmf(transport="ros2"), {}, ARGV) == []


def test_a_file_that_is_not_there_ends_ros2_and_is_logged_by_auto(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    nowhere = "/opt/ros/none/setup.bash"
    with pytest.raises(TransportError, match=f"ros_setup: {nowhere} does not exist"):
        sourcing(Rmf(transport="ros2", ros_setup=nowhere), {}, ARGV)
    assert sourcing(Rmf(ros_setup=nowhere), {}, ARGV) == []
    assert caplog.messages == [f'no_ros_setup file={nowhere} reason="it does not exist"']


def test_the_daemon_that_has_sourced_it_is_the_process_that_was_started(
    domain: int, tmp_path: Path
) -> None:
    setup = tmp_path / "a setup.bash"
    setup.write_text('echo "sourced $# $FROM_SETUP" >&2\nexport FROM_SETUP=yes\nfalse\n')
    file = tmp_path / "lift.yaml"
    shipped = (ROOT / "config/lift_dry_contact.yaml").read_text()
    lines = f"rmf:\n  transport: auto\n  ros_setup: {setup}\n  domain_id: {domain}\n"
    begin, end = shipped.index("rmf:"), shipped.index("buses:")
    file.write_text(f"{shipped[:begin]}{lines}\n{shipped[end:]}")
    with daemon(file, tmp_path / "run", "--simulate") as running:
        running.wait_for("ready file=")
        environ = Path(f"/proc/{running.process.pid}/environ").read_bytes().split(b"\0")
        assert running.log.read_text().count("sourced 0 \n") == 1
        assert b"FROM_SETUP=yes" in environ
        assert os.fsencode(f"{SOURCED}={setup}") in environ
        assert running.end(signal.SIGTERM) == 0


def test_ros2_without_its_setup_file_does_not_start(tmp_path: Path) -> None:
    file = tmp_path / "lift.yaml"
    shipped = (ROOT / "config/lift_dry_contact.yaml").read_text()
    begin, end = shipped.index("rmf:"), shipped.index("buses:")
    wanted = "rmf: {transport: ros2, ros_setup: /opt/ros/none/setup.bash}\n\n"
    file.write_text(shipped[:begin] + wanted + shipped[end:])
    with daemon(file, tmp_path / "run", "--simulate") as running:
        assert running.process.wait(PATIENCE_S) == os.EX_UNAVAILABLE
    assert "ros_setup: /opt/ros/none/setup.bash does not exist" in running.log.read_text()

import io
import sys

import pytest

from bridges.cli import COMMANDS, main, split_ros_args


@pytest.mark.parametrize(
    ("argv", "ours", "ros"),
    [
        ("run lift.yaml --simulate", "run lift.yaml --simulate", ""),
        ("run lift.yaml --ros-args", "run lift.yaml", "--ros-args"),
        (
            "run lift.yaml --ros-args -r __node:=a -p use_sim_time:=true",
            "run lift.yaml",
            "--ros-args -r __node:=a -p use_sim_time:=true",
        ),
        (
            "--ros-args -r a:=b -- run lift.yaml --ros-args -r c:=d",
            "run lift.yaml",
            "--ros-args -r a:=b -- --ros-args -r c:=d",
        ),
        ("run -- lift.yaml", "run -- lift.yaml", ""),
    ],
)
def test_arguments_after_ros_args_are_left_to_ros(argv: str, ours: str, ros: str) -> None:
    assert split_ros_args(argv.split()) == (ours.split(), ros.split())


@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_takes_a_name_that_is_not_utf_8(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, "caf\udce9.yaml"]) == 2
    assert capsys.readouterr().err == "rmf-bridge: b'caf\\xe9.yaml' is not UTF-8: rename it\n"


def test_a_terminal_without_our_characters_is_no_defect(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(shown, encoding="ascii"))
    assert main(["completion", "bash"]) == 0
    sys.stdout.write("é\n")
    sys.stdout.flush()
    assert shown.getvalue().endswith(b"\\xe9\n")

import pytest

from bridges.cli import split_ros_args


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

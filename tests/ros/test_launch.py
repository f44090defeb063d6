"""Tests of the launch files. A stand-in replaces ROS's package `launch`. As on a machine with only
ROS's packages, Python cannot import the libraries that our daemons need."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LAUNCHED = """
import sys, types
lacking = {"msgspec", "pymodbus", "gpiozero", "lgpio", "serial", "requests", "can", "canopen",
           "cantools", "cyclonedds", "zenoh"}
class Lacking:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in lacking:
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Lacking())

def module(name, **holds):
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(holds)
class Wanted:
    def __init__(self, *what, **options): self.what, self.options = what, options
arguments = {"config": sys.argv[2], "simulate": "true"}
class Configured:
    def __init__(self, name): self.name = name
    def perform(self, context): return arguments[self.name]
module("launch", LaunchContext=object, LaunchDescription=Wanted)
module("launch.actions", DeclareLaunchArgument=Wanted, OpaqueFunction=Wanted)
module("launch.substitutions", LaunchConfiguration=Configured)
module("launch_ros")
module("launch_ros.actions", Node=Wanted)

import runpy
described = runpy.run_path(sys.argv[1])["generate_launch_description"]()
try:
    (node,) = described.what[0][-1].options["function"](None)
except RuntimeError as error:
    print(error)
else:
    print(node.options["executable"], *node.options["arguments"])
"""
LIFT = ROOT / "config" / "lift_dry_contact.yaml"


def launched(kind: str, file: Path) -> str:
    """Return the command that a launch file starts.

    The launch command is `ros2 launch rmf_bridges KIND.launch.py config:=FILE simulate:=true`.
    """
    launch_file = str(ROOT / "ros" / "launch" / f"{kind}.launch.py")
    command = [sys.executable, "-c", LAUNCHED, launch_file, str(file)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_launch_file_starts_the_daemon_with_nothing_but_ross_own_modules() -> None:
    assert launched("lift", LIFT) == f"rmf-bridge run {LIFT} --simulate"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("kind: door", "{} is for a door: use ros2 launch rmf_bridges door.launch.py"),
        ("doors: {}", "{} does not say for which kind it is"),
        ("kind: [", "{}: while parsing"),
    ],
)
def test_a_file_that_is_not_for_this_kind_starts_nothing(
    tmp_path: Path, text: str, told: str
) -> None:
    file = tmp_path / "some.yaml"
    file.write_text(text)
    assert launched("lift", file).startswith(told.format(file))


def test_a_file_that_is_not_there_starts_nothing(tmp_path: Path) -> None:
    file = tmp_path / "none.yaml"
    assert "No such file" in launched("lift", file)

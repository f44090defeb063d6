"""The files for colcon and `ros2 launch`. The files agree with the project, and setup.py includes all
of them."""

import ast
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from configparser import ConfigParser
from pathlib import Path

from bridges import __version__
from bridges.kinds import kind_names
from bridges.messages.definitions import PACKAGES

ROOT = Path(__file__).parents[2]
ROS = ROOT / "ros"
PACKAGE = ElementTree.parse(ROS / "package.xml").getroot()
NAME = "rmf_bridges"


def test_the_package_has_the_projects_version() -> None:
    assert (PACKAGE.findtext("name"), PACKAGE.findtext("version")) == (NAME, __version__)


def test_every_ros_package_whose_messages_we_speak_is_a_dependency() -> None:
    named_there = {depend.text for depend in PACKAGE.findall("exec_depend")}
    assert {*PACKAGES.values(), "rclpy", "launch_ros"} - {"builtin_interfaces"} <= named_there


def test_ros_finds_the_package_and_its_executable() -> None:
    assert PACKAGE.findtext("export/build_type") == "ament_python"
    assert (ROS / "resource" / NAME).read_bytes() == b""
    places = ConfigParser(interpolation=None)
    places.read(ROS / "setup.cfg")
    assert places["install"]["install_scripts"] == f"$base/lib/{NAME}"


def test_the_package_has_every_file_of_both_houses_and_of_the_fakes(tmp_path: Path) -> None:
    build = ["build", "--build-base", str(tmp_path), "--build-lib", str(tmp_path / "lib")]
    command = [sys.executable, "setup.py", "-q", "egg_info", "-e", str(tmp_path), *build]
    subprocess.run(command, cwd=ROS, check=True, capture_output=True)
    built = {str(path.relative_to(tmp_path / "lib")) for path in (tmp_path / "lib").rglob("*.*")}
    houses = ("bridges", "drivers", "hal_fakes", "workbench")
    ours = {str(p.relative_to(ROOT)) for house in houses for p in (ROOT / house).rglob("*.*")}
    assert built == {name for name in ours if "__pycache__" not in name}


def test_every_kind_has_a_launch_file_that_starts_that_kind() -> None:
    started = {}
    for file in (ROS / "launch").iterdir():
        calls = [
            node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Call)
        ]
        started[file.name] = [ast.unparse(call) for call in calls]
    assert started == {f"{kind}.launch.py": [f"daemon('{kind}')"] for kind in kind_names()}

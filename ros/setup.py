"""The ROS package for colcon: the Python packages of the folder above, launch files and examples.

Only colcon reads this file. pip reads pyproject.toml above, which lists packages and data for both.
"""

import os
import re
import tomllib
from pathlib import Path

from setuptools import find_packages, setup

HERE = Path(__file__).resolve().parent
ABOVE = Path(os.path.relpath(HERE.parent))
ALL = tomllib.loads((ABOVE / "pyproject.toml").read_text())["tool"]["setuptools"]
VERSION = re.search(r'__version__ = "(.*)"', (ABOVE / "bridges/__init__.py").read_text())


def files(pattern: str) -> list[str]:
    """Return paths below the project's folder, relative as setuptools requires."""
    return sorted(map(str, ABOVE.glob(pattern)))


setup(
    name="rmf_bridges",
    version=VERSION[1],
    description="Daemons that connect Open-RMF to the lifts, doors and chargers of a building",
    license="Apache-2.0",
    packages=find_packages(str(ABOVE), **ALL["packages"]["find"]),
    package_dir={"": str(ABOVE)},
    package_data=ALL["package-data"],
    data_files=[
        ("share/ament_index/resource_index/packages", files("ros/resource/rmf_bridges")),
        ("share/rmf_bridges", files("ros/package.xml")),
        ("share/rmf_bridges/launch", files("ros/launch/*.launch.py")),
        ("share/rmf_bridges/config", files("config/*.yaml")),
    ],
    entry_points={"console_scripts": ["rmf-bridge = bridges.cli:main"]},
    zip_safe=False,
)

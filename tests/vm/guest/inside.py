"""The demo and the transport tests. They use the libraries of the installed package."""

from typing import Final

from tests.vm.guest.system import PYTHON, Wrong, mounted, sh

PATIENCE: Final = "6"
"""The factor for the demo's waits. It is higher than on a laptop, because three daemons share a slow
core."""


def demo() -> str:
    """Run the demo on zenoh. In it a robot passes the door, rides the lift and charges."""
    suite = mounted("suite", "/media")  # this folder holds the files of config/
    env = ("env", f"PYTHONPATH={suite}", "TRANSPORT=zenoh", "HOME=/root", "TERM=dumb")
    told = sh(*env, PYTHON, "-m", "hal_fakes.demo", "--patience", PATIENCE)
    return told.strip().splitlines()[-1].strip()


def transport() -> str:
    """Check that the tests of zenoh pass. On this machine zenoh is the only transport that works
    without ROS."""
    suite = mounted("suite", "/media")
    tests = sorted(str(path) for path in (suite / "tests/transports").glob("test_zenoh_*.py"))
    path = f"PYTHONPATH={suite}:{suite / 'site'}"
    told = sh("env", "-C", str(suite), path, "HOME=/root", PYTHON, "-m", "pytest", *tests)
    last = told.strip().splitlines()[-1]
    if " passed" not in last:
        raise Wrong(f"no test has passed: {last}")
    return last

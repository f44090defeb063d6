"""The demo and the transport tests, with the libraries from the installed package."""

from typing import Final

from tests.vm.guest.system import PYTHON, Wrong, mounted, sh

PATIENCE: Final = "6"
"""Factor for the demo's waits compared with a laptop, because three daemons share one slow core."""


def demo() -> str:
    """In the demo on zenoh a robot passes the door, rides the lift and charges."""
    suite = mounted("suite", "/media")  # this folder has the files of config/
    env = ("env", f"PYTHONPATH={suite}", "TRANSPORT=zenoh", "HOME=/root", "TERM=dumb")
    told = sh(*env, PYTHON, "-m", "hal_fakes.demo", "--patience", PATIENCE)
    return told.strip().splitlines()[-1].strip()


def transport() -> str:
    """The tests of zenoh pass. Zenoh is the transport that works here without ROS."""
    suite = mounted("suite", "/media")
    tests = sorted(str(path) for path in (suite / "tests/transports").glob("test_zenoh_*.py"))
    path = f"PYTHONPATH={suite}:{suite / 'site'}"
    told = sh("env", "-C", str(suite), path, "HOME=/root", PYTHON, "-m", "pytest", *tests)
    last = told.strip().splitlines()[-1]
    if " passed" not in last:
        raise Wrong(f"no test has passed: {last}")
    return last

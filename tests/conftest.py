import atexit
import gc
import logging
import os
import signal
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, settings

from bridges.transports.choose import missing_of_dds, missing_of_ros
from hal_fakes.domain import domain_for_a_while
from tests.depth import DEEP
from tests.processes import end_with_us

ON_WIRES = ("commands", "drivers", "hal_fakes", "transports", "runtime", "site", "workbench")
"""Folders whose tests use threads, processes and sockets. Other tests run in virtual time."""
WIRES_HANG_AFTER_S = 900
"""The time limit of a test on wires (s). Even on a busy machine no passing test takes this long."""

if not DEEP and missing_of_ros():
    os.environ.setdefault("TRANSPORT", "zenoh")
"""Tests of other subjects than the transports use the zenoh transport between processes, as on a
Raspberry Pi. On zenoh a daemon starts with half the CPU time that it needs on dds. Where dds is
installed, `make deep` and runs beside ROS use dds."""

settings.register_profile(
    "here",
    derandomize=True,
    database=None,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("here")
"""Every run draws the same examples. No time limit applies to the drawing or to the test of an
example."""

signal.signal(
    signal.SIGHUP, signal.SIG_DFL
)  # otherwise daemons inherit the setting of nohup or of a CI's shell

gc.disable()
atexit.register(gc.freeze)
"""The garbage collector is off while pytest collects the tests, because collecting tests makes no
garbage. When a worker ends, the collector ignores all objects, which saves time."""

end_with_us()

_deselected: list[str] = []


@pytest.fixture(autouse=True)
def _log_as_before() -> Iterator[None]:
    """Undo the log setup of a command before the next test in this process."""
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    yield
    for handler in set(root.handlers).difference(handlers):
        root.removeHandler(handler)
    root.setLevel(level)


@pytest.fixture
def domain() -> Iterator[int]:
    """Yield a DDS domain that no other test on this machine uses."""
    with domain_for_a_while() as free:
        yield free


@pytest.fixture(scope="module")
def module_domain() -> Iterator[int]:
    """Yield a DDS domain for all tests of a file."""
    with domain_for_a_while() as free:
        yield free


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Order the tests, and limit the time of tests on wires.

    Without cyclonedds, as on arm64, leave out the tests of the dds transport.
    """
    if missing_of_dds():
        items[:] = [item for item in items if not item.get_closest_marker("dds")]
    items[:] = _mixed(items)
    for item in filter(_is_on_wires, items):
        item.add_marker(pytest.mark.timeout(WIRES_HANG_AFTER_S))


def pytest_collection_finish() -> None:
    """Freeze the collected objects. They live until the run ends, so the garbage collector need not
    scan them."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)  # without xdist this hook does not exist
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """With `--dist loadscope`, run a test with all its parameters on one worker.

    So each module's fixture (an echo process, a schema) starts only once. Any other test goes to the
    next free worker.
    """
    from xdist.scheduler import LoadScopeScheduling  # type: ignore[import-untyped]

    class ByTest(LoadScopeScheduling):  # type: ignore[misc]  # which xdist does not type
        def _split_scope(self, nodeid: str) -> str:
            return nodeid.partition("[")[0]

    return ByTest(config, log) if config.getvalue("dist") == "loadscope" else None


def _mixed(items: list[pytest.Item]) -> list[pytest.Item]:
    """Mix waiting tests with computing tests, to keep all cores busy.

    A file's tests stay together, and every run has the same mix. The long tests are in the first
    quarter, and the longest test is the first.
    """
    random = Random(1)
    place = {path: random.random() for path in sorted({item.path for item in items})}
    early = sorted(filter(_seconds, items), key=_seconds, reverse=True)
    place_of_early = {item: n / len(early) / 4 for n, item in enumerate(early)}
    return sorted(items, key=lambda item: place_of_early.get(item, place[item.path]))


def _seconds(item: pytest.Item) -> float:
    """Return the seconds from the mark `long`, or 0 without this mark. The test takes this time when it
    runs alone."""
    mark = item.get_closest_marker("long")
    return float(mark.args[0]) if mark else 0.0


def _is_on_wires(item: pytest.Item) -> bool:
    return item.path.relative_to(Path(__file__).parent).parts[0] in ON_WIRES


def pytest_deselected(items: Sequence[pytest.Item]) -> None:
    """Remember the tests that pytest leaves out because ROS is missing."""
    _deselected.extend(item.nodeid for item in items if item.get_closest_marker("ros"))


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Report the tests that did not run. A green run without ROS has not tested the ros2 transport."""
    if missing := missing_of_dds():
        terminalreporter.write_line(f"not run: the tests of the dds transport, as {missing}")
    if _deselected and config.getoption("markexpr") == "not ros and not browser":
        files = sorted({nodeid.partition("::")[0] for nodeid in _deselected})
        terminalreporter.write_line(
            f"not run: {len(_deselected)} tests that need ROS 2 (make test-ros), in {', '.join(files)}"
        )

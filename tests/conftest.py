from collections.abc import Sequence

import pytest

from bridges.rmf.choose import missing_of_dds

_deselected: list[str] = []


def pytest_deselected(items: Sequence[pytest.Item]) -> None:
    """Remember what was not run for want of ROS."""
    _deselected.extend(item.nodeid for item in items if item.get_closest_marker("ros"))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without cyclonedds, as on arm64, the tests of the dds transport cannot be run."""
    if missing_of_dds():
        items[:] = [item for item in items if not item.get_closest_marker("dds")]


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Say so: a green run without ROS has not seen the ros2 transport."""
    if missing := missing_of_dds():
        terminalreporter.write_line(f"not run: the tests of the dds transport, as {missing}")
    if _deselected and config.getoption("markexpr") == "not ros":
        files = sorted({nodeid.partition("::")[0] for nodeid in _deselected})
        terminalreporter.write_line(
            f"not run: {len(_deselected)} tests that need ROS 2 (make test-ros), in {', '.join(files)}"
        )

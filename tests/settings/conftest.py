"""Fixtures that add the kinds, drivers and buses of `site/`, and that give each test a file."""

from collections.abc import Iterator
from pathlib import Path

import pytest

import bridges.kinds
import drivers
import drivers.hal

SITE = Path(__file__).parent / "site"


@pytest.fixture(scope="package", autouse=True)
def site() -> Iterator[None]:
    """Add the folders of `site/` to the packages in which the loader looks for names."""
    with pytest.MonkeyPatch.context() as patch:
        for package, folder in (
            (bridges.kinds, "kinds"),
            (drivers, "drivers"),
            (drivers.hal, "hal"),
        ):
            patch.setattr(package, "__path__", [*package.__path__, str(SITE / folder)])
        yield


@pytest.fixture(scope="package")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of a file that tests write and load again and again."""
    return tmp_path_factory.mktemp("settings") / "gate.yaml"

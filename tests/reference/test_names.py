"""Check that few classes have the same name. At most 5 % of the product's classes may share their names
with other classes."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
ROOMS: Final = ("bridges", "drivers", "workbench", "hal_fakes")
MOST: Final = 0.05


def classes() -> Iterator[str]:
    """Yield the name of each class at the top level of a module."""
    for room in ROOMS:
        for file in sorted((ROOT / room).rglob("*.py")):
            for node in ast.parse(file.read_text()).body:
                if isinstance(node, ast.ClassDef):
                    yield node.name


def test_a_class_name_means_one_thing() -> None:
    counts = Counter(classes())
    shared = {name: count for name, count in counts.items() if count > 1}
    assert sum(shared.values()) <= MOST * counts.total(), shared

"""The configuration reference (docs/reference/configuration.md). Each key has a valid example, and each
heading is unique."""

from collections import Counter
from pathlib import Path

import msgspec
import pytest
import yaml
from msgspec import inspect as mi

from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names as named
from bridges.yaml.parsing import YamlFile
from bridges.yaml.positions import Spot
from bridges.yaml.values import Values
from workbench.commissioning import json_schema, reference
from workbench.commissioning.examples import example


def structs() -> list[type]:
    """Return every struct in the configuration reference. The list includes the structs inside other
    structs."""
    tops: list[type] = [Rmf, *(named.bus_called(name).settings for name in named.bus_types())]
    tops += [shape.type.settings for shape in json_schema.shapes()]
    tops += [kind.settings for kind in json_schema.graph_kinds()]
    found = list(tops)
    for struct in found:
        for field in fields(struct):
            found += [inner for inner in reference.parts(field.type) if inner not in found]
    return found


def fields(struct: type) -> tuple[mi.Field, ...]:
    info = mi.type_info(struct)
    assert isinstance(info, mi.StructType)
    return info.fields


def judged(struct: type, field: mi.Field) -> list[str]:
    """Return the problems that the loader finds in the example for this key."""
    page = YamlFile("example")
    root = yaml.compose(f"wanted: {{{example(struct, field)}}}")
    assert root is not None
    key, value = root.value[0][1].value[0]
    assert key.value == field.encode_name
    Values(page).make(field.type, Spot(value, key, f"'{key.value}'"))
    return [problem.text for problem in page.problems]


@pytest.mark.parametrize(
    "struct", structs(), ids=lambda struct: f"{struct.__module__}.{struct.__name__}"
)
def test_every_key_has_an_example_that_is_right(struct: type) -> None:
    shown = [field for field in fields(struct) if example(struct, field)]
    assert {field.name: judged(struct, field) for field in shown} == {f.name: [] for f in shown}
    assert all(reference.parts(f.type) for f in fields(struct) if not example(struct, f))


def test_an_example_is_of_a_shipped_file_where_there_is_one() -> None:
    (serial,) = (s for s in structs() if s.__name__ == "Serial")
    examples = {f.name: example(serial, f) for f in fields(serial)}
    assert examples["baudrate"] == "baudrate: 9600"
    assert examples["port"].startswith("port: /dev/serial/by-id/")
    assert msgspec.structs.fields(serial)


def test_no_heading_appears_twice() -> None:
    page = Path(__file__).parents[3] / "docs" / "reference" / "configuration.md"
    headings = Counter(line for line in page.read_text().splitlines() if line.startswith("#"))
    assert [heading for heading, many in headings.items() if many > 1] == []
    assert len(headings) > 40

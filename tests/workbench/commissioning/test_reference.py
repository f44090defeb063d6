import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator

from bridges.settings import names as named
from workbench.commands.schema import markdown
from workbench.commissioning import json_schema
from workbench.commissioning.examples import device_yamls

ROOT = Path(__file__).parents[3]
SHIPPED = device_yamls()


@pytest.fixture(scope="module")
def schema() -> json_schema.Schema:
    return json_schema.schema()


@pytest.fixture(scope="module")
def validator(schema: json_schema.Schema) -> Draft202012Validator:
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def properties(part: object) -> Iterator[tuple[str, json_schema.Schema]]:
    """Yield the name and the schema of every property, at any depth."""
    if isinstance(part, dict):
        yield from part.get("properties", {}).items()
    for below in (
        part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    ):
        yield from properties(below)


def test_an_editor_shows_at_every_key_what_it_means(schema: json_schema.Schema) -> None:
    every = list(properties(schema))
    assert [name for name, shown in every if not shown.get("description")] == []
    assert len(every) > 500
    instead = [
        part["description"] == shown["description"]
        for _, shown in every
        for part in shown.get("anyOf", ())  # type: ignore[attr-defined]
        if "$ref" in part
    ]
    assert all(instead)
    assert len(instead) > 50


@pytest.mark.parametrize("file", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_file_is_right_by_the_schema(
    validator: Draft202012Validator, file: Path
) -> None:
    as_json = json.loads(
        json.dumps(yaml.safe_load(file.read_text()))
    )  # in JSON every key is a string
    assert [e.message for e in validator.iter_errors(as_json)] == []


@pytest.mark.parametrize("file", SHIPPED, ids=lambda path: path.stem)
def test_an_unknown_key_in_any_section_is_wrong_by_the_schema(
    validator: Draft202012Validator, file: Path
) -> None:
    for section in ("rmf", None):
        content = yaml.safe_load(file.read_text())
        (content[section] if section else content)["surprise"] = 1
        assert not validator.is_valid(content)


def test_every_link_of_the_page_leads_to_one_heading() -> None:
    page = markdown()
    titles = [line.lstrip("# ") for line in page.splitlines() if line.startswith("#")]
    anchors = Counter(re.sub(r"[^\w -]", "", t.lower()).replace(" ", "-") for t in titles)
    links = set(re.findall(r"\]\(#([^)]*)\)", page))
    assert {link: anchors[link] for link in links} == dict.fromkeys(links, 1)
    assert len(links) > 50


def test_what_several_sections_have_stands_once() -> None:
    rows = [line for line in markdown().splitlines() if line.startswith("| `point` |")]
    assert len(rows) == 2  # one row for a contact, and one row for a relay


def test_the_page_has_every_kind_driver_and_bus() -> None:
    page = markdown()
    for bus in named.bus_types():
        assert f"## Bus of `type: {bus}`" in page
    for shape in json_schema.shapes():
        heading = rf"^## .*`{shape.devices_key}`.* with `driver: {shape.driver}`$"
        assert re.search(heading, page, re.M), heading

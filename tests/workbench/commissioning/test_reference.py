import json
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator

from bridges.settings import names as named
from workbench.commissioning import reference
from workbench.commissioning.examples import device_yamls

ROOT = Path(__file__).parents[3]
SHIPPED = device_yamls()


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    schema = reference.schema()
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.mark.parametrize("file", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_file_is_right_by_the_schema(
    validator: Draft202012Validator, file: Path
) -> None:
    as_json = json.loads(json.dumps(yaml.safe_load(file.read_text())))  # whose keys are texts
    assert [e.message for e in validator.iter_errors(as_json)] == []


@pytest.mark.parametrize("file", SHIPPED, ids=lambda path: path.stem)
def test_an_unknown_key_in_any_section_is_wrong_by_the_schema(
    validator: Draft202012Validator, file: Path
) -> None:
    for section in ("rmf", None):
        content = yaml.safe_load(file.read_text())
        (content[section] if section else content)["surprise"] = 1
        assert not validator.is_valid(content)


def test_the_configuration_page_is_the_one_that_the_structs_make() -> None:
    """`rmf-bridge schema --markdown > docs/configuration.md` brings it up to date."""
    assert (ROOT / "docs" / "configuration.md").read_text() == reference.page()


def test_every_key_of_every_section_says_what_it_means() -> None:
    meaningless = [line for line in reference.page().splitlines() if line.endswith("|  |")]
    assert meaningless == []


def test_the_page_has_every_kind_driver_and_bus() -> None:
    page = reference.page()
    for bus in named.bus_types():
        assert f"## Bus of `type: {bus}`" in page
    for shape in reference.shapes():
        assert f"## `{shape.devices_key}` with `driver: {shape.driver}`" in page

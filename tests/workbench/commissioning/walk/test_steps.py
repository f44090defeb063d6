"""The outputs that a walk offers. They are the outputs that the file has, for every kind and driver."""

from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any, Final

import pytest
import yaml

from bridges.kinds import kind_called, kind_names
from bridges.kinds.shared.kind import Kind
from bridges.settings.load import Config, load
from workbench.commissioning.examples import CONFIG, device_yamls
from workbench.commissioning.walk.steps import KINDS, OFF, steps, untestable

HELD: Final = ("agv_mode_request", "door_open", "rear_door_open")
LIFTS: Final = {
    "lift_one_hot.yaml": ("outputs",),
    "lift_gateway.yaml": ("map", "commands"),
    "lift_http.yaml": ("api", "commands"),
}
"""A file for each driver of lifts -> the section of its held outputs."""


def without(name: str, taken: tuple[str, ...], tmp_path: Path) -> Config:
    """Return a shipped file's config without these held outputs."""
    text = yaml.safe_load((CONFIG / name).read_text())
    section: dict[str, Any] = text["lifts"]["Lift1"]
    for key in LIFTS[name]:
        section = section[key]
    for output in taken:
        del section[output]
    file = tmp_path / name
    file.write_text(yaml.safe_dump(text))
    return load(file)


def offered(config: Config, device: str) -> list[str]:
    return [step.name for step in steps(config, device)]


@pytest.mark.parametrize("name", LIFTS)
@pytest.mark.parametrize(
    "taken", [taken for many in (0, 1, 2) for taken in combinations(HELD[:2], many)]
)
def test_a_lift_is_offered_the_held_outputs_that_its_file_has(
    name: str, taken: tuple[str, ...], tmp_path: Path
) -> None:
    found = offered(without(name, taken, tmp_path), "Lift1")
    assert [one for one in found if one in HELD] == [o for o in HELD[:2] if o not in taken]


def lifts() -> Iterator[tuple[Config, str]]:
    for file in device_yamls():
        config = load(file)
        if config.kind == "lift":
            yield from ((config, device) for device in config.devices)


@pytest.mark.parametrize(
    ("config", "device"), [pytest.param(*at, id=f"{at[0].path.stem} {at[1]}") for at in lifts()]
)
def test_a_lift_is_offered_the_outputs_that_check_lists(config: Config, device: str) -> None:
    tables = config.driver_type(device).tables(config.devices[device])
    (rows,) = [table.rows for table in tables if table.title == "outputs"]
    listed = {row[0].partition(" ")[0] for row in rows}  # some drivers list each call
    assert {name.partition(" ")[0] for name in offered(config, device)} == listed


@pytest.mark.parametrize("file", device_yamls(), ids=lambda file: file.stem)
def test_every_shipped_device_has_its_steps_or_a_reason(file: Path) -> None:
    config = load(file)
    if untestable(config):
        assert config.kind not in KINDS
        return
    assert config.kind in OFF
    for device in config.devices:
        drives = config.kind != "alarm" and not is_station(config)
        assert bool(offered(config, device)) == drives


def is_station(config: Config) -> bool:
    """Return whether these are charging stations without contacts, which `send charger` tests."""
    return config.kind == "charger" and config.driver != "dry_contact"


def test_every_kind_with_hardware_but_a_fleet_can_be_walked() -> None:
    with_hardware = {name for name in kind_names() if isinstance(kind_called(name), Kind)}
    assert with_hardware - KINDS.keys() == {"fleet"}
    assert OFF.keys() == KINDS.keys()

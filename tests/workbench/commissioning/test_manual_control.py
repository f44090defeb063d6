"""Commands that work on one device of a file. The tests check which device a command chooses, and the
message if the file is wrong or lists several devices."""

import os
from pathlib import Path

import pytest

from bridges import cli
from bridges.settings.load import load
from workbench.graph.which_device import NoDevice, device_of

CONFIG = Path(__file__).parents[3] / "config"


def meant(file: str, name: str | None) -> str:
    try:
        return device_of(load(CONFIG / file), name)
    except NoDevice as error:
        return str(error)


def test_the_only_device_is_meant_and_of_several_the_one_that_is_named() -> None:
    assert meant("lift_dry_contact.yaml", None) == "Lift1"
    assert meant("lift_dry_contact.yaml", "Lift2") == "the file has no device 'Lift2'; it has Lift1"
    assert meant("door_line.yaml", "ward_door") == "ward_door"
    assert meant("door_line.yaml", None) == (
        "--device is needed: the file has ward_door, pharmacy_door"
    )
    assert meant("door_supervisor.yaml", None) == "a door_supervisor has no wires"


@pytest.mark.parametrize(
    ("text", "code", "why"),
    [
        ("kind: lift\n", os.EX_CONFIG, "bad.yaml:1:1: "),
        ("kind: door_supervisor\n", os.EX_USAGE, "a door_supervisor has no wires"),
    ],
)
def test_a_simulation_of_a_wrong_file_gets_no_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, code: int, why: str
) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(text)
    assert cli.main(["press", str(file), "fire", "--runtime-dir", str(tmp_path)]) == code
    assert why in capsys.readouterr().err

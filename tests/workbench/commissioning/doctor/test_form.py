"""The form that `doctor --form` writes for tests on real hardware. The doctor fills in the facts about
the machine, and a person fills in the other fields."""

from pathlib import Path

import pytest

from bridges.settings.load import load
from workbench.commissioning.doctor.finding import note, ok
from workbench.commissioning.doctor.form import STEPS, FormStep, form
from workbench.commissioning.doctor.machine import Machine

CONFIG = Path(__file__).parents[4] / "config"
PAGE = Path(__file__).parents[4] / "docs" / "how-to" / "hardware.md"


def test_the_form_has_the_machine_the_findings_and_empty_steps_of_the_files_buses(
    tmp_path: Path,
) -> None:
    (tmp_path / "proc" / "device-tree").mkdir(parents=True)
    (tmp_path / "proc" / "device-tree" / "model").write_bytes(b"Raspberry Pi 5 Model B\0")
    found = [ok("clock", "set"), note("pins", "a | b", "it means")]
    lines = form(load(CONFIG / "lift_dry_contact.yaml"), found, Machine(tmp_path)).splitlines()
    assert lines[0] == "# lift_dry_contact.yaml on Raspberry Pi 5 Model B"
    assert [line for line in lines if line.startswith(("| clock", "| pins"))] == [
        "| clock | ok | set |",
        "| pins | note | a \\| b |",
    ]
    steps = [line for line in lines if line.startswith("| H")]
    assert [line.split()[1] for line in steps] == ["H1", "H2", "H3", "H4", "H5", "H6", "H11"]
    assert all(line.endswith("| | | | |") for line in steps)


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step.number)
def test_each_step_is_on_the_page(step: FormStep) -> None:
    assert f"### {step.number}: " in PAGE.read_text(encoding="utf-8")

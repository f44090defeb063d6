"""A charger on contacts: the meaning of its contacts in combination, and the warnings of `check`."""

from pathlib import Path

from msgspec.structs import replace

from bridges.settings.load import load
from drivers.charger.dry_contact import debounce, tables, warnings

SETTINGS = load(Path(__file__).parents[3] / "config" / "charger_contacts.yaml").devices["charger_e"]


def test_every_combination_has_its_meaning_and_what_a_cut_makes_of_it() -> None:
    contacts, outputs = tables(SETTINGS)
    waits = "idle (handshake while enabled)"
    assert contacts.rows == (
        ("none", "released", "error: fault"),
        ("fault", "error", "nothing changes"),
        ("ready", waits, "released: ready; error: fault"),
        ("ready, fault", "error", "nothing changes"),
        ("charging", "charging", "released: charging; error: fault"),
        ("charging, fault", "error", "nothing changes"),
        ("charging, ready", "charging", f"{waits}: charging; error: fault"),
        ("charging, ready, fault", "error", "nothing changes"),
    )
    assert outputs.rows == (("enable", "on while a robot may charge"),)


def test_each_contact_has_a_debounce_which_the_yaml_may_change() -> None:
    assert debounce(SETTINGS) == {"charging": 0.05, "ready": 0.05, "fault": 0.1}
    inputs = replace(SETTINGS.inputs, fault=replace(SETTINGS.inputs.fault, debounce_s=0.3))
    changed = replace(SETTINGS, inputs=inputs)
    assert debounce(changed)["fault"] == 0.3
    assert list(warnings(changed)) == list(warnings(SETTINGS))

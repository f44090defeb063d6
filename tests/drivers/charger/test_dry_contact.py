"""A charger on contacts: the meaning of its contacts in combination, and the warnings of `check`."""

from pathlib import Path

from bridges.settings.load import load
from drivers.charger.dry_contact import tables

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

"""Stations with a moving pad. The tests use every bus that carries height, range and temperatures."""

import contextlib
from pathlib import Path
from typing import Any, ClassVar

import msgspec
import pytest

from bridges.kinds.charger.signals import Activity
from bridges.settings.load import SettingsError, load
from drivers.charger.dry_contact import decode
from drivers.charger.register_map import RegisterNumber
from drivers.hal.points import Input
from drivers.json_fields import JsonFlag
from drivers.json_fields import JsonNumber as HttpNumber
from tests.drivers.charger import test_contract as switched
from tests.drivers.charger.contract import OFF, Bench, MovingPadContract

CONTACTS = Path("config/charger_contacts.yaml")


class _Http(switched.TestAnotherMakeOnHttp):
    def settings(self) -> Any:
        settings = super().settings()
        fields = msgspec.structs.replace(
            settings.fields,
            range_ok=JsonFlag(field="pad.gap", when=["ok"]),
            at_height=JsonFlag(field="pad.raised"),
            temperatures={"coil": HttpNumber(field="pad.decidegrees", scale=0.1)},
        )
        return msgspec.structs.replace(settings, fields=fields)


class _Registers(switched.TestAnyMakeOnRegisters):
    def settings(self) -> Any:
        settings = super().settings()
        values = {
            "range_ok": RegisterNumber(at="discrete input 1"),
            "at_height": RegisterNumber(at="input register 8", bit=3),
            "coil": RegisterNumber(at="input register 9", scale=0.1, signed=True),
        }
        found = settings.map
        changed = msgspec.structs.replace(
            found, values={**found.values, **values}, temperatures={"coil": "coil"}
        )
        return msgspec.structs.replace(settings, map=changed)


class _Contacts(switched.TestContactsAtAModule):
    def settings(self) -> Any:
        settings = super().settings()
        inputs = msgspec.structs.replace(
            settings.inputs,
            at_height=Input(point="unit 1 discrete input 3", active="high"),
            range_ok=Input(point="unit 1 discrete input 4", active="high"),
        )
        return msgspec.structs.replace(settings, inputs=inputs)


class TestOnHttp(MovingPadContract):
    celsius: ClassVar = ("coil",)

    def benches(self) -> contextlib.AbstractContextManager[Bench]:
        return _Http().benches()


class TestOnRegisters(MovingPadContract):
    celsius: ClassVar = ("coil",)

    def benches(self) -> contextlib.AbstractContextManager[Bench]:
        return _Registers().benches()


class TestOnContacts(MovingPadContract):
    def benches(self) -> contextlib.AbstractContextManager[Bench]:
        return _Contacts().benches()


def test_xnergys_receiver_on_modbus_reports_its_two_temperatures() -> None:
    with switched.TestAReceiverOnModbus().benches() as bench:
        bench.driver.open()
        bench.scan(OFF)
        assert bench.driver.read().measured.temperatures == (("device", 25), ("coil", 25))
        bench.driver.close()


def test_contacts_that_are_not_wired_say_nothing_of_the_pad() -> None:
    found = decode({"charging": True}, enabled=True)
    assert (found.activity, found.measured.at_height, found.measured.range_ok) == (
        Activity.CHARGING,
        None,
        None,
    )


@pytest.mark.parametrize("signal", ["at_height", "range_ok"])
def test_a_contact_whose_cut_wire_would_energise_the_pad_is_refused(
    tmp_path: Path, signal: str
) -> None:
    text = CONTACTS.read_text()
    line = f'      {signal}: {{point: "unit 1 discrete input 5", active: low}}\n'
    file = tmp_path / "contacts.yaml"
    file.write_text(text.replace("    outputs:\n", f"{line}    outputs:\n"))
    with pytest.raises(SettingsError) as refused:
        load(file)
    (problem,) = refused.value.problems
    assert "so the station energises it" in problem.text

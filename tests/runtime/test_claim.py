"""A process that switches outputs off after a daemon's death. It takes its settings from the daemon's
record of claimed outputs.

If the process cannot decode these settings, the process reads the YAML text in the record.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from bridges.runtime import record
from bridges.runtime.record import ClaimedSettings, ClaimRecord
from bridges.settings.config import Config
from bridges.settings.load import SettingsError, load
from drivers.profiles import texts
from workbench.commissioning.examples import device_yamls

DEVICES = [file for file in device_yamls() if "\nbuses:" in file.read_text()]


BUILD = "r1.gabcdef0"


@pytest.fixture(autouse=True)
def _built(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Pretend to be an installed package with a build number. A checkout has no build number."""
    monkeypatch.setattr(record, "BUILD", BUILD)
    texts.give({})
    yield
    texts.give({})


def claimed(config: Config) -> tuple[object, ...]:
    """Return the parts of a Config that the process needs to switch off."""
    return (
        config.text,
        config.kind,
        config.driver,
        config.buses,
        config.devices,
        config.bus_types,
        {name: config.bus_of(name) for name in config.devices},
        {name: config.driver_type(name) for name in config.devices},
    )


def of_file(file: Path) -> tuple[Config, ClaimRecord, ClaimedSettings]:
    config = load(file)
    written = record.of(config)
    read = msgspec.json.decode(msgspec.json.encode(written), type=ClaimRecord)
    assert read == written
    assert read.claim is not None
    return config, read, read.claim


@pytest.mark.parametrize("file", DEVICES, ids=lambda file: file.stem)
def test_the_settings_in_a_record_are_those_of_its_yaml(file: Path) -> None:
    config, written, _ = of_file(file)
    # The second record has a spoiled YAML text. So a correct result can come only from its decoded
    # settings.
    assert claimed(msgspec.structs.replace(written, yaml=config.text).config()) == claimed(config)
    spoiled = msgspec.structs.replace(written, yaml=b"kind: [").config()
    assert claimed(spoiled)[1:] == claimed(config)[1:]


def test_settings_of_another_version_or_that_do_not_decode_are_made_from_the_yaml() -> None:
    config, written, claim = of_file(DEVICES[0])
    odd = [
        msgspec.structs.replace(claim, version="0.0.9", kind="hatch"),
        msgspec.structs.replace(claim, driver="no_such_driver"),
        msgspec.structs.replace(claim, buses={"can": ("no_such_bus", b"{}")}),
        msgspec.structs.replace(claim, devices=dict.fromkeys(config.devices, b'{"odd": 1}')),
        msgspec.structs.replace(claim, devices=dict.fromkeys(config.devices, b"[[")),
        None,
    ]
    for each in odd:
        texts.give({})
        found = msgspec.structs.replace(written, claim=each).config()
        assert claimed(found) == claimed(config)


def test_settings_of_an_unknown_build_are_made_from_the_yaml(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, written, _ = of_file(DEVICES[0])
    spoiled = msgspec.structs.replace(written, yaml=b"kind: [")
    assert spoiled.config().devices
    monkeypatch.setattr(record, "BUILD", "")
    with pytest.raises(SettingsError):
        spoiled.config()


def test_nothing_that_takes_long_to_import_is_imported_to_switch_off() -> None:
    _, written, _ = of_file(next(file for file in DEVICES if file.stem == "lift_dry_contact"))
    code = (
        f"import sys, msgspec, bridges; bridges.BUILD = {BUILD!r}; import bridges.runtime.dead_daemon;"
        "from bridges.runtime.record import ClaimRecord;"
        "config = msgspec.json.decode(sys.stdin.buffer.read(), type=ClaimRecord).config();"
        "[config.driver_type(name) for name in config.devices];"
        "slow = {'yaml', 'bridges.settings.load', 'gpiozero', 'dataclasses', 'difflib'};"
        "print(*slow & sys.modules.keys())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], input=msgspec.json.encode(written), capture_output=True
    )
    assert (done.stdout, done.stderr) == (b"\n", b"")

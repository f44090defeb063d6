"""The longest duration of a bus call. Systemd's watchdog must not take the call for a hang."""

import re
from pathlib import Path

import pytest
from msgspec.structs import replace

from bridges.commands.run import too_slow
from bridges.settings.load import SettingsError, load

ROOT = Path(__file__).parents[2]
HTTP = (ROOT / "config/charger_http.yaml").read_text()


def with_timeout(folder: Path, timeout_s: float) -> Path:
    file = folder / "charger.yaml"
    file.write_text(re.sub(r'(api_base: "[^"]*")', rf"\1, timeout_s: {timeout_s}", HTTP, count=1))
    return file


def test_check_refuses_a_call_that_is_longer_than_the_watchdog(tmp_path: Path) -> None:
    unit = (ROOT / "systemd/rmf-bridge@.service").read_text()
    found = re.search(r"^WatchdogSec=(\d+)$", unit, re.MULTILINE)
    assert found
    watchdog_s = float(found[1])
    assert too_slow(load(with_timeout(tmp_path, 5)), watchdog_s) == ""
    with pytest.raises(SettingsError, match="timeout_s"):
        load(with_timeout(tmp_path, 5.1))


def test_run_refuses_a_call_that_is_too_long_for_the_unit_as_installed(tmp_path: Path) -> None:
    config = load(with_timeout(tmp_path, 3))
    bus = next(iter(config.buses))
    assert too_slow(config, 5.0) == (
        f"{config.path}: bus '{bus}': timeout_s is 3 s, but the unit has WatchdogSec=5: one call may"
        " take half of that at most"
    )
    assert too_slow(config, None) == ""
    assert too_slow(replace(config, buses={}), 5.0) == ""

"""A record of claimed outputs. The record has all data that a process needs to switch off, even if
files on the disk change later."""

from collections.abc import Iterator
from pathlib import Path
from threading import Event

import pytest

from bridges.runtime import record
from bridges.runtime.predecessor import Predecessor, SafeFirst
from bridges.runtime.record import ClaimRecord, Records
from bridges.settings.load import SettingsError, load
from bridges.system.directories import Directories
from drivers import DriverError
from drivers.charger import can_frames, dbc
from drivers.profiles import texts

CONFIG = Path(__file__).parents[2] / "config"


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    texts.give({})
    yield
    texts.give({})


def test_the_record_of_a_charger_has_its_profile_and_its_dbc() -> None:
    written = record.of(load(CONFIG / "charger_wiferion.yaml"))
    assert sorted(written.texts) == ["wiferion.dbc", "wiferion.yaml"]
    assert written.texts["wiferion.dbc"] == (texts.FOLDER / "wiferion.dbc").read_bytes()


def test_a_claim_is_read_as_it_was_recorded_and_not_as_the_disk_has_it_now() -> None:
    file = CONFIG / "charger_wiferion.yaml"
    written = record.of(load(file))
    profile = written.texts["wiferion.yaml"].replace(b"dbc: wiferion.dbc", b"dbc: gone.dbc")
    older = {"wiferion.yaml": profile, "gone.dbc": written.texts["wiferion.dbc"]}
    found = ClaimRecord(written.file, written.yaml, older).config()
    (settings,) = found.devices.values()
    assert can_frames.frame_map(settings).dbc == "gone.dbc"
    assert dbc.load("gone.dbc").frames() == dbc.Dbc(written.texts["wiferion.dbc"].decode()).frames()
    texts.give({})
    (as_it_is_now,) = load(file).devices.values()
    assert can_frames.frame_map(as_it_is_now).dbc == "wiferion.dbc"


def test_a_profile_that_is_gone_from_the_disk_is_found_in_the_record() -> None:
    written = record.of(load(CONFIG / "door_register.yaml"))
    renamed = ClaimRecord(
        written.file,
        written.yaml.replace(b"profile: generic-register-door", b"profile: no-more"),
        {"no-more.yaml": written.texts["generic-register-door.yaml"]},
    )
    assert list(renamed.config().devices) == list(written.config().devices)
    texts.give({})
    with pytest.raises(SettingsError, match="unknown profile 'no-more'"):
        ClaimRecord(renamed.file, renamed.yaml, {}).config()


class Silent:
    """A device that answers from the third try on."""

    def __init__(self) -> None:
        self.called: list[str] = []

    def open(self) -> None:
        self.called.append("open")
        if self.called.count("open") < 3:
            raise DriverError("no reply")

    def read(self) -> None:
        self.called.append("read")

    def write(self, outputs: object) -> None:
        self.called.append("write")

    def make_safe(self) -> None:
        self.called.append("make_safe")

    def close(self) -> None:
        self.called.append("close")


def test_a_device_that_a_dead_daemon_left_on_is_made_safe_once_as_soon_as_it_answers() -> None:
    silent = Silent()
    driver = SafeFirst("station", silent)
    for _ in range(2):
        with pytest.raises(DriverError):
            driver.open()
    driver.open()
    driver.read()
    driver.open()
    assert silent.called == ["open", "open", "open", "make_safe", "read", "open"]


@pytest.mark.parametrize("tried", [True, False])
def test_a_start_has_another_process_switch_off_its_own_devices_unless_one_just_has_tried(
    tmp_path: Path, tried: bool
) -> None:
    places = Directories(tmp_path / "run", tmp_path / "state")
    places.runtime.mkdir()
    config = load(CONFIG / "door_register.yaml")
    ours = record.of(config)
    records = Records(places)
    records.write(ours)
    if tried:
        records.still_unsafe(ours, config.devices, config)
    started = tmp_path / "started"
    predecessor = Predecessor(records, ours, ["sh", "-c", f"touch {started}", "outputs-off"])
    assert predecessor.make_safe(Event().wait) == set(config.devices)
    assert (predecessor.left(), started.exists()) == ([], not tried)
